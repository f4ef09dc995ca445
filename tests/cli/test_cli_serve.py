"""``spem serve`` before it serves: what it refuses, and where the token comes from."""

from __future__ import annotations

import pytest
from typer.testing import CliRunner

pytest.importorskip("lancedb")
pytest.importorskip("fastapi")

from spem.cli.app import app
from spem.index.index import Index
from spem.server import running
from spem.server.spool import Spool
from spem.shapes import synthetic

TOKEN = "0123456789abcdef0123"  # noqa: S105


@pytest.fixture(scope="module")
def folder(tmp_path_factory) -> str:
    made = tmp_path_factory.mktemp("serve") / "db"
    shapes = [synthetic.disk(radius=radius, spacing=1.0) for radius in (4.0, 5.0)]
    Index.open(made).add(shapes, features="spem", voxels=None, n_centers=4)
    return str(made)


@pytest.fixture
def started(monkeypatch, folder):
    """Return the options of servers that would have been started, and the folder of an index."""
    found = []
    monkeypatch.setattr(
        running, "run", lambda index, options, opened: (found.append(options), opened.close())
    )
    monkeypatch.delenv("SPEM_TOKEN", raising=False)
    return found, folder


def run(*arguments: str, **environment: str):
    return CliRunner().invoke(app, ["serve", *arguments], env=environment)


def test_loopback_without_a_token(started):
    """Unless told otherwise only this machine reaches the server, and nobody writes."""
    options, db = started
    done = run(db, "--port", "0")
    assert done.exit_code == 0, done.output
    assert "http://127.0.0.1:" in done.stdout
    assert (options[0].host, options[0].token) == ("127.0.0.1", None)


def test_token_of_the_environment_or_a_file(started, tmp_path):
    """A token comes from the environment, from a file, or is made and printed."""
    options, db = started
    run(db, "--port", "0", SPEM_TOKEN=TOKEN)
    (tmp_path / "token").write_text(TOKEN[::-1] + "\n")
    run(db, "--port", "0", "--token-file", str(tmp_path / "token"))
    made = run(db, "--port", "0", "--new-token")
    assert [option.token for option in options[:2]] == [TOKEN, TOKEN[::-1]]
    assert options[2].token in made.stdout


def test_other_addresses_are_warned_of(started):
    """Who lets others in is told what they may do."""
    _, db = started
    done = run(db, "--port", "0", "--host", "0.0.0.0")  # noqa: S104
    assert "everyone who reaches this machine can read" in done.stderr


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        (("nowhere",), "nowhere"),
        (("DB", "--token-file", "nowhere"), "the token cannot be read"),
        (("DB", "--root-path", "x"), "expected a path such as /shapes"),
    ],
)
def test_one_line_on_what_is_wrong(started, arguments, told):
    """What cannot be served is told on one line."""
    done = run(*(started[1] if argument == "DB" else argument for argument in arguments))
    assert done.exit_code == 2
    assert told in done.stderr
    assert len(done.stderr.strip().splitlines()) == 1


def test_sizes_are_in_mebibytes(started):
    """Memory and uploads are given in MiB."""
    options, db = started
    run(db, "--port", "0", "--memory", "1024", "--upload", "2")
    assert (options[0].memory, options[0].upload_bytes) == (1 << 30, 2 << 20)


def test_folder_of_another_server(started, tmp_path):
    """A folder for jobs that another server uses is refused in one line, before anything starts."""
    options, db = started
    held = Spool(tmp_path)
    done = run(db, "--port", "0", "--state", str(tmp_path))
    held.close()
    assert done.exit_code != 0
    assert "another server uses this folder" in done.stderr
    assert "serving" not in done.stdout
    assert options == []
    assert run(db, "--port", "0", "--state", str(tmp_path)).exit_code == 0
