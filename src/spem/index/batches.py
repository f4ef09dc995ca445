"""Rows written in batches as they come: often enough to lose little, seldom enough to cost little."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from types import TracebackType
from typing import Self

from spem.index.row import Row

# Every write makes a version of the table; shapes take about a second each.
ROWS, SECONDS = 50, 2.0


class Batches:
    """Collects rows and writes them together; what is not written when the work is cut short is, at the end.

    Parameters
    ----------
    write
        Writes rows in one step.
    written
        Called after each write with the number of sources that are done by it.

    Examples
    --------
    >>> with Batches(lambda rows: None, print) as batches:
    ...     batches.add([])
    ...     batches.add([])
    2
    """

    def __init__(self, write: Callable[[Sequence[Row]], object], written: Callable[[int], object]) -> None:
        self._write = write
        self._written = written
        self._rows: list[Row] = []
        self._sources = 0
        self._last = time.monotonic()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.flush()

    def add(self, rows: Sequence[Row]) -> None:
        """Take the rows of a source."""
        self._rows.extend(rows)
        self._sources += 1
        if len(self._rows) >= ROWS or time.monotonic() - self._last >= SECONDS:
            self.flush()

    def flush(self) -> None:
        """Write what has come since the last time."""
        rows, sources = self._rows, self._sources
        self._rows, self._sources, self._last = [], 0, time.monotonic()
        if rows:
            self._write(rows)
            self._last = time.monotonic()
        if sources:
            self._written(sources)
