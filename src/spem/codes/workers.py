"""Work shared out to processes: results as they come, failures as values, a clean end on Ctrl-C."""

from __future__ import annotations

import os
import signal
import threading
import time
from collections.abc import Callable, Generator, Iterable, Iterator
from contextlib import suppress
from pathlib import Path
from typing import TypeVar

from joblib import Parallel, delayed, parallel_config
from joblib.externals.loky.process_executor import TerminatedWorkerError
from threadpoolctl import threadpool_limits

from spem.codes.arguments import whole_number
from spem.errors import SpemError
from spem.fields.solvers.team import usable_threads

T = TypeVar("T")
R = TypeVar("R")
# A process takes seconds to start, as long as it takes to code this many shapes.
_SHAPES_PER_PROCESS = 100
# Tasks for each process that are under way or handed out, and tried alone when one of them kills its process.
_SUSPECTS = 3
# Seconds between two looks of a worker at its parent.
_PARENT_CHECK = 0.5


def one_line(error: BaseException) -> str:
    """Return the message of an error on one line; of an unexpected one with its type.

    Examples
    --------
    >>> one_line(KeyError("a"))
    "unexpected KeyError: 'a'; please report it"
    """
    text = " ".join(str(error).split())
    return (
        text
        if isinstance(error, SpemError)
        else f"unexpected {type(error).__name__}: {text}; please report it"
    )


def count_processes(n_shapes: int) -> int:
    """Return how many processes are worth their start for so many shapes.

    Examples
    --------
    >>> count_processes(3)
    1
    """
    return max(1, min(usable_threads(), n_shapes // _SHAPES_PER_PROCESS))


def run_all(
    work: Callable[[T], R], tasks: Iterable[T], n_jobs: int = 1
) -> Generator[tuple[T, R | None, str], None, None]:
    """Run a function over tasks and yield outcomes as they come.

    Each process has one thread. In this process numerical libraries have one, so that results do not
    depend on how many there are; a solver's own threads, on which they do not depend, are left alone.

    Parameters
    ----------
    work
        Function of a module; its results must be small, since they pass between processes.
    tasks
        Its arguments.
    n_jobs
        Number of processes; with 1, and for a single task, all runs in this one.

    Yields
    ------
    task, result, reason
        The result, or None and on one line why there is none.

    Raises
    ------
    ParameterError
        When `n_jobs` is below 1.

    Examples
    --------
    >>> [(result, reason) for _, result, reason in run_all(int, ["7"])]
    [(7, '')]
    """
    n_jobs = whole_number("n_jobs", n_jobs)
    left = dict(enumerate(tasks))
    if n_jobs == 1 or len(left) <= 1:
        with threadpool_limits(1):
            for task in left.values():
                yield task, *_attempt(work, task)
        return
    while left:
        try:
            for index, result, reason in _spread(work, left, n_jobs):
                yield left.pop(index), result, reason
        except TerminatedWorkerError:
            # One task took its process down and the pool with it, one of those that were handed out first.
            for index in list(left)[: _SUSPECTS * n_jobs]:
                yield left[index], *_alone(work, left, index)
                del left[index]


def _alone(work: Callable[[T], R], tasks: dict[int, T], index: int) -> tuple[R | None, str]:
    """Run one task with nothing beside it."""
    try:
        [(_, result, reason)] = list(_spread(work, {index: tasks[index]}, 2))
    except TerminatedWorkerError:
        return None, "its process died, perhaps for want of memory"
    return result, reason


def _spread(work: Callable[[T], R], tasks: dict[int, T], n_jobs: int) -> Iterator[tuple[int, R | None, str]]:
    """Run tasks in processes of one thread each; results come in the order in which they are done."""
    # Each follows its parent from its start: one that is still starting when the parent dies ends too.
    follow = {"initializer": _follow_parent, "initargs": (os.getpid(),)}
    with parallel_config(backend="loky", inner_max_num_threads=1, **follow):
        pool = Parallel(n_jobs=n_jobs, return_as="generator_unordered", max_nbytes=None)
        place = ""
        with suppress(FileNotFoundError):  # a folder may be removed while one is in it
            place = str(Path.cwd())
        yield from pool(delayed(_in_process)(work, index, task, place) for index, task in list(tasks.items()))


def _in_process(work: Callable[[T], R], index: int, task: T, place: str) -> tuple[int, R | None, str]:
    """Run one task in a worker. Ctrl-C reaches all processes; the parent ends the workers."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    # workers outlive a call, and relative paths start from where the caller is now
    with suppress(OSError):
        os.chdir(place)
    return index, *_attempt(work, task)


def _follow_parent(parent: int) -> None:
    """Watch the process that started this one, and end when it is gone: nobody waits for the results."""

    def watch() -> None:
        while os.getppid() == parent:
            time.sleep(_PARENT_CHECK)
        os._exit(1)

    threading.Thread(target=watch, daemon=True).start()


def _attempt(work: Callable[[T], R], task: T) -> tuple[R | None, str]:
    """Run one task; an error of any kind is a value, so that one bad file does not end the rest."""
    try:
        return work(task), ""
    except Exception as error:  # noqa: BLE001
        return None, one_line(error)
