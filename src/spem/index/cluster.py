"""Sources encoded on a Dask cluster: what local processes do, by workers that see the same files."""

from __future__ import annotations

import logging
import math
import platform
import re
import time
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import CancelledError
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field, replace
from functools import cache
from importlib.metadata import version
from pathlib import Path
from queue import Empty, Queue
from typing import Any, TypeVar

from threadpoolctl import threadpool_limits

from spem.codes.workers import one_line
from spem.errors import ClusterError
from spem.index.executors import Item, Outcomes
from spem.index.extra import require

T = TypeVar("T")
R = TypeVar("R")

# Seconds within which a scheduler must answer, and for which one may have no worker.
CONNECT, IDLE = 5.0, 60.0
# Tasks handed out for each thread: one runs, others are there while rows are written.
_AHEAD = 4
# Seconds between two looks at the cluster while nothing comes.
_LOOK = 1.0


@dataclass(frozen=True)
class ClusterExecutor:
    """Runs tasks on the workers of a Dask cluster, one thread each.

    A worker that dies costs no task: the scheduler gives what it had to others, and a task that took several
    down is tried again alone. Results do not depend on where they are made.

    Parameters
    ----------
    address
        Of the scheduler: ``"tcp://host:8786"``, or ``"tls://host:8786"`` with the certificates that the
        configuration of Dask names.
    retries
        How often a task whose workers died is tried again, alone.
    idle
        Seconds without any worker after which the cluster is given up.
    """

    address: str
    retries: int = 2
    idle: float = IDLE

    def run(self, work: Callable[[T], R], tasks: Sequence[T]) -> Outcomes[T, R]:
        """Yield each task with its result, or None and one line why there is none, as they come.

        Raises
        ------
        ClusterError
            When the cluster cannot be reached, has another version of spem or Python, cannot see the files,
            or is lost.
        MissingExtraError
            When Dask's scheduler is not installed.
        """
        if not tasks:
            return
        distributed = require("distributed", "cluster")
        with _connected(distributed, self.address) as client:
            _check_workers(client, self.address, tasks)
            stamp = _stamp()
            shared = client.submit(_itself, work, pure=False)
            run = _Run(distributed, client, self.address, self.idle, (stamp, shared))
            suspects = []
            for task, outcome in run.outcomes(tasks, alone=False):
                if outcome is None:
                    suspects.append(task)
                else:
                    yield task, *outcome
            for task in suspects:
                yield task, *self._alone(run, task)

    def _alone(self, run: _Run, task: Any) -> tuple[Any, str]:
        """Run a task with nothing beside it, as often as it may be tried."""
        for _ in range(self.retries):
            [(_, outcome)] = run.outcomes([task], alone=True)
            if outcome is not None:
                return outcome
        return None, "its worker died each time, perhaps for want of memory"


@dataclass(frozen=True)
class _Run:
    """Tasks on their way to a cluster and back."""

    distributed: Any
    client: Any
    address: str
    idle: float
    shared: tuple[Any, ...]
    done: Queue[Any] = field(default_factory=Queue)

    def outcomes(self, tasks: Sequence[Any], *, alone: bool) -> Iterator[tuple[Any, tuple[Any, str] | None]]:
        """Yield each task with its outcome, None where its workers died; few are on their way at a time."""
        left = iter(tasks)
        pending: dict[Any, Any] = {}
        more, since, looked, n_threads = True, time.monotonic(), -math.inf, 0
        try:
            while more or pending:
                now = time.monotonic()
                if now - looked >= _LOOK:
                    n_threads, looked = self._n_threads(), now
                since = now if n_threads else since
                while more and len(pending) < (1 if alone else max(2, _AHEAD * n_threads)):
                    task = next(left, _END)
                    more = task is not _END
                    if more:
                        pending[self._submit(task)] = task
                for future in self._finished():
                    yield pending.pop(future), self._outcome(future)
                if now - since > self.idle:
                    msg = f"{self.address}: no worker for {self.idle:g} s; start some, give the command again"
                    raise ClusterError(msg)
        finally:
            # the scheduler may be gone, of which more is told elsewhere
            with suppress(OSError, TimeoutError, RuntimeError, ValueError):
                self.client.cancel(list(pending), force=True)

    def _submit(self, task: Any) -> Any:
        """Hand a task out; it comes to the queue when it is done."""
        future = self.client.submit(_on_worker, *self.shared, _absolute(task), pure=False)
        future.add_done_callback(self.done.put)
        return future

    def _n_threads(self) -> int:
        """Return how many tasks the workers run at once."""
        try:
            return sum(self.client.nthreads().values())
        except (TimeoutError, OSError, RuntimeError, ValueError) as error:
            raise self._lost() from error

    def _lost(self) -> ClusterError:
        """Say that the cluster is gone."""
        msg = f"{self.address}: the scheduler is gone; what was written stays: give the command again"
        return ClusterError(msg)

    def _finished(self) -> list[Any]:
        """Wait a little, and return what is done by then."""
        found: list[Any] = []
        try:
            found.append(self.done.get(timeout=_LOOK))
            while True:
                found.append(self.done.get_nowait())
        except Empty:
            return found

    def _outcome(self, future: Any) -> tuple[Any, str] | None:
        """Return what a task came to."""
        try:
            result: tuple[Any, str] = future.result()
        except self.distributed.KilledWorker:
            return None
        except CancelledError as error:
            raise self._lost() from error
        except Exception as error:  # noqa: BLE001
            return None, one_line(error)
        return result


_END = object()


@contextmanager
def _connected(distributed: Any, address: str) -> Iterator[Any]:
    """Connect to a scheduler."""
    if not re.fullmatch(r"(tcp|tls)://[^/:]+:\d+|(tcp|tls)://\[[^/\]]+\]:\d+", address):
        msg = f"cluster {address}: expected the address of a Dask scheduler, such as tcp://host:8786"
        raise ClusterError(msg)
    with _silenced(logging.getLogger("distributed")):
        try:
            client = distributed.Client(
                address, timeout=CONNECT, set_as_default=False, direct_to_workers=True
            )
        except (TimeoutError, OSError, ValueError, TypeError) as error:
            msg = f"{address}: no Dask scheduler answers there; start one with: dask scheduler"
            raise ClusterError(msg) from error
        try:
            yield client
        finally:
            client.close(timeout=CONNECT)


@contextmanager
def _silenced(log: logging.Logger) -> Iterator[None]:
    """Keep a log quiet; what Dask says in many lines of lost connections is told in one instead."""
    level = log.level
    log.setLevel(logging.CRITICAL + 1)
    try:
        yield
    finally:
        log.setLevel(level)


def _check_workers(client: Any, address: str, tasks: Sequence[Any]) -> None:
    """Refuse workers that would make other codes, or see other files."""
    task = _absolute(tasks[0])
    path = task.source if isinstance(task, Item) and isinstance(task.source, Path) else None
    try:
        found = client.run(_about, path)
    except Exception as error:
        msg = f"{address}: the workers lack spem {version('spem')} ({one_line(error)}); install it there"
        raise ClusterError(msg) from error
    if not found:
        msg = f"{address}: the scheduler has no worker; start some with: dask worker {address} --nthreads 1"
        raise ClusterError(msg)
    here = _stamp()
    for worker, (stamp, sees) in sorted(found.items()):
        if stamp != here:
            msg = f"{worker}: the worker has {stamp}, here is {here}; install the same on both"
            raise ClusterError(msg)
        if not sees:
            msg = f"{worker}: cannot read {path}; workers need the same files, on shared storage"
            raise ClusterError(msg)


def _absolute(task: Any) -> Any:
    """Name files by their whole path, since workers have working directories of their own."""
    if isinstance(task, Item) and isinstance(task.source, Path):
        return replace(task, source=task.source.absolute())
    return task


def _about(path: Path | None) -> tuple[str, bool]:
    """Return, on a worker, the versions it has, and whether it sees a file."""
    return _stamp(), path is None or path.is_file()


def _stamp() -> str:
    """Return the versions that have to agree."""
    return f"spem {version('spem')} on Python {'.'.join(platform.python_version_tuple()[:2])}"


def _itself(work: T) -> T:
    """Return the argument: a task that others depend on is made again when the worker that had it dies."""
    return work


def _on_worker(stamp: str, work: Callable[[T], R], task: T) -> tuple[R | None, str]:
    """Run one task; an error of any kind is a value, so that one bad file does not end the rest."""
    if stamp != _stamp():
        return None, f"a worker that joined later has {_stamp()}, not {stamp}; add the file again"
    _one_thread()
    try:
        return work(task), ""
    except Exception as error:  # noqa: BLE001
        return None, one_line(error)


@cache
def _one_thread() -> None:
    """Once in a worker: give numerical libraries one thread, for all tasks to come."""
    threadpool_limits(1)
