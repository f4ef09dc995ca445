"""Where sources are encoded: in processes of this machine, or by whatever else runs tasks."""

from __future__ import annotations

from collections.abc import Callable, Generator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol, TypeAlias, TypeVar

from spem.codes.workers import run_all

if TYPE_CHECKING:
    from spem.codes.sources import Source

T = TypeVar("T")
R = TypeVar("R")
#: Tasks with their results, or None and a reason; closed before the end, what is under way is given up.
Outcomes: TypeAlias = Generator[tuple[T, R | None, str], None, None]


@dataclass(frozen=True)
class Item:
    """A source to be encoded.

    Parameters
    ----------
    key
        SHA-256 of its content, in hex, when it was listed.
    source
        The file or shape.
    """

    key: str
    source: Source


class Executor(Protocol):
    """Runs a function over tasks."""

    def run(self, work: Callable[[T], R], tasks: Sequence[T]) -> Outcomes[T, R]:
        """Yield each task with its result, or None and one line why there is none, as they come.

        Parameters
        ----------
        work
            Function or object of a module; it can be pickled.
        tasks
            Its arguments.
        """
        ...


@dataclass(frozen=True)
class LocalExecutor:
    """Runs tasks in processes of this machine, one thread each.

    Parameters
    ----------
    n_jobs
        Number of processes; with 1 all runs in this one.

    Examples
    --------
    >>> list(LocalExecutor().run(int, ["7", "x"]))[0]
    ('7', 7, '')
    """

    n_jobs: int = 1

    def run(self, work: Callable[[T], R], tasks: Sequence[T]) -> Outcomes[T, R]:
        """Yield each task with its result; a process that dies costs no other task."""
        yield from run_all(work, tasks, self.n_jobs)
