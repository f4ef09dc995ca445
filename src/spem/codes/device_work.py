"""The features of a collection with a device: workers read shapes, this process sweeps them in batches."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import closing
from dataclasses import dataclass
from functools import partial
from typing import NamedTuple

from spem.codes.batches import BATCH_NODES
from spem.codes.drafts import draft_shapes, drop_drafts, entry_of, finish_drafts, load_drafts, save_drafts
from spem.codes.listing import Listing
from spem.codes.model import Model
from spem.codes.settings import Settings
from spem.codes.sources import Source
from spem.codes.work import Entry, Work, dimension
from spem.codes.workers import run_all
from spem.errors import ShapeError, SpemError
from spem.fields.solvers.engine import Backend
from spem.fields.solvers.team import usable_threads

# Called with the hash of a source that is done, and its dimension.
Done = Callable[[str, int], None]


class _Drafted(NamedTuple):
    """What a worker tells of a source: its dimension, and how many nodes wait for the device."""

    ndim: int
    n_nodes: int


@dataclass(frozen=True)
class _Task:
    """What workers do with a source: leave drafts in the work folder, or entries where no draft waits."""

    folder: Work
    settings: Settings
    model: Model | None
    threads: int | None

    def __call__(self, item: tuple[str, Source]) -> _Drafted:
        key, source = item
        try:
            drafts = load_drafts(self.folder, key)
        except SpemError:
            drafts = draft_shapes(source, self.settings, self.model, self.threads)
            if any(draft.shape for draft in drafts):
                save_drafts(self.folder, key, drafts)
        waiting = [draft.shape.n_nodes for draft in drafts if draft.shape is not None]
        if not waiting:
            entries = [entry_of(draft, self.model) for draft in drafts]
            if reason := _reason(entries):
                raise ShapeError(reason)
            self.folder.save(key, entries)
        return _Drafted(max((draft.ndim for draft in drafts), default=0), sum(waiting))


@dataclass(frozen=True)
class DeviceWork:
    """Brings a work folder up to date, with fields and maps from a device.

    Results and files are those of work without a device, but for rounding, so that either goes on from where
    the other was interrupted.

    Parameters
    ----------
    folder
        The work folder.
    settings
        Kinds of features, and what belongs to them.
    model
        What codes are made with; the folder gets features where there is none.
    device
        Where to sweep.
    threads
        Threads of each worker.
    """

    folder: Work
    settings: Settings
    model: Model | None
    device: Backend
    threads: int | None = None

    def run(
        self,
        todo: Sequence[tuple[str, Source]],
        n_jobs: int,
        listing: Listing,
        done: Done,
    ) -> None:
        """Do sources.

        Parameters
        ----------
        todo
            Hashes and sources.
        n_jobs
            Number of processes that read.
        listing
            What gets the failures.
        done
            Called for each source that is done with its hash and dimension, 0 where it failed.
        """
        task = _Task(self.folder, self.settings, self.model, self.threads)
        waiting: list[str] = []
        n_nodes = 0
        # What fails on the device ends the processes that read.
        with closing(run_all(task, todo, n_jobs)) as outcomes:
            for (key, source), drafted, reason in outcomes:
                if drafted is None:
                    listing.fail(source, reason, key)
                    done(key, 0)
                elif not drafted.n_nodes:
                    done(key, drafted.ndim)
                else:
                    waiting.append(key)
                    n_nodes += drafted.n_nodes
                if n_nodes >= BATCH_NODES:
                    self._finish(waiting, listing, done)
                    waiting, n_nodes = [], 0
        self._finish(waiting, listing, done)

    def _finish(self, keys: Sequence[str], listing: Listing, done: Done) -> None:
        """Turn drafts of sources into entries; files are read and written by threads, which hash them too."""
        with ThreadPoolExecutor(usable_threads()) as pool:
            loaded = list(pool.map(partial(load_drafts, self.folder), keys))
            drafts = [draft for each in loaded for draft in each]
            finished = iter(finish_drafts(drafts, self.settings, self.model, self.device))
            entries = [[next(finished) for _ in each] for each in loaded]
            for key, each, reason in zip(keys, entries, pool.map(self._save, keys, entries), strict=True):
                if reason:
                    listing.fail(listing.first[key], reason, key)
                done(key, 0 if reason else dimension(each))

    def _save(self, key: str, entries: list[Entry]) -> str:
        """Write the entries of a source in place of its drafts, and return why there are none, if so."""
        reason = _reason(entries)
        if not reason:
            self.folder.save(key, entries)
        drop_drafts(self.folder, key)
        return reason


def _reason(entries: Sequence[Entry]) -> str:
    """Return why the only shape of a source gave nothing, if so; one of several labels stays an entry."""
    return next((entry.reason for entry in entries if entry.reason and not entry.suffix), "")
