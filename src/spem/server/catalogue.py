"""The index as requests ask it: which model, one page of shapes, one row, thumbnails, neighbours."""

from __future__ import annotations

import time
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spem.index.answers import Answers, Found
from spem.index.comparison import in_memory
from spem.index.extra import require
from spem.index.index import Index
from spem.index.row import Row
from spem.index.schema import LIGHT, standardised_codes, to_row
from spem.index.searching import EXACT_ROWS
from spem.index.snapshot import Snapshot
from spem.server.cards import card, ranking
from spem.server.queries import Filters, Sort, is_digest, is_id, quoted
from spem.server.refusals import Refusal
from spem.server.remembered import Remembered

# Seconds for which what changes only when somebody writes is taken as it was.
FRESH = 2.0
# Seconds after which lists and searches see what another process has written.
_SEEN = 0.5
_DESCENDING = ("added", "volume")
_THUMBNAILS = 4096
_PAGES = 32


@dataclass(frozen=True)
class ModelEntry:
    """A model of the index.

    Parameters
    ----------
    digest, features, n_shapes, n_code
        Its name, its kinds of features, the number of its rows and of entries of a code.
    ndim
        Dimension of its shapes; None for any.
    """

    digest: str
    features: str
    ndim: int | None
    n_shapes: int
    n_code: int


class Catalogue:
    """Reads of an index, for several threads.

    Parameters
    ----------
    index
        The index.
    """

    def __init__(self, index: Index) -> None:
        self.index = index
        self._fresh = Remembered(64, FRESH)
        self._snapshots = Remembered(8, _SEEN)
        self._orders = Remembered(_PAGES, FRESH)
        self._thumbnails = Remembered(_THUMBNAILS, 60.0)
        self._described: dict[str, tuple[str, int | None, int]] = {}

    def models(self) -> list[ModelEntry]:
        """Return the models, the one of most shapes first."""
        return self._fresh.get("models", self._models)

    def _models(self) -> list[ModelEntry]:
        store, entries = self.index.store, []
        for digest in store.digests():
            if digest not in self._described:
                model = store.load_model(digest)
                self._described[digest] = (model.settings.features, model.ndim, model.n_code)
            features, ndim, n_code = self._described[digest]
            count = int(store.table(digest).count_rows())
            entries.append(ModelEntry(digest, features, ndim, count, n_code))
        return sorted(entries, key=lambda entry: (-entry.n_shapes, entry.digest))

    def digest(self, wanted: str | None) -> str:
        """Return the digest of the model that is asked for, of the one with most shapes where none is.

        Raises
        ------
        Refusal
            When there is no such model.
        """
        if wanted is None:
            known = self.models()
            if not known:
                raise Refusal(404, "the index has no shapes yet; add some first")
            return known[0].digest
        if not is_digest(wanted) or wanted not in (entry.digest for entry in self.models()):
            raise Refusal(404, "no such model; /api/info lists the models")
        return wanted

    def labels(self, digest: str) -> list[dict[str, Any]]:
        """Return the labels and the number of shapes of each, in order of name."""
        return self._fresh.get(("labels", digest), lambda: self._labels(digest))

    def _labels(self, digest: str) -> list[dict[str, Any]]:
        """Count the labels."""
        held = self.held(digest)
        rows: Any = (
            held.rows if held else self.index.store.table(digest).search().select(["label"]).to_arrow()
        )
        column = rows["label"]
        counts = {entry["values"]: entry["counts"] for entry in column.value_counts().to_pylist()}
        return [{"label": label, "n": counts[label]} for label in sorted(counts) if label]

    def held(self, digest: str) -> Snapshot | None:
        """Return all that lists and searches need, in memory; None where it is too much for that."""
        snapshot = self._snapshots.get(digest, lambda: self._snapshot(digest))
        fits = snapshot is not None and snapshot.rows is not None and len(snapshot.ids) <= EXACT_ROWS
        return snapshot if fits else None

    def _snapshot(self, digest: str) -> Snapshot | None:
        """Return the codes of a model as they are in the database now."""
        known = self.index.snapshots
        return known.of(known.pinned(self.index.store, digest), digest)

    def page(
        self, digest: str, filters: Filters, sort: Sort, offset: int, limit: int
    ) -> tuple[int, list[Row]]:
        """Return how many shapes pass the filters, and a page of them."""
        where, held = filters.where(), self.held(digest)
        if held is None:
            store, descending = self.index.store, sort in _DESCENDING
            total = store.count(digest, where)
            return total, store.rows(
                digest, where, limit=limit, offset=offset, sort=sort, descending=descending
            )
        key = (digest, held.pinned.version, where, sort)
        order = self._orders.get(key, lambda: _order(held, where, sort))
        return len(order), [to_row(record) for record in held.records(order[offset : offset + limit])]

    def row(self, digest: str, key: str, columns: tuple[str, ...] = ()) -> Row:
        """Return one row, of the heavy columns those that are named.

        Raises
        ------
        Refusal
            When there is none.
        """
        found: list[Row] = []
        held = self.held(digest) if set(columns) <= {"vector"} else None
        if held is not None:
            places = held.positions([key]) if is_id(key) else np.empty(0, np.intp)
            vectors = held.vectors[places]
            records = held.records(places)
            found = [
                replace(to_row(record), code=code) for record, code in zip(records, vectors, strict=True)
            ]
        elif is_id(key):
            found = self.index.store.rows(digest, f"id = {quoted(key)}", columns=[*LIGHT, *columns], limit=1)
        if not found:
            raise Refusal(404, "no such shape; it may have been removed")
        return found[0]

    def thumbnail(self, digest: str, key: str) -> bytes:
        """Return the picture of a row; empty where its dimension has none."""
        return self._thumbnails.get((digest, key), lambda: self.row(digest, key, ("thumbnail",)).thumbnail)

    def neighbours(
        self, digest: str, query: Row, k: int, where: str | None, *, rerank: bool
    ) -> dict[str, Any]:
        """Return the shapes nearest to a row, of the index or of an upload."""
        begin = time.perf_counter()
        held = None if rerank else self.held(digest)
        if held is None:
            answers = self.index.search(query.code, k, where=where, model=digest, rerank=rerank)
        else:
            near = in_memory(held, standardised_codes(query.code[None])[0], k, where)
            rows = map(to_row, near.records(np.arange(len(near.distances))))
            ranked = enumerate(zip(near.distances.tolist(), rows, strict=True), 1)
            answers = Answers(
                tuple(Found(rank, distance, row) for rank, (distance, row) in ranked), "exact", digest
            )
        return ranking(card(query), answers, time.perf_counter() - begin)

    def changed(self) -> None:
        """Forget what a write has made old."""
        for kept in (self._fresh, self._snapshots, self._orders, self._thumbnails):
            kept.clear()


def _order(held: Snapshot, where: str | None, sort: Sort) -> NDArray[np.intp]:
    """Return the places of the rows that pass a filter, in order; equal ones by id."""
    places = np.arange(len(held.ids)) if where is None else held.matching(where)
    rows: Any = held.rows
    keys = rows.select([sort, "id"]).take(places)
    direction = "descending" if sort in _DESCENDING else "ascending"
    found = require("pyarrow.compute").sort_indices(keys, [(sort, direction), ("id", "ascending")])
    return np.asarray(places[found.to_numpy()])
