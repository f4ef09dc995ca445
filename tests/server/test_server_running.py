"""A server as a process: what it prints, what it logs, and how it stops."""

from __future__ import annotations

import asyncio
import contextlib
import io
import json
import os
import signal
import socket
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import spem

pytest.importorskip("lancedb")
pytest.importorskip("fastapi")

import httpx

from spem.errors import ParameterError, SandboxError
from spem.index.index import Index
from spem.server.options import ServerOptions
from spem.server.running import listen
from spem.server.services import Services
from spem.server.spool import Spool


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    made = tmp_path_factory.mktemp("running")
    shapes = [spem.synthetic.disk(radius=6.0, spacing=1.0), spem.synthetic.star_polygon(5, 2)]
    Index.open(made / "db").add(shapes, features="spem", voxels=None, n_centers=4)
    return made


@contextlib.contextmanager
def running(folder, *options):
    """Run a server; yield a client, and the process, which has ended afterwards."""
    log = (folder / "log").open("w")
    command = [
        sys.executable,
        "-m",
        "spem",
        "serve",
        str(folder / "db"),
        "--port",
        "0",
        "--workers",
        "1",
        *options,
    ]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=log, text=True, env=dict(os.environ))
    try:
        line = process.stdout.readline()
        assert line.startswith("serving"), (folder / "log").read_text()
        with httpx.Client(base_url=line.split()[-1], timeout=30) as client:
            yield client, process
    finally:
        process.kill()
        process.communicate()
        log.close()


def square(size: int) -> bytes:
    content = io.BytesIO()
    np.save(content, np.pad(np.ones((size, size), np.uint8), 2))
    return content.getvalue()


def test_stops_on_sigterm_and_keeps_its_jobs(folder, tmp_path):
    """Told to stop a server ends with status 0, its workers too; its jobs are done or kept for the next."""
    state = tmp_path / "state"
    with running(folder, "--state", str(state)) as (client, process):
        files = [{"file": ("box.npy", square(size))} for size in (12, 13, 14)]
        jobs = [client.post("/api/search", files=file).json()["job"] for file in files]
        workers = _children(process.pid)
        process.send_signal(signal.SIGTERM)
        assert process.wait(60) == 0, (folder / "log").read_text()
    kept = [json.loads((state / f"{job}.json").read_text()) for job in jobs]
    assert {job["state"] for job in kept} <= {"queued", "done"}
    assert {job["header"]["name"] for job in kept} == {"box.npy"}
    assert not any(Path(f"/proc/{pid}").exists() for pid in workers)
    lines = [json.loads(line) for line in (folder / "log").read_text().splitlines()]
    posted = next(line for line in lines if line.get("method") == "POST")
    assert (posted["route"], posted["status"], posted["client"]) == ("/api/search", 202, "127.0.0.1")


def _children(pid: int) -> list[int]:
    """Return the numbers of the processes that one has started, as far as the system tells."""
    listed = [file.read_text() for file in Path(f"/proc/{pid}/task").glob("*/children")]
    return [int(number) for text in listed for number in text.split()] or [0]


def test_a_taken_port_is_one_line():
    """A port that another program has is told with what to do."""
    with socket.create_server(("127.0.0.1", 0)) as other:
        port = other.getsockname()[1]
        with pytest.raises(ParameterError, match="in use; give another --port"):
            listen(ServerOptions(port=port))


@pytest.mark.parametrize(
    ("wrong", "told"),
    [
        ({"port": 70_000}, "port=70000"),
        ({"token": "short"}, "5 characters"),
        ({"root_path": "shapes"}, "root_path"),
        ({"n_workers": 0}, "n_workers=0"),
        ({"seconds": float("nan")}, "seconds=nan"),
        ({"rate": -1.0}, "rate=-1.0"),
    ],
)
def test_options_are_checked(wrong, told):
    """An option out of its range is refused before anything starts."""
    with pytest.raises(ParameterError, match=told):
        ServerOptions(**wrong)


def test_the_token_is_not_shown():
    """The token stands in no text that is made of the options."""
    assert "secret" not in repr(ServerOptions(token="secret-secret-secret"))  # noqa: S106


def test_a_start_that_fails_leaves_nothing_running(folder, tmp_path):
    """Where jobs have no folder the worker processes that were started by then are ended."""
    services = Services(Index.open(folder / "db"), ServerOptions(state=tmp_path, n_workers=1))
    held = Spool(tmp_path)
    with pytest.raises(ParameterError, match="another server uses this folder"):
        asyncio.run(services.start())
    held.close()
    assert services.sandbox.stats()["free"] == 0
    with pytest.raises(SandboxError, match="going down"):
        services.sandbox.run("view", {})
    assert not services.ready
