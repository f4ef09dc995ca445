"""Progress on stderr, where there is a terminal to show it."""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING, Self

from spem.cli.output import complain, counted

if TYPE_CHECKING:
    from rich.progress import Progress, TaskID


class Bar:
    """A progress bar for each stage; nothing but a word on resumption where stderr is no terminal.

    Examples
    --------
    >>> with Bar() as bar:
    ...     bar.advance("fields", 0, 5)
    """

    def __init__(self) -> None:
        self._stages: dict[str, TaskID] = {}
        self._seen: set[str] = set()
        self._progress: Progress | None = None
        self._n_failed = 0

    def __enter__(self) -> Self:
        if sys.stderr.isatty():
            from rich.console import Console
            from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

            columns = (
                TextColumn("{task.description:<7}"),
                BarColumn(),
                MofNCompleteColumn(),
                TimeRemainingColumn(),
            )
            self._progress = Progress(*columns, console=Console(stderr=True), transient=True)
            self._progress.start()
        return self

    def __exit__(self, *_: object) -> None:
        if self._progress is not None:
            self._progress.stop()

    def advance(self, stage: str, done: int, total: int) -> None:
        """Show that so many of a stage are done."""
        if stage not in self._seen and done > 0 and stage == "fields":
            complain(f"{done} of {counted(total, 'shape')} done already; going on")
        self._seen.add(stage)
        if self._progress is None:
            return
        if stage not in self._stages:
            failed = f", {self._n_failed} failed" if self._n_failed else ""
            self._stages[stage] = self._progress.add_task(stage + failed, total=total)
        self._progress.update(self._stages[stage], completed=done)

    def fail(self, failure: object) -> None:
        """Tell of a failure on a line of its own, and count it beside the bar."""
        complain(str(failure))
        sys.stderr.flush()
        self._n_failed += 1
        if self._progress is not None:
            for stage, task in self._stages.items():
                self._progress.update(task, description=f"{stage}, {self._n_failed} failed")
