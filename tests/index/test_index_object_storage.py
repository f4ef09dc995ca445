"""Tests of an index on object storage, against a server of S3 on this machine."""

from __future__ import annotations

import shutil
import socket
import subprocess
import sys
import time
import urllib.request
from collections.abc import Callable, Iterator
from pathlib import Path
from threading import Thread

import pytest

from spem.codes.model import Model
from spem.errors import ReadError
from spem.index.index import Index
from spem.index.row import Row
from spem.index.updates import write


@pytest.fixture(scope="module")
def storage() -> Iterator[dict[str, str]]:
    """Start a server of S3 with one bucket, and return the options that lead to it."""
    program = shutil.which("moto_server", path=str(Path(sys.executable).parent)) or shutil.which(
        "moto_server"
    )
    if program is None:
        pytest.skip("moto_server is not installed: pip install 'moto[server]'")
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    command = [program, "-H", "127.0.0.1", "-p", str(port)]
    server = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    address = f"http://127.0.0.1:{port}"
    try:
        _make_bucket(address)
        yield {
            "aws_endpoint": address,
            "allow_http": "true",
            "aws_region": "us-east-1",
            "aws_access_key_id": "key",
            "aws_secret_access_key": "secret",
            "client_max_retries": "1",
        }
    finally:
        server.kill()
        server.wait()


def _make_bucket(address: str) -> None:
    """Wait for the server, and make the bucket."""
    request = urllib.request.Request(f"{address}/shapes", method="PUT")  # noqa: S310
    for _ in range(600):
        try:
            urllib.request.urlopen(request).close()  # noqa: S310
        except OSError:
            time.sleep(0.1)
        else:
            return
    pytest.skip("moto_server did not answer within a minute")


def test_an_index_lives_on_object_storage(
    storage: dict[str, str], tiny_model: Model, ready_row: Callable[..., Row]
) -> None:
    """The same calls as in a folder: write, read, label, search, remove, check, compact."""
    index = Index.open("s3://shapes/one", storage_options=storage)
    index.store.save_model(tiny_model)
    write(index.store, tiny_model.digest, [ready_row("cat"), ready_row("dog")])
    again = Index.open("s3://shapes/one", create=False, storage_options=storage)
    assert again.search(ready_row("cat").code, k=1)[0].row.name == "cat"
    assert again.annotate(where="name = 'cat'", label="cats") == 1
    assert again.remove(where="label = 'cats'") == 1
    index.store.compact()
    assert [row.name for row in index.rows()] == ["dog"]
    assert index.check() == ()


def test_two_writers_on_object_storage(
    storage: dict[str, str], tiny_model: Model, ready_row: Callable[..., Row]
) -> None:
    """Without a lock the database settles who is first: no row is lost or doubled, and no path."""

    def add(me: str) -> None:
        """Write rows in small steps."""
        index = Index.open("s3://shapes/two", storage_options=storage)
        index.store.save_model(tiny_model)
        for i in range(4):
            write(
                index.store,
                tiny_model.digest,
                [ready_row(f"{i}", path=f"/{me}/{i}.png"), ready_row(f"{me}{i}")],
            )

    writers = [Thread(target=add, args=(name,)) for name in "ab"]
    for writer in writers:
        writer.start()
    for writer in writers:
        writer.join()
    index = Index.open("s3://shapes/two", storage_options=storage)
    rows = index.rows()
    assert len(rows) == len({row.id for row in rows}) == 12
    assert sum(len(row.copies) for row in rows) == 4
    assert index.check() == ()


def test_the_environment_leads_there(
    storage: dict[str, str], monkeypatch: pytest.MonkeyPatch, tiny_model: Model
) -> None:
    """Keys and endpoint may come from the environment, as other programs have them."""
    for name, value in storage.items():
        monkeypatch.setenv(name.upper(), value)
    Index.open("s3://shapes/three").store.save_model(tiny_model)
    assert Index.open("s3://shapes/three", create=False).digest() == tiny_model.digest


def test_what_cannot_be_reached_is_told(storage: dict[str, str]) -> None:
    """No index, no bucket, no such storage: one line each."""
    with pytest.raises(ReadError, match="no index there"):
        Index.open("s3://shapes/none", create=False, storage_options=storage)
    with pytest.raises(ReadError, match=r"cannot be reached \(The specified bucket does not exist\)"):
        Index.open("s3://buckets-of-others/x", storage_options=storage)
    with pytest.raises(ReadError, match="No object store provider found for scheme: 'foo'"):
        Index.open("foo://shapes/x")
