"""Where the time of a sweep goes: engines whose methods are timed, on the processor and on a device alike."""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import Any

import numpy as np

from spem.fields.operator import System
from spem.fields.solvers.engine import Backend

# Methods of an engine; their answers are on the host, so a call is over when it returns.
METHODS = {
    "measure": "measure",
    "search": "search, improve",
    "improve": "search, improve",
    "overlaps": "basis",
    "append": "basis",
    "columns": "columns",
}
STAGES = ("assemble", "open", "measure", "search, improve", "basis", "columns", "project", "host algebra")


class Clock:
    """Seconds by stage of one run, and the number of steps of conjugate gradients."""

    def __init__(self) -> None:
        self.seconds: Counter[str] = Counter()
        self.steps = 0
        self.started = time.perf_counter()

    @contextmanager
    def stage(self, name: str) -> Iterator[None]:
        """Add the time of a block to a stage."""
        start = time.perf_counter()
        try:
            yield
        finally:
            self.seconds[name] += time.perf_counter() - start

    def stop(self) -> float:
        """Return the seconds since the start; what no stage has is algebra of small matrices."""
        total = time.perf_counter() - self.started
        self.seconds["host algebra"] = total - sum(self.seconds.values())
        return total


class Watch:
    """A backend whose engines add the time of their methods to a clock."""

    def __init__(self, backend: Backend, clock: Clock) -> None:
        self.backend, self.clock = backend, clock

    def open(self, systems: Sequence[System], dtype: type[np.floating[Any]]) -> Any:
        """Make an engine: what goes to the device, and the levels of the multigrid."""
        with self.clock.stage("open"):
            return Watched(self.backend.open(systems, dtype), self.clock)


class Watched:
    """An engine, timed."""

    def __init__(self, engine: Any, clock: Clock) -> None:
        self.engine, self.clock = engine, clock

    def __getattr__(self, name: str) -> Any:
        value = getattr(self.engine, name)
        return self._timed(name, value) if name in METHODS else value

    def _timed(self, name: str, method: Callable[..., Any]) -> Callable[..., Any]:
        """Add the time of each call to a stage."""

        def call(*arguments: Any) -> Any:
            self.clock.steps += name == "search"
            with self.clock.stage(METHODS[name]):
                return method(*arguments)

        return call
