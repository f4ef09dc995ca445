"""Time and traffic of an engine, by stage of its work."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from spem.fields.solvers.cuda.runtime import Runtime


class Meter:
    """Takes the time between events on a device, and counts the bytes that have to move.

    Parameters
    ----------
    runtime
        The device.
    timed
        Whether to take the time; events cost little, but not nothing.

    Attributes
    ----------
    bytes
        Of each stage, the fewest bytes that its work moves: each input read once, each result written once.
    """

    def __init__(self, runtime: Runtime, *, timed: bool) -> None:
        self.runtime, self.timed = runtime, timed
        self.bytes: defaultdict[str, int] = defaultdict(int)
        self._seconds: defaultdict[str, float] = defaultdict(float)
        self._spans: list[tuple[str, str, Any, Any]] = []
        self._stages = [""]

    @contextmanager
    def stage(self, name: str, n_bytes: float = 0) -> Iterator[None]:
        """Count what is done within as part of a stage, and not of the stage around it."""
        self.count(name, n_bytes)
        if not self.timed:
            yield
            return
        start = self.runtime.mark()
        self._stages.append(name)
        try:
            yield
        finally:
            self._stages.pop()
            self._spans.append((name, self._stages[-1], start, self.runtime.mark()))

    def count(self, name: str, n_bytes: float) -> None:
        """Count bytes of a stage."""
        self.bytes[name] += int(n_bytes)

    @property
    def seconds(self) -> dict[str, float]:
        """Seconds of each stage so far."""
        self.runtime.synchronize()
        for name, outer, start, end in self._spans:
            spent = self.runtime.elapsed(start, end)
            self._seconds[name] += spent
            self._seconds[outer] -= spent
        self._spans.clear()
        return {name: spent for name, spent in self._seconds.items() if name}
