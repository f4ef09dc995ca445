"""The model of a new index, learnt from a sample of its sources; what the sample came to is kept."""

from __future__ import annotations

import hashlib
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import closing, suppress
from dataclasses import dataclass
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from threadpoolctl import threadpool_limits

from spem.codes.bands import Bands
from spem.codes.container import read_container, write_container
from spem.codes.listing import Listing
from spem.codes.model import Model
from spem.codes.settings import Settings
from spem.codes.work import Work
from spem.errors import ReadError, SpemError
from spem.index.encoding import Described, Draft, draft, finish
from spem.index.executors import Executor, Item
from spem.index.row import Row

Progress = Callable[[str, int, int], None]

_KIND = "drafts"
# `spem.codes.work.clear_work` takes what ends so too.
_SUFFIX = ".drafts.work"
_TEXT = ("id", "hash", "name", "path", "ndim", "n_nodes", "volume", "report")
_BYTES = ("thumbnail", "shape")


@dataclass(frozen=True)
class Drafts:
    """A folder with the drafts of each source of the sample, named by the hash of the source.

    Parameters
    ----------
    folder
        Where the files lie.
    """

    folder: Path

    @classmethod
    def open(cls, root: Path, settings: Settings) -> Drafts:
        """Make the folder under `root` that belongs to these settings.

        Raises
        ------
        ParameterError
            When the folder cannot be made.
        """
        return cls(Work.open(root, settings).folder)

    def save(self, key: str, drafts: Sequence[Draft]) -> None:
        """Write the drafts of a source, in one step."""
        # another process may have found the folder empty and taken it away
        self.folder.mkdir(parents=True, exist_ok=True)
        header: list[dict[str, Any]] = []
        arrays: dict[str, NDArray[Any]] = {}
        for i, each in enumerate(drafts):
            row = None if each.row is None else {name: getattr(each.row, name) for name in _TEXT}
            header.append({"row": row, "reason": each.reason, "bands": len(each.features)})
            arrays |= {f"{i}.{j}": band for j, band in enumerate(each.features)}
            if each.row is not None:
                arrays |= {f"{i}.{name}": np.frombuffer(getattr(each.row, name), np.uint8) for name in _BYTES}
        write_container(self._file(key), _KIND, {"drafts": header}, arrays)

    def load(self, key: str) -> list[Draft]:
        """Read the drafts of a source.

        Raises
        ------
        ReadError
            When they are not there, or damaged.
        """
        header, arrays = read_container(self._file(key), _KIND)
        return [_to_draft(i, each, arrays) for i, each in enumerate(header["drafts"])]

    def ndims(self, key: str) -> tuple[int, ...] | None:
        """Return the dimensions of the shapes of a source; None where it is not done."""
        try:
            drafts = self.load(key)
        except SpemError:
            return None
        return tuple(each.row.ndim for each in drafts if each.row is not None)

    def has(self, key: str) -> bool:
        """Tell whether a source is done."""
        return self._file(key).is_file()

    def clear(self, keys: Iterable[str]) -> None:
        """Delete the drafts of sources, and folders that are empty then; those of others stay."""
        for key in keys:
            self._file(key).unlink(missing_ok=True)
        for folder in (self.folder, self.folder.parent):
            # It holds something else, or is gone.
            with suppress(OSError):
                folder.rmdir()

    def _file(self, key: str) -> Path:
        """Return the file of a source."""
        return self.folder / f"{key}{_SUFFIX}"


@dataclass(frozen=True)
class DraftFeatures:
    """Features of drafts, read source by source each time they are gone through.

    Parameters
    ----------
    drafts
        Where they are.
    keys
        Sources, in order.
    limit
        Most shapes.
    """

    drafts: Drafts
    keys: tuple[str, ...]
    limit: int

    def __iter__(self) -> Iterator[Bands]:
        found = (each for key in self.keys for each in self.drafts.load(key) if each.row is not None)
        return (each.features for each in islice(found, self.limit))


@dataclass(frozen=True)
class Make:
    """What workers do with a source of the sample.

    Parameters
    ----------
    settings
        How sources are read, and the kinds of features.
    keep_shape
        Whether rows hold the packed shape.
    threads
        Threads for a large shape.
    """

    settings: Settings
    keep_shape: bool = True
    threads: int | None = 1

    def __call__(self, item: Item) -> list[Draft]:
        """Make the drafts of a source."""
        return list(draft(item, self.settings, keep_shape=self.keep_shape, threads=self.threads))


@dataclass(frozen=True, eq=False)
class Finish:
    """What workers do with the drafts of a source, once there is a model.

    Parameters
    ----------
    drafts
        Where they are.
    model
        What codes are made with.
    """

    drafts: Drafts
    model: Model

    def __call__(self, item: Item) -> Described:
        """Make the rows of a source."""
        found = self.drafts.load(item.key)
        for each in found:
            if each.row is not None:
                self.model.require_ndim(each.row.ndim, each.row.path)
        return finish(found, self.model)


def learn(
    listing: Listing,
    settings: Settings,
    work: Make,
    drafts: Drafts,
    executor: Executor,
    progress: Progress,
    *,
    limit: int,
) -> Model:
    """Learn the model of a new index, the same that codes of the same sources would get.

    Only as many sources are gone through as it takes to find `limit` shapes, in an order that their
    content decides. Of shapes of several dimensions those of the commonest among them count.

    Parameters
    ----------
    listing
        The sources; those that fail are noted in it.
    settings
        How sources become codes.
    work
        What workers do with each.
    drafts
        Where the outcome is kept; what is there already is not done again.
    executor
        Where it is done.
    progress
        Called with ``"fields"``, the number of sources done and of all in the sample.
    limit
        Most shapes to learn from.

    Raises
    ------
    ReadError
        When no source gave a shape; it carries the failures.
    """
    order = sorted(listing.first, key=lambda key: _draw(settings.seed, key))
    ndims: dict[str, tuple[int, ...]] = {}
    taken = n_found = 0
    while taken < len(order) and n_found < limit:
        sample = order[: taken + limit - n_found]
        _complete(sample[taken:], ndims, listing, work, drafts, executor, progress, len(sample))
        taken = len(sample)
        n_found = _commonest(ndims)[1]
    ndim, n_found = _commonest(ndims)
    if not n_found:
        raise _nothing(listing, drafts, order)
    for key in [key for key, found in ndims.items() if found and ndim not in found]:
        reason = f"a {ndims[key][0]}-D shape among {ndim}-D ones, which are more; add it to another index"
        listing.fail(listing.first[key], reason, key)
    keys = tuple(key for key in order if ndim in ndims.get(key, ()))
    with threadpool_limits(1):
        return Model.fit(settings, DraftFeatures(drafts, keys, limit), ndim)


def _complete(
    keys: Sequence[str],
    ndims: dict[str, tuple[int, ...]],
    listing: Listing,
    work: Make,
    drafts: Drafts,
    executor: Executor,
    progress: Progress,
    total: int,
) -> None:
    """Make the drafts that are not there, and note the dimensions of all."""
    for key in keys:
        known = drafts.ndims(key)
        if known is not None:
            ndims[key] = known
    todo = [Item(key, listing.first[key]) for key in keys if key not in ndims]
    done = total - len(todo)
    progress("fields", done, total)
    with closing(executor.run(work, todo)) as outcomes:
        for item, found, reason in outcomes:
            if found is None:
                listing.fail(item.source, reason, item.key)
                ndims[item.key] = ()
            else:
                drafts.save(item.key, found)
                ndims[item.key] = tuple(each.row.ndim for each in found if each.row is not None)
            done += 1
            progress("fields", done, total)


def _commonest(ndims: dict[str, tuple[int, ...]]) -> tuple[int, int]:
    """Return the dimension that most sources have, the lowest of equally common ones, and its shapes."""
    counts = Counter(max(found) for found in ndims.values() if found)
    if not counts:
        return 0, 0
    ndim = min(counts, key=lambda each: (-counts[each], each))
    return ndim, sum(found.count(ndim) for found in ndims.values())


def _draw(seed: int, key: str) -> bytes:
    """Return what sources are ordered by for training: random, but decided by their content."""
    return hashlib.sha256(f"{seed} {key}".encode()).digest()


def _nothing(listing: Listing, drafts: Drafts, keys: Sequence[str]) -> ReadError:
    """Say that there is nothing to learn from, and why of the first source."""
    for key in keys:
        if key not in listing.broken and drafts.has(key):
            for each in drafts.load(key):
                listing.fail(listing.first[key], each.reason)
    first, *others = listing.failures
    more = f" (and {len(others)} more)" if others else ""
    return ReadError(f"no shape could be read, so there is no model: {first}{more}", listing.failures)


def _to_draft(i: int, header: dict[str, Any], arrays: dict[str, NDArray[Any]]) -> Draft:
    """Put a draft together from what `Drafts.save` made of it."""
    if header["row"] is None:
        return Draft(None, reason=header["reason"])
    values: dict[str, Any] = header["row"] | {name: arrays[f"{i}.{name}"].tobytes() for name in _BYTES}
    row = Row(code=np.empty(0, np.float32), **values)
    return Draft(row, tuple(arrays[f"{i}.{j}"] for j in range(header["bands"])))
