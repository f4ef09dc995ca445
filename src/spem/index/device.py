"""Sources encoded with a device: processes read shapes, this one sweeps them in batches."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import closing
from dataclasses import dataclass, replace
from typing import Any, TypeVar

from spem.codes.bands import Bands
from spem.codes.batches import BATCH_NODES, ON_DEVICE
from spem.codes.drafts import Draft as CodeDraft
from spem.codes.drafts import finish_drafts
from spem.codes.kinds import kind_features
from spem.codes.model import Model
from spem.codes.settings import Settings
from spem.codes.work import Entry
from spem.codes.workers import run_all
from spem.fields.solvers.engine import Backend
from spem.index.encoding import Describe, Described, Draft, bare_rows, label_reason
from spem.index.executors import Item, Outcomes
from spem.index.row import Row, row_id
from spem.index.training import Make
from spem.shapes.shape import Shape

T = TypeVar("T")
R = TypeVar("R")
# The row of a shape and what the device is to complete, or why a label gives nothing.
Read = list[tuple[Row | None, CodeDraft | str]]
# The row of a shape and its features or code, or why there are none.
Finished = tuple[Row | None, Bands | str]


@dataclass(frozen=True)
class DeviceExecutor:
    """Makes SPEM maps and their codes on a device, and all else in processes of this machine.

    Parameters
    ----------
    device
        Where shapes are swept.
    n_jobs
        Number of processes that read.
    """

    device: Backend
    n_jobs: int = 1

    def run(self, work: Callable[[T], R], tasks: Sequence[T]) -> Outcomes[T, R]:
        """Yield each task with its result, sources that are encoded in batches of shapes."""
        if isinstance(work, (Make, Describe)):
            yield from self._encode(work, tasks)
        else:
            yield from run_all(work, tasks, self.n_jobs)

    def _encode(self, work: Make | Describe, items: Sequence[Any]) -> Outcomes[Any, Any]:
        """Read sources, and complete them as soon as they make a batch."""
        model = work.model if isinstance(work, Describe) else None
        settings = work.settings if isinstance(work, Make) else work.model.settings
        read = _Read(settings, model, work.keep_shape)
        waiting: list[tuple[Item, Read]] = []
        n_nodes = 0
        with closing(run_all(read, items, self.n_jobs)) as outcomes:
            for item, found, reason in outcomes:
                if found is None:
                    yield item, None, reason
                    continue
                waiting.append((item, found))
                n_nodes += _nodes(found)
                if n_nodes >= BATCH_NODES:
                    yield from self._complete(waiting, settings, model)
                    waiting, n_nodes = [], 0
        yield from self._complete(waiting, settings, model)

    def _complete(
        self, waiting: Sequence[tuple[Item, Read]], settings: Settings, model: Model | None
    ) -> Iterator[tuple[Item, Any, str]]:
        """Make what is lacking of all shapes at once, and put each source together."""
        drafts = [draft for _, found in waiting for _, draft in found if isinstance(draft, CodeDraft)]
        entries = iter(finish_drafts(drafts, settings, model, self.device))
        for item, found in waiting:
            shapes = [_finished(row, draft, entries) for row, draft in found]
            broken = [reason for row, reason in shapes if isinstance(reason, str) and not _suffix(row)]
            if broken:
                yield item, None, broken[0]
            elif model is None:
                yield item, [_draft(*each) for each in shapes], ""
            else:
                yield item, _described(shapes), ""


@dataclass(frozen=True, eq=False)
class _Read:
    """What workers do with a source: all but what a device makes."""

    settings: Settings
    model: Model | None
    keep_shape: bool

    def __call__(self, item: Item) -> Read:
        return list(bare_rows(item, self.settings, self._draft, model=self.model, keep_shape=self.keep_shape))

    def _draft(self, shape: Shape) -> CodeDraft:
        kinds = kind_features(shape, self.settings, 1, later=(ON_DEVICE,))
        waits = shape if None in kinds else None
        return CodeDraft("", "", kinds, shape.ndim, shape.volume, waits)


def _nodes(read: Read) -> int:
    """Count the nodes of a source that wait for the device."""
    drafts = (draft for _, draft in read if isinstance(draft, CodeDraft))
    return sum(draft.shape.n_nodes for draft in drafts if draft.shape is not None)


def _suffix(row: Row | None) -> str:
    """Return what tells the shape of a row from others of its source; of a label without one, anything."""
    return "-" if row is None else row.id.removeprefix(row_id(row.hash))


def _finished(row: Row | None, draft: CodeDraft | str, entries: Iterator[Entry]) -> Finished:
    """Take the entry of a shape, if it has one."""
    if isinstance(draft, str):
        return row, draft
    entry, suffix = next(entries), _suffix(row)
    if not entry.reason:
        return row, entry.arrays
    return row, label_reason(suffix, entry.reason) if suffix else entry.reason


def _draft(row: Row | None, made: Bands | str) -> Draft:
    """Make the draft of a shape, or of a label that gives nothing."""
    return Draft(None, reason=made) if isinstance(made, str) else Draft(row, made)


def _described(shapes: Sequence[Finished]) -> Described:
    """Make the rows of a source."""
    drafts = [_draft(*each) for each in shapes]
    rows = tuple(replace(each.row, code=each.features[0]) for each in drafts if each.row is not None)
    return Described(rows, tuple(each.reason for each in drafts if each.row is None))
