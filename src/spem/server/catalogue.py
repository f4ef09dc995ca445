"""The index as requests ask it: which model, one page of shapes, one row, thumbnails, neighbours."""

from __future__ import annotations

import time
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np

from spem.index.choosing import file_dimensions
from spem.index.index import Index
from spem.index.row import Row
from spem.index.schema import LIGHT, standardised_codes
from spem.index.searching import EXACT_ROWS
from spem.server.cards import card, ranking, to_json
from spem.server.holding import DESCENDING, Holding
from spem.server.queries import Filters, Sort, is_digest, is_id, quoted
from spem.server.refusals import Refusal
from spem.server.remembered import Remembered

# Seconds for which what changes only when somebody writes is taken as it was.
FRESH = 2.0
# Seconds after which lists and searches see what another process has written.
_SEEN = 0.5
_THUMBNAILS = 4096
_PAGES = 32
# Models of which it is not known when they were made come last.
_NEVER = datetime.max.replace(tzinfo=UTC)


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
        self._seen = Remembered(8, _SEEN)
        self._holdings: dict[str, Holding] = {}
        self._orders = Remembered(_PAGES, FRESH)
        self._thumbnails = Remembered(_THUMBNAILS, 60.0)
        self._described: dict[str, tuple[str, int | None, int]] = {}

    def models(self) -> list[ModelEntry]:
        """Return the models, the one that was made first at the head."""
        return self._fresh.get("models", self._models)

    def _models(self) -> list[ModelEntry]:
        store, entries = self.index.store, []
        made = {record["digest"]: record["made"] for record in store.model_records()}
        for digest in sorted(store.digests(), key=lambda digest: (made.get(digest, _NEVER), digest)):
            if digest not in self._described:
                model = store.load_model(digest)
                self._described[digest] = (model.settings.features, model.ndim, model.n_code)
            features, ndim, n_code = self._described[digest]
            count = int(store.table(digest).count_rows())
            entries.append(ModelEntry(digest, features, ndim, count, n_code))
        return entries

    def digest(self, wanted: str | None, key: str | None = None) -> str:
        """Return the digest of the model that is asked for.

        Where none is, the first that the index had, so that additions do not change it; of an id, the first
        that has such a row.

        Raises
        ------
        Refusal
            When there is no such model.
        """
        if wanted is None:
            known = self.models()
            if not known:
                raise Refusal(404, "the index has no shapes yet; add some first")
            several = known if key is not None and len(known) > 1 and is_id(key) else ()
            return next((entry.digest for entry in several if self._has(entry.digest, key)), known[0].digest)
        if not is_digest(wanted) or wanted not in (entry.digest for entry in self.models()):
            raise Refusal(404, "no such model; /api/info lists the models")
        return wanted

    def digest_for(self, wanted: str | None, name: str) -> str:
        """Return the digest of the model that is asked for, or of the first that takes such files.

        Raises
        ------
        Refusal
            When there is no such model.
        """
        models = self.models()
        ndims = file_dimensions(Path(name)) if wanted is None else ()
        return next((entry.digest for entry in models if entry.ndim in ndims), None) or self.digest(wanted)

    def _has(self, digest: str, key: str | None) -> bool:
        """Tell whether a model has a row of this id."""
        held = self.held(digest)
        if held is not None:
            return held.place(str(key)) is not None
        return self.index.store.count(digest, f"id = {quoted(str(key))}") > 0

    def labels(self, digest: str) -> list[dict[str, Any]]:
        """Return the labels and the number of shapes of each, in order of name."""
        return self._fresh.get(("labels", digest), lambda: self._labels(digest))

    def _labels(self, digest: str) -> list[dict[str, Any]]:
        """Count the labels."""
        held = self.held(digest)
        column = held.labels if held else self.index.store.query(digest).select(["label"]).to_arrow()["label"]
        counts = {entry["values"]: entry["counts"] for entry in column.value_counts().to_pylist()}
        return [{"label": label, "n": counts[label]} for label in sorted(counts) if label]

    def held(self, digest: str) -> Holding | None:
        """Return all that lists and searches need, in memory; None where it is too much for that."""
        return self._seen.get(digest, lambda: self._held(digest))

    def _held(self, digest: str) -> Holding | None:
        """Return what was held before, or anew where the database has changed."""
        known = self.index.snapshots
        snapshot = known.of(known.pinned(self.index.store, digest), digest)
        if snapshot is None or snapshot.rows is None or len(snapshot.ids) > EXACT_ROWS:
            return None
        held = self._holdings.get(digest)
        if held is None or held.snapshot is not snapshot:
            held = self._holdings[digest] = Holding(snapshot, digest)
        return held

    def page(self, digest: str, filters: Filters, sort: Sort, offset: int, limit: int) -> bytes:
        """Return the JSON of how many shapes pass the filters, and of a page of them."""
        where, held = filters.where(), self.held(digest)
        if held is not None:
            key = (digest, held.snapshot.pinned.version, where, sort)
            return held.page(self._orders.get(key, lambda: held.order(where, sort)), offset, limit)
        store, descending = self.index.store, sort in DESCENDING
        rows = store.rows(digest, where, limit=limit, offset=offset, sort=sort, descending=descending)
        return to_json({"total": store.count(digest, where), "shapes": [card(row) for row in rows]})

    def row(self, digest: str, key: str, *columns: str) -> Row:
        """Return one row, of the heavy columns those that are named.

        Raises
        ------
        Refusal
            When there is none.
        """
        found = None
        held = None if columns else self.held(digest)
        if held is not None:
            found = held.row(key) if is_id(key) else None
        elif is_id(key):
            wanted = [*LIGHT, *columns]
            found = next(
                iter(self.index.store.rows(digest, f"id = {quoted(key)}", columns=wanted, limit=1)), None
            )
        if found is None:
            raise Refusal(404, "no such shape; it may have been removed")
        return found

    def thumbnail(self, digest: str, key: str) -> bytes:
        """Return the picture of a row; empty where its dimension has none."""
        return self._thumbnails.get((digest, key), lambda: self.row(digest, key, "thumbnail").thumbnail)

    def neighbours(self, digest: str, key: str, k: int, where: str | None, *, rerank: bool) -> bytes:
        """Return the JSON of the shapes nearest to one of the index."""
        held = None if rerank else self.held(digest)
        place = held.place(key) if held is not None and is_id(key) else None
        if held is None or place is None:
            return self.nearest(digest, self.row(digest, key, "vector"), k, where, rerank=rerank)
        [query] = held.cards(np.array([place]))
        return held.neighbours(query, held.snapshot.vectors[place], k, where)

    def nearest(self, digest: str, query: Row, k: int, where: str | None, *, rerank: bool) -> bytes:
        """Return the JSON of the shapes nearest to a row, which need not be of the index."""
        held = None if rerank else self.held(digest)
        if held is not None:
            code = standardised_codes(query.code[None])[0]
            return held.neighbours(to_json(card(query)), code, k, where)
        begin = time.perf_counter()
        answers = self.index.search(query.code, k, where=where, model=digest, rerank=rerank)
        return to_json(ranking(card(query), answers, time.perf_counter() - begin))

    def changed(self) -> None:
        """Forget what a write has made old."""
        for kept in (self._fresh, self._seen, self._orders, self._thumbnails):
            kept.clear()
