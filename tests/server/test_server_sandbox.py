"""The sandbox: tasks in worker processes that are limited, killed and replaced while others go on."""

from __future__ import annotations

import fcntl
import io
import os
import resource
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from spem.codes.collection import encode_collection, encode_file
from spem.codes.settings import Settings
from spem.errors import ParameterError, ReadError, SandboxError, SizeError, SpemError
from spem.index.row import pack
from spem.server.arrays import pack_arrays
from spem.server.processes import Process
from spem.server.sandbox import Sandbox
from spem.server.tasks import unpack_rows
from spem.shapes.synthetic import disk

MEMORY = 256 << 20
PATIENCE = 120.0
# A number of a descriptor that `select` does not take.
HIGH = 1100


def picture(size: int = 40) -> bytes:
    """Return a PNG file of a bar."""
    pixels = np.zeros((size, size), np.uint8)
    pixels[size // 4 : size // 2, 5:-5] = 255
    buffer = io.BytesIO()
    Image.fromarray(pixels).save(buffer, "PNG")
    return buffer.getvalue()


def until(true: Callable[[], bool]) -> None:
    """Wait for something to become true."""
    end = time.monotonic() + PATIENCE
    while not true():
        assert time.monotonic() < end
        time.sleep(0.02)


@pytest.fixture(scope="module")
def model_file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the file of a small model of silhouettes."""
    shapes = [disk(1.0, 0.2), disk(1.0, 0.1)]
    made = encode_collection(shapes, Settings(features="spem", voxels=400, n_maps=3, n_centers=4, levels=1))
    path: Path = tmp_path_factory.mktemp("model") / "model.spem"
    made.model.save(path)
    return path


@pytest.fixture(scope="module")
def sandbox() -> Iterator[Sandbox]:
    """Yield a sandbox of two workers."""
    with Sandbox(2, MEMORY, PATIENCE) as made:
        yield made


@pytest.fixture
def header(model_file: Path) -> dict[str, Any]:
    """Return the header of an upload."""
    return {"name": "../../bar.png", "model_file": str(model_file), "voxels": 10_000}


def workers(sandbox: Sandbox) -> list[Process]:
    """Return the processes of a sandbox that is idle."""
    until(lambda: sandbox.stats()["free"] == sandbox.n_workers)
    return list(sandbox._all)


def test_an_upload_is_coded_as_here(
    sandbox: Sandbox, header: dict[str, Any], model_file: Path, tmp_path: Path
) -> None:
    """The row has the code that the file has here and the client's name without its path."""
    from spem.codes.model import Model

    stages: list[str] = []
    [row] = unpack_rows(
        *sandbox.run("encode", header, picture(), progress=lambda stage, _: stages.append(stage))
    )
    (tmp_path / "bar.png").write_bytes(picture())
    assert np.allclose(row.code, encode_file(tmp_path / "bar.png", Model.load(model_file)), atol=1e-6)
    assert (row.name, row.path, row.report["source"]) == ("bar", "bar.png", "bar.png")
    assert row.thumbnail.startswith(b"\x89PNG")
    assert stages == ["reading", "coding"]


def test_errors_of_readers_come_through_without_a_path(sandbox: Sandbox, header: dict[str, Any]) -> None:
    """A damaged file raises what its reader raises, under the name that the client gave."""
    with pytest.raises(ReadError, match=r"^bar\.png: .*damaged or truncated"):
        sandbox.run("encode", header, picture()[:60])
    assert sandbox.stats()["died"] == 0


def test_what_no_reader_raises_is_told_in_one_line(sandbox: Sandbox) -> None:
    """An error that nobody meant costs no worker; what it was is for the log alone."""
    with pytest.raises(SandboxError, match=r"unexpected KeyError.*report") as caught:
        sandbox.run("view", {"view": "no such view"}, pack(disk(1.0, 0.2)))
    assert "Traceback" in caught.value.detail
    assert caught.value.reason == "unexpected"


def test_a_shape_of_too_many_voxels_is_refused(sandbox: Sandbox, header: dict[str, Any]) -> None:
    """The limit is on what is inside after resampling."""
    with pytest.raises(SizeError, match=r"voxels inside, the limit is 10"):
        sandbox.run("encode", header | {"voxels": 10}, picture())


def test_a_bomb_within_its_header_meets_the_memory_limit(sandbox: Sandbox, header: dict[str, Any]) -> None:
    """An image of more pixels than memory is refused by its header, and the worker lives on."""
    buffer = io.BytesIO()
    Image.new("1", (9000, 9000)).save(buffer, "PNG")
    with pytest.raises((SizeError, SandboxError), match=r"cells need|more than"):
        sandbox.run("encode", header, buffer.getvalue())
    assert sandbox.run("encode", header, picture())[0]["rows"]


def test_workers_know_nothing_of_the_server(sandbox: Sandbox) -> None:
    """Neither its environment nor its files reach a worker, which leads a session of its own."""
    for worker in workers(sandbox):
        pid = worker.process.pid
        environment = Path(f"/proc/{pid}/environ").read_bytes()
        assert b"SPEM_TOKEN" not in environment
        assert b"AWS_" not in environment
        assert os.getsid(pid) == pid
        assert Path(f"/proc/{pid}/cwd").resolve() == worker.home
        opened = {str(link.readlink()) for link in Path(f"/proc/{pid}/fd").iterdir()}
        assert all(name.startswith(("/dev/null", "pipe:")) for name in opened)


def test_one_hangs_and_one_dies_while_others_answer(sandbox: Sandbox, header: dict[str, Any]) -> None:
    """A worker that stops is killed at its time, one that dies is replaced, and the others go on."""
    assert len(workers(sandbox)) == 2
    before = sandbox.stats()
    hung: list[Process] = []

    def stop(stage: str, _: float) -> None:
        if stage == "reading":
            hung.extend(sandbox._all - set(sandbox._free))
            os.kill(hung[0].process.pid, signal.SIGSTOP)

    caught: list[BaseException] = []

    def hang() -> None:
        try:
            sandbox.run("encode", header, picture(), seconds=2.0, progress=stop)
        except SandboxError as error:
            caught.append(error)

    thread = threading.Thread(target=hang)
    thread.start()
    until(lambda: bool(hung))
    assert sandbox.run("encode", header, picture())[0]["rows"]
    [dead] = sandbox._all - set(hung)
    os.kill(dead.process.pid, signal.SIGKILL)
    thread.join()
    assert sandbox.run("encode", header, picture())[0]["rows"]
    assert [str(error) for error in caught] == [
        "stopped after 2 s, the time limit of a task; send a smaller or coarser shape"
    ]
    assert {hung[0], dead}.isdisjoint(workers(sandbox))
    after = sandbox.stats()
    assert (after["time"], after["died"]) == (before["time"] + 1, before["died"] + 1)
    assert not hung[0].home.exists()


def test_a_task_that_loses_its_worker_or_is_cancelled_says_so(
    sandbox: Sandbox, header: dict[str, Any]
) -> None:
    """Why a task ended is told in one line, and another worker comes."""
    cancelled = threading.Event()

    def kill(*_: object) -> None:
        [worker] = sandbox._all - set(sandbox._free)
        os.kill(worker.process.pid, signal.SIGKILL)

    def cancel(*_: object) -> None:
        [worker] = sandbox._all - set(sandbox._free)
        os.kill(worker.process.pid, signal.SIGSTOP)
        cancelled.set()

    assert len(workers(sandbox)) == 2
    with pytest.raises(SandboxError, match=r"process of this task died \(SIGKILL\)"):
        sandbox.run("encode", header, picture(), progress=kill)
    assert len(workers(sandbox)) == 2
    with pytest.raises(SandboxError, match="cancelled"):
        sandbox.run("encode", header, picture(), progress=cancel, cancelled=cancelled)


def test_tasks_of_a_closed_sandbox_are_refused(header: dict[str, Any]) -> None:
    """Who waits for a worker when the server goes down is told."""
    sandbox = Sandbox(1, MEMORY, PATIENCE)
    threading.Timer(0.1, sandbox.close).start()
    with pytest.raises(SandboxError, match="going down"):
        sandbox.run("encode", header, picture())
    assert not sandbox.ready()


def test_workers_die_with_their_parent(tmp_path: Path) -> None:
    """When the server is killed its workers end by themselves, and leave no folder."""
    script = (
        "import sys, time\nfrom pathlib import Path\nfrom spem.server.processes import Process\n"
        "worker = Process.start(Path(sys.argv[1]), 1 << 30)\n"
        "print(worker.process.pid, worker.home, flush=True)\ntime.sleep(600)\n"
    )
    command = [sys.executable, "-c", script, str(tmp_path)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as server:
        assert server.stdout
        pid, home = server.stdout.readline().split()
        server.kill()
    until(lambda: "Z" in state_of(pid))
    until(lambda: not Path(home).exists())


def state_of(pid: str) -> str:
    """Return the state of a process."""
    try:
        return Path(f"/proc/{pid}/stat").read_text(encoding="ascii").rpartition(")")[2].split()[0]
    except FileNotFoundError:
        return "Z"


@pytest.mark.parametrize("limits", [{"n_workers": 0}, {"memory_limit": -1}, {"seconds": 0.0}])
def test_limits_must_be_positive(limits: dict[str, Any]) -> None:
    """A sandbox without workers, memory or time is refused."""
    with pytest.raises(ParameterError, match="must be positive"):
        Sandbox(**limits)


def test_pipes_may_have_any_number(tmp_path: Path) -> None:
    """Descriptors above 1023, as a server of many connections has them, do for the pipes of a worker."""
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    if hard < HIGH + 8:
        pytest.skip(f"this machine allows {hard} open files")
    resource.setrlimit(resource.RLIMIT_NOFILE, (max(soft, HIGH + 8), hard))
    low = [os.pipe() for _ in range(2)]
    high = [fcntl.fcntl(end, fcntl.F_DUPFD_CLOEXEC, HIGH) for pair in low for end in pair]
    idle = subprocess.Popen([sys.executable, "-c", "input()"], stdin=subprocess.PIPE, start_new_session=True)
    worker = Process(idle, requests=high[1], replies=high[2], lifeline=high[0], home=tmp_path / "home")
    try:
        os.write(high[3], (4).to_bytes(8, "little") + b"said")
        assert worker.receive(100, lambda: None) == b"said"
        worker.send(b"heard", lambda: None)
        assert os.read(low[0][0], 100)[8:] == b"heard"
    finally:
        worker.drop()
        assert idle.stdin is not None
        idle.stdin.close()
        for end in (*low[0], *low[1], high[3]):
            os.close(end)
        resource.setrlimit(resource.RLIMIT_NOFILE, (soft, hard))


def test_a_worker_that_does_not_start_leaves_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Where the system has no room for a process its pipes are closed and its folder is removed."""

    def full(*_: object, **__: object) -> None:
        raise OSError(11, "Resource temporarily unavailable")

    monkeypatch.setattr(subprocess, "Popen", full)
    before = len(list(Path("/proc/self/fd").iterdir()))
    with pytest.raises(OSError, match="unavailable"):
        Process.start(tmp_path, MEMORY)
    assert len(list(Path("/proc/self/fd").iterdir())) == before
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    "body",
    [
        pack_arrays({"state": "stage"}, {}),
        pack_arrays({"state": "stage", "stage": "x", "share": "much"}, {}),
        pack_arrays({"state": "done", "header": []}, {}),
        pack_arrays({"state": "error", "kind": "annotations", "message": "x"}, {}),
        b"\xff\xff\0\0" + b"[" * 0xFFFF,
    ],
)
def test_a_forged_reply_is_an_error_of_its_task(
    sandbox: Sandbox, body: bytes, monkeypatch: pytest.MonkeyPatch
) -> None:
    """What a worker sends that was taken over raises nothing but errors of this library."""
    workers(sandbox)
    monkeypatch.setattr(Process, "send", lambda *_: None)
    monkeypatch.setattr(Process, "receive", lambda *_: body)
    # no worker is hurt: nothing is sent, so that it may go on
    monkeypatch.setattr(Sandbox, "_discard", lambda sandbox, worker, _: sandbox._give(worker))
    with pytest.raises(SpemError, match=r"no reply|cannot be processed|^x$"):
        sandbox.run("view", {})
