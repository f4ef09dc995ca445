"""Tasks on untrusted files in worker processes with limits, which are killed and replaced."""

from __future__ import annotations

import tempfile
import threading
import time
from collections import Counter
from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path
from types import TracebackType
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from spem import errors
from spem.errors import SandboxError, SpemError
from spem.server.arrays import pack_arrays, unpack_arrays
from spem.server.processes import Process

Progress = Callable[[str, float], None]

# Seconds between two looks at whether a task was cancelled.
_LOOK = 0.1
# Seconds within which a worker has imported and warmed up, on a machine that is busy with others.
_START = 300.0
# Seconds before a worker that did not start is tried again, doubled each time.
_RETRY, _LONGEST_RETRY = 1.0, 30.0


class Sandbox:
    """Worker processes for tasks on untrusted files.

    Each runs one task at a time with one thread, in a folder of its own that is emptied after it, without the
    environment of the server. One that takes too long or too much memory, or dies, is killed with all its
    processes and replaced while others go on.

    Parameters
    ----------
    n_workers
        Number of processes.
    memory_limit
        Bytes that a task may take beyond what a worker holds when it starts.
    seconds
        Time of a task by the clock, and a little more of the processor's.

    Raises
    ------
    ParameterError
        When a limit is not positive.
    """

    def __init__(self, n_workers: int = 2, memory_limit: int = 2 << 30, seconds: float = 60.0) -> None:
        for name, value in (("n_workers", n_workers), ("memory_limit", memory_limit), ("seconds", seconds)):
            if not value > 0:
                msg = f"{name}={value} must be positive"
                raise errors.ParameterError(msg)
        self.n_workers, self.memory_limit, self.seconds = n_workers, memory_limit, seconds
        self._folder = tempfile.TemporaryDirectory(prefix="spem-sandbox-", ignore_cleanup_errors=True)
        # last in, first out: the worker whose memory is warm
        self._free: list[Process] = []
        self._all: set[Process] = set()
        self._changed = threading.Condition()
        self._closed = threading.Event()
        self._trouble = ""
        self._counts: Counter[str] = Counter()
        for _ in range(n_workers):
            self._start()

    def run(
        self,
        task: str,
        header: Mapping[str, Any],
        payload: bytes = b"",
        *,
        seconds: float | None = None,
        cancelled: threading.Event | None = None,
        progress: Progress | None = None,
    ) -> tuple[dict[str, Any], dict[str, NDArray[Any]]]:
        """Run a task of `spem.server.tasks.TASKS` in a worker; the call waits for a free one first.

        Parameters
        ----------
        task
            Its name.
        header, payload
            Its arguments: what `json` can write, and bytes.
        seconds
            Time limit of this task, of the sandbox where None; waiting for a worker does not count.
        cancelled
            Set it to stop the task.
        progress
            Called with a stage and the share that is done.

        Returns
        -------
        tuple
            What the task returned: a header and arrays.

        Raises
        ------
        SpemError
            The one that the task raised.
        SandboxError
            When the task was stopped, or no worker can be started.
        """
        limit = self.seconds if seconds is None else seconds
        request = {"task": task, "header": dict(header), "seconds": limit}
        body = pack_arrays(request, {"payload": np.frombuffer(payload, np.uint8)})
        stopped = cancelled or threading.Event()
        worker = self._take(stopped)
        try:
            reply, arrays = self._exchange(worker, body, limit, stopped, progress)
        except SandboxError as error:
            self._discard(worker, error.reason)
            raise
        except BaseException:
            self._discard(worker, "unexpected")
            raise
        if reply.get("retire"):
            self._discard(worker, "retired")
        else:
            self._give(worker)
        return self._outcome(task, reply, arrays)

    def stats(self) -> dict[str, int]:
        """Return how many workers there are, are free, and were started and stopped, by reason."""
        self._reap()
        return {
            "workers": self.n_workers,
            "free": len(self._free),
            **{
                name: self._counts[name]
                for name in ("started", "done", "refused", "time", "memory", "died", "cancelled", "retired")
            },
        }

    def ready(self) -> bool:
        """Tell whether at least one worker has started and none is known to be unable to."""
        return not self._closed.is_set() and not self._trouble and bool(self._counts["started"])

    def close(self) -> None:
        """Kill all workers; tasks under way raise a `SandboxError`."""
        self._closed.set()
        with self._changed:
            idle, busy = self._free[:], self._all - set(self._free)
            self._all.clear()
            self._free.clear()
            self._changed.notify_all()
        for worker in busy:
            worker.kill()
        for worker in idle:
            worker.drop()
        self._folder.cleanup()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def _take(self, stopped: threading.Event) -> Process:
        """Wait for a free worker."""
        while not stopped.is_set() and not self._closed.is_set():
            with self._changed:
                if not self._free:
                    self._changed.wait(_LOOK)
                worker = self._free.pop() if self._free else None
            if worker and worker.alive():
                return worker
            if worker:
                self._discard(worker, "died")
            if self._trouble and not self._all:
                raise SandboxError(self._trouble)
        raise self._stopped(stopped)

    def _give(self, worker: Process) -> None:
        """Put a worker among the free ones."""
        with self._changed:
            if not self._closed.is_set():
                self._free.append(worker)
                self._changed.notify()
                return
        worker.drop()

    def _reap(self) -> None:
        """Replace free workers that died."""
        with self._changed:
            dead = [worker for worker in self._free if not worker.alive()]
            self._free[:] = [worker for worker in self._free if worker not in dead]
        for worker in dead:
            self._discard(worker, "died")

    def _exchange(
        self,
        worker: Process,
        body: bytes,
        limit: float,
        stopped: threading.Event,
        progress: Progress | None,
    ) -> tuple[dict[str, Any], dict[str, NDArray[Any]]]:
        """Send a request and wait for its reply, within the time limit."""
        end = time.monotonic() + limit

        def go_on() -> None:
            if stopped.is_set() or self._closed.is_set():
                raise self._stopped(stopped)
            if time.monotonic() > end:
                msg = f"stopped after {limit:g} s, the time limit of a task; send a smaller or coarser shape"
                raise SandboxError(msg, "time")

        worker.send(body, go_on)
        while True:
            frame = worker.receive(self.memory_limit, go_on)
            try:
                reply, arrays = unpack_arrays(frame)
                if reply.get("state") != "stage":
                    return reply, arrays
                stage, share = str(reply["stage"]), float(reply["share"])
            except (errors.ReadError, LookupError, TypeError, ValueError) as error:
                msg = "the process of this task sent what is no reply; try again"
                raise SandboxError(msg, "died") from error
            if progress:
                progress(stage, share)

    def _outcome(
        self, task: str, reply: dict[str, Any], arrays: dict[str, NDArray[Any]]
    ) -> tuple[dict[str, Any], dict[str, NDArray[Any]]]:
        """Return what a task returned, or raise what it raised."""
        state = reply.get("state")
        header = reply.get("header")
        if state == "done" and isinstance(header, dict):
            self._count("done")
            return header, arrays
        self._count("refused")
        if state == "error":
            kind = getattr(errors, str(reply.get("kind")), SpemError)
            known = isinstance(kind, type) and issubclass(kind, SpemError)
            raise (kind if known else SpemError)(str(reply.get("message")))
        if state == "memory":
            self._count("memory")
            size = self.memory_limit >> 20
            msg = f"needs more than {size} MiB, the memory limit of a task; send a smaller or coarser shape"
            raise SandboxError(msg, "memory")
        msg = f"{task}: this file cannot be processed (unexpected {reply.get('message')}); please report it"
        raise SandboxError(msg, "unexpected", str(reply.get("detail")))

    def _stopped(self, stopped: threading.Event) -> SandboxError:
        """Say why a task was given up that did nothing wrong."""
        if stopped.is_set():
            return SandboxError("cancelled", "cancelled")
        return SandboxError("the server is going down; try again later", "closed")

    def _discard(self, worker: Process, why: str) -> None:
        """Kill a worker and start another in its place."""
        self._count(why)
        with self._changed:
            self._all.discard(worker)
        worker.drop()
        self._start()

    def _count(self, what: str) -> None:
        """Count what came of a task or a worker."""
        with self._changed:
            self._counts[what] += 1

    def _start(self) -> None:
        """Start a worker; it is free when it is warm."""
        if not self._closed.is_set():
            threading.Thread(target=self._bring_up, name="spem-sandbox-start", daemon=True).start()

    def _bring_up(self) -> None:
        """Start a worker and wait until it is warm; try again where it does not come up."""
        pause = _RETRY
        while not self._closed.is_set():
            worker = None
            try:
                worker = self._new()
                if worker is None:
                    return
                worker.receive(self.memory_limit, partial(self._patience, time.monotonic() + _START))
            except (SpemError, OSError) as error:
                if worker:
                    with self._changed:
                        self._all.discard(worker)
                    worker.drop()
                self._trouble = f"worker processes do not start: {error}"
                self._closed.wait(pause)
                pause = min(2 * pause, _LONGEST_RETRY)
                continue
            self._trouble = ""
            self._count("started")
            self._give(worker)
            return

    def _new(self) -> Process | None:
        """Start a process, unless the sandbox is closed."""
        with self._changed:
            if self._closed.is_set():
                return None
            worker = Process.start(Path(self._folder.name), self.memory_limit)
            self._all.add(worker)
            return worker

    def _patience(self, end: float) -> None:
        """Give up on a worker that does not start."""
        if self._closed.is_set() or time.monotonic() > end:
            msg = f"not ready within {_START:g} s"
            raise SandboxError(msg, "time")
