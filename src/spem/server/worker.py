"""A worker process: takes one task after another from a pipe, within limits, and ends with its parent.

Started by `spem.server.sandbox` as a fresh interpreter. It reads untrusted files: so it holds no secret of
the server, speaks in bodies of `spem.server.arrays` alone, and has limits for memory, time and files.
"""

from __future__ import annotations

import contextlib
import json
import os
import resource
import select
import shutil
import signal
import sys
import threading
import traceback
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from numpy.typing import NDArray

from spem.errors import SpemError
from spem.server.arrays import pack_arrays, unpack_arrays

#: Bytes that give the length of a frame; a body of arrays follows.
LENGTH_BYTES = 8
# Share of the memory limit that a worker may go on holding between tasks before it is replaced.
_MOST_KEPT = 0.25
_PAGE = resource.getpagesize()


@dataclass(frozen=True)
class Channel:
    """A worker's ends of its pipes.

    Parameters
    ----------
    requests, replies
        File descriptors.
    """

    requests: int
    replies: int

    def receive(self) -> bytes | None:
        """Read one frame; None at the end of the pipe."""
        length = self._read(LENGTH_BYTES)
        return None if length is None else self._read(int.from_bytes(length, "little"))

    def send(self, header: Mapping[str, Any], arrays: Mapping[str, NDArray[Any]] | None = None) -> None:
        """Write one frame."""
        body = pack_arrays(header, arrays or {})
        for part in (len(body).to_bytes(LENGTH_BYTES, "little"), body):
            left = memoryview(part)
            while left:
                left = left[os.write(self.replies, left) :]

    def _read(self, count: int) -> bytes | None:
        """Read so many bytes, or None where the pipe ends."""
        parts = bytearray()
        while len(parts) < count:
            part = os.read(self.requests, min(count - len(parts), 1 << 20))
            if not part:
                return None
            parts += part
        return bytes(parts)


def serve(channel: Channel, memory_limit: int) -> None:
    """Warm up, say so, and answer requests until the pipe ends."""
    from spem.server import tasks

    _warm_up()
    base = _address_space()
    resource.setrlimit(resource.RLIMIT_AS, (base + memory_limit,) * 2)
    channel.send({"state": "ready"})
    tasks.listener.set(lambda stage, share: channel.send({"state": "stage", "stage": stage, "share": share}))
    while (frame := channel.receive()) is not None:
        request, arrays = unpack_arrays(frame)
        del frame
        _limit_time(request["seconds"])
        reply = _answer(tasks.TASKS, request, arrays.pop("payload"))
        reply[0]["retire"] = _address_space() - base > _MOST_KEPT * memory_limit
        channel.send(*reply)
        del reply, arrays


def _answer(
    tasks: Mapping[str, Any], request: Mapping[str, Any], payload: NDArray[Any]
) -> tuple[dict[str, Any], dict[str, NDArray[Any]]]:
    """Run one task in a folder of its own; errors are values."""
    folder = Path("task")
    folder.mkdir()
    os.chdir(folder)
    try:
        header, arrays = tasks[request["task"]](request["header"], payload.tobytes())
        pack_arrays(header, {})
    except SpemError as error:
        return {"state": "error", "kind": type(error).__name__, "message": " ".join(str(error).split())}, {}
    except MemoryError:
        return {"state": "memory"}, {}
    except Exception as error:  # noqa: BLE001 the parent tells it apart from what readers mean to raise
        detail = "".join(traceback.format_exception(error))[-4000:]
        return {"state": "unexpected", "message": type(error).__name__, "detail": detail}, {}
    else:
        return {"state": "done", "header": header}, arrays
    finally:
        os.chdir("..")
        shutil.rmtree(folder, ignore_errors=True)


def _warm_up() -> None:
    """Load what tasks need, and the compiled kernels, by coding two tiny shapes."""
    from spem.codes.kinds import shape_features
    from spem.codes.settings import Settings
    from spem.index.row import pack, unpack
    from spem.shapes import synthetic

    for shape in (synthetic.disk(1.0, 0.2), synthetic.ball(1.0, 0.4)):
        shape_features(unpack(pack(shape)), Settings().resolved(shape.ndim))


def _address_space() -> int:
    """Return the bytes of this process's address space; 0 where the system does not say."""
    try:
        return int(Path("/proc/self/statm").read_text(encoding="ascii").split()[0]) * _PAGE
    except OSError:
        return 0


def _limit_time(seconds: float) -> None:
    """Let the kernel end the process when a task has used its time, whatever the parent does."""
    used = resource.getrusage(resource.RUSAGE_SELF)
    limit = int(used.ru_utime + used.ru_stime + seconds) + 2
    resource.setrlimit(resource.RLIMIT_CPU, (limit, resource.getrlimit(resource.RLIMIT_CPU)[1]))


def _confine(memory_limit: int) -> None:
    """Set the limits that hold from the start."""
    os.umask(0o077)
    # what readers refuse by a header is told in a clearer way than what runs into the limit
    os.environ["SPEM_MEMORY_LIMIT"] = str(memory_limit // 2)
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    resource.setrlimit(resource.RLIMIT_FSIZE, (memory_limit, memory_limit))
    resource.setrlimit(resource.RLIMIT_NOFILE, (256, 256))
    signal.signal(signal.SIGINT, signal.SIG_IGN)


def _follow_parent(lifeline: int, home: Path) -> None:
    """End the whole group when the other end of a pipe is closed, as it is when the parent dies."""

    def watch() -> None:
        # its number may be above what `select` takes
        poll = select.poll()
        poll.register(lifeline, select.POLLIN)
        poll.poll()
        shutil.rmtree(home, ignore_errors=True)
        # the last one takes the folder of all with it
        with contextlib.suppress(OSError):
            home.parent.rmdir()
        os.killpg(0, signal.SIGKILL)

    threading.Thread(target=watch, daemon=True).start()


def main() -> None:
    """Serve over the pipes that the first argument names."""
    options = json.loads(sys.argv[1])
    _confine(options["memory_limit"])
    _follow_parent(options["lifeline"], Path.cwd())
    serve(Channel(options["requests"], options["replies"]), options["memory_limit"])


if __name__ == "__main__":
    main()
