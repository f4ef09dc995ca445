"""The index as requests ask it: which model, one page of shapes, one row, thumbnails, neighbours."""

from __future__ import annotations

import threading
import time
from collections import OrderedDict
from collections.abc import Callable, Hashable
from dataclasses import dataclass
from typing import Any, TypeVar

from spem.index.index import Index
from spem.index.row import Row
from spem.index.schema import LIGHT
from spem.server.cards import card, ranking
from spem.server.queries import Filters, Sort, is_digest, is_id, quoted
from spem.server.refusals import Refusal

Value = TypeVar("Value")

# Seconds for which what changes only when somebody writes is taken as it was.
FRESH = 2.0
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
        column = self.index.store.table(digest).search().select(["label"]).to_arrow()["label"]
        counts = {entry["values"]: entry["counts"] for entry in column.value_counts().to_pylist()}
        return [{"label": label, "n": counts[label]} for label in sorted(counts) if label]

    def page(
        self, digest: str, filters: Filters, sort: Sort, offset: int, limit: int
    ) -> tuple[int, list[Row]]:
        """Return how many shapes pass the filters, and a page of them."""
        where = filters.where()
        order = self._orders.get((digest, where, sort), lambda: self._order(digest, where, sort))
        wanted = order[offset : offset + limit]
        if not wanted:
            return len(order), []
        listed = ", ".join(map(quoted, wanted))
        rows = {row.id: row for row in self.index.store.rows(digest, f"id IN ({listed})")}
        return len(order), [rows[key] for key in wanted if key in rows]

    def _order(self, digest: str, where: str | None, sort: Sort) -> list[str]:
        """Return the ids that pass a filter, in order; equal ones by id."""
        query = self.index.store.table(digest).search().select(["id", sort])
        table = (query.where(where) if where else query).to_arrow()
        direction = "descending" if sort in _DESCENDING else "ascending"
        ids: list[str] = table.sort_by([(sort, direction), ("id", "ascending")])["id"].to_pylist()
        return ids

    def row(self, digest: str, key: str, columns: tuple[str, ...] = ()) -> Row:
        """Return one row, of the heavy columns those that are named.

        Raises
        ------
        Refusal
            When there is none.
        """
        if is_id(key):
            found = self.index.store.rows(digest, f"id = {quoted(key)}", columns=[*LIGHT, *columns], limit=1)
            if found:
                return found[0]
        raise Refusal(404, "no such shape; it may have been removed")

    def thumbnail(self, digest: str, key: str) -> bytes:
        """Return the picture of a row; empty where its dimension has none."""
        return self._thumbnails.get((digest, key), lambda: self.row(digest, key, ("thumbnail",)).thumbnail)

    def neighbours(
        self, digest: str, query: Row, k: int, where: str | None, *, rerank: bool
    ) -> dict[str, Any]:
        """Return the shapes nearest to a row, of the index or of an upload."""
        begin = time.perf_counter()
        options = {"rerank": True} if rerank else {}
        answers = self.index.search(query.code, k, where=where, model=digest, **options)
        return ranking(card(query), answers, time.perf_counter() - begin)

    def changed(self) -> None:
        """Forget what a write has made old."""
        for kept in (self._fresh, self._orders, self._thumbnails):
            kept.clear()


class Remembered:
    """Values that hold for some seconds, the latest used ones.

    Parameters
    ----------
    size
        Number of values kept.
    seconds
        How long a value holds.
    """

    def __init__(self, size: int, seconds: float) -> None:
        self._size, self._seconds = size, seconds
        self._lock = threading.Lock()
        self._values: OrderedDict[Hashable, tuple[float, Any]] = OrderedDict()

    def get(self, key: Hashable, make: Callable[[], Value]) -> Value:
        """Return a value, made where there is none or an old one."""
        now = time.monotonic()
        with self._lock:
            made, value = self._values.get(key, (-self._seconds, None))
            if now - made < self._seconds:
                self._values.move_to_end(key)
                known: Value = value
                return known
        fresh = make()
        with self._lock:
            self._values[key] = (now, fresh)
            self._values.move_to_end(key)
            while len(self._values) > self._size:
                self._values.popitem(last=False)
        return fresh

    def clear(self) -> None:
        """Forget all values."""
        with self._lock:
            self._values.clear()
