"""One worker process seen from the server: its pipes, its environment, its end."""

from __future__ import annotations

import contextlib
import json
import os
import select
import shutil
import signal
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Self

from spem.errors import SandboxError
from spem.server.worker import LENGTH_BYTES

# Seconds between two looks at whether to go on.
_LOOK = 0.1
_CHUNK = 1 << 20
# Seconds that a process may take to end after it let go of its pipe.
_LAST_BREATH = 1.0
# Where the interpreter finds its packages and compiled kernels; nothing else of the server's is passed on.
_KEPT = ("PATH", "PYTHONPATH", "PYTHONHOME", "LD_LIBRARY_PATH", "NUMBA_CACHE_DIR", "LANG", "LC_ALL", "TZ")
_THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS")


@dataclass(frozen=True, eq=False)
class Process:
    """A worker process.

    Parameters
    ----------
    process
        The process, which leads a session of its own.
    requests, replies, lifeline
        The server's ends of its pipes; the last is held open for as long as the server lives.
    home
        Its folder.
    """

    process: subprocess.Popen[bytes]
    requests: int
    replies: int
    lifeline: int
    home: Path
    _end: threading.Lock = field(default_factory=threading.Lock)

    @classmethod
    def start(cls, folder: Path, memory_limit: int) -> Self:
        """Start a process in a new folder below one."""
        home = Path(tempfile.mkdtemp(prefix="worker-", dir=folder))
        with contextlib.ExitStack() as theirs, contextlib.ExitStack() as ours:
            ours.callback(shutil.rmtree, home, ignore_errors=True)
            requests, to_worker = _pipe(theirs, ours)
            from_worker, replies = _pipe(ours, theirs)
            lifeline, held = _pipe(theirs, ours)
            ends = {"requests": requests, "replies": replies, "lifeline": lifeline}
            process = subprocess.Popen(  # noqa: S603 the interpreter itself
                # -P keeps its folder off the path of modules, -s the user's own packages
                [
                    sys.executable,
                    "-P",
                    "-s",
                    "-m",
                    "spem.server.worker",
                    json.dumps(ends | {"memory_limit": memory_limit}),
                ],
                stdin=subprocess.DEVNULL,
                stdout=subprocess.DEVNULL,
                stderr=subprocess.DEVNULL,
                cwd=home,
                env=_environment(home),
                pass_fds=tuple(ends.values()),
                start_new_session=True,
            )
            ours.pop_all()
        os.set_blocking(to_worker, False)
        return cls(process, to_worker, from_worker, held, home)

    def alive(self) -> bool:
        """Tell whether it is there; it is not reaped, so that its number stays its own."""
        with contextlib.suppress(ChildProcessError):
            return os.waitid(os.P_PID, self.process.pid, os.WEXITED | os.WNOWAIT | os.WNOHANG) is None
        return False

    def send(self, body: bytes, go_on: Callable[[], None]) -> None:
        """Write a frame; `go_on` is called now and then, and raises to give up."""
        left = memoryview(len(body).to_bytes(LENGTH_BYTES, "little") + body)
        while left:
            go_on()
            try:
                written = (
                    os.write(self.requests, left[:_CHUNK]) if _ready(self.requests, select.POLLOUT) else 0
                )
            except BlockingIOError:
                continue
            except OSError as error:
                raise self._dead() from error
            left = left[written:]

    def receive(self, most_bytes: int, go_on: Callable[[], None]) -> bytes:
        """Read a frame of at most so many bytes; `go_on` is as in `send`."""
        length = int.from_bytes(self._read(LENGTH_BYTES, go_on), "little")
        if length > most_bytes:
            msg = (
                f"the reply of this task has {length} bytes, the limit is {most_bytes}; send a smaller shape"
            )
            raise SandboxError(msg, "memory")
        return self._read(length, go_on)

    def kill(self) -> None:
        """End it with all that it started, and remove its folder; its pipes stay open for who reads them."""
        with self._end:
            if self.process.returncode is not None:
                return
            with contextlib.suppress(ProcessLookupError, PermissionError):
                os.killpg(self.process.pid, signal.SIGKILL)
            self.process.wait()
            shutil.rmtree(self.home, ignore_errors=True)

    def drop(self) -> None:
        """Kill it and close its pipes: for who has it to himself."""
        self.kill()
        for end in (self.requests, self.replies, self.lifeline):
            os.close(end)

    def _read(self, count: int, go_on: Callable[[], None]) -> bytes:
        """Read so many bytes."""
        parts = bytearray()
        while len(parts) < count:
            go_on()
            if _ready(self.replies, select.POLLIN):
                part = os.read(self.replies, min(count - len(parts), _CHUNK))
                if not part:
                    raise self._dead()
                parts += part
        return bytes(parts)

    def _fate(self) -> tuple[bool, int]:
        """Return whether it was killed, and the signal or its status; a live one is about to be killed."""
        with contextlib.suppress(ChildProcessError):
            found = os.waitid(os.P_PID, self.process.pid, os.WEXITED | os.WNOWAIT | os.WNOHANG)
            if found is not None:
                return found.si_code != os.CLD_EXITED, found.si_status
        return True, signal.SIGKILL

    def _dead(self) -> SandboxError:
        """Say how it died."""
        end = time.monotonic() + _LAST_BREATH
        while self.alive() and time.monotonic() < end:
            time.sleep(_LAST_BREATH / 100)
        killed, status = self._fate()
        if killed and status == signal.SIGXCPU:
            msg = "stopped at the time limit of a task; send a smaller or coarser shape"
            return SandboxError(msg, "time")
        how = signal.Signals(status).name if killed else f"status {status}"
        msg = f"the process of this task died ({how}); the file may be damaged, or too large for its memory"
        return SandboxError(msg, "died")


def _pipe(reader: contextlib.ExitStack, writer: contextlib.ExitStack) -> tuple[int, int]:
    """Open a pipe whose ends are closed with these."""
    ends = os.pipe()
    for stack, end in zip((reader, writer), ends, strict=True):
        stack.callback(os.close, end)
    return ends


def _ready(end: int, event: int) -> bool:
    """Wait a moment for a pipe; `select` would take no descriptor above 1023, which a busy server has."""
    poll = select.poll()
    poll.register(end, event)
    return bool(poll.poll(1000 * _LOOK))


def _environment(home: Path) -> dict[str, str]:
    """Return the environment of a worker."""
    kept = {name: os.environ[name] for name in _KEPT if name in os.environ}
    folders = dict.fromkeys(("HOME", "TMPDIR", "XDG_CONFIG_HOME"), str(home))
    # compiled kernels lie there where the package cannot be written; without them a start takes a minute
    folders["XDG_CACHE_HOME"] = os.environ.get("XDG_CACHE_HOME") or str(Path.home() / ".cache")
    return (
        kept | folders | dict.fromkeys(_THREADS, "1") | {"MPLBACKEND": "agg", "PYTHONDONTWRITEBYTECODE": "1"}
    )
