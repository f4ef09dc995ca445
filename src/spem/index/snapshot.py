"""Codes of a table in memory, kept up to date: what exact search goes through."""

from __future__ import annotations

import threading
from collections import OrderedDict
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from spem.index.database_errors import told
from spem.index.extra import require
from spem.index.filters import any_of
from spem.index.pinned import Pinned
from spem.index.schema import LIGHT

if TYPE_CHECKING:
    import pyarrow

    from spem.index.store import Store

DEFAULT_MEMORY = 2**30
# Beyond so many rows what answers tell of a shape is read from the database.
_ROWS_IN_MEMORY = 100_000
# So many changed rows are fetched one by one; for more the table is read anew.
_FETCHED = 500
# Filters whose rows are remembered.
_FILTERS = 32
_FLOAT = 4


@dataclass(frozen=True, eq=False)
class Snapshot:
    """The codes of a table at one version.

    Parameters
    ----------
    pinned
        The table, at that version.
    ids
        ``(n,)`` ids as bytes, in the order of the table.
    stamps
        ``(n,)`` when each row was written.
    vectors
        ``(n, n_code)`` standardised codes.
    rows
        What answers tell of each shape; None where it is left in the database.
    """

    pinned: Pinned
    ids: NDArray[np.bytes_]
    stamps: NDArray[np.int64]
    vectors: NDArray[np.float32]
    rows: pyarrow.Table | None
    _filters: OrderedDict[str, NDArray[np.intp]] = field(default_factory=OrderedDict)
    _lock: threading.Lock = field(default_factory=threading.Lock)

    @cached_property
    def order(self) -> NDArray[np.intp]:
        """``(n,)`` the rows in order of their ids."""
        return np.argsort(self.ids, kind="stable")

    def positions(self, ids: Iterable[str]) -> NDArray[np.intp]:
        """Return the rows of these ids; ids that are not there are left out."""
        return _positions(self.ids, self.order, _as_bytes(ids))

    def matching(self, where: str) -> NDArray[np.intp]:
        """Return the rows that a filter lets through."""
        with self._lock:
            held = self._filters.get(where)
            if held is not None:
                self._filters.move_to_end(where)
                return held
        found = self.pinned.table.search().where(where).select(["id"]).to_arrow()
        rows = np.sort(self.positions(found.column("id").to_pylist()))
        with self._lock:
            self._filters[where] = rows
            while len(self._filters) > _FILTERS:
                self._filters.popitem(last=False)
        return rows

    def records(self, places: NDArray[np.intp]) -> list[dict[str, Any]]:
        """Return what answers tell of some rows, as records of the table."""
        if self.rows is not None:
            return list(self.rows.take(places.astype(np.int64)).to_pylist())
        ids = [self.ids[place].decode() for place in places]
        known = {record["id"]: record for record in _search_ids(self.pinned.table, ids, LIGHT).to_pylist()}
        return [known[each] for each in ids]


class Snapshots:
    """The snapshots of an index, one a model, within a budget of memory.

    Parameters
    ----------
    memory
        Bytes that codes may take; tables of more are left in the database.
    """

    def __init__(self, memory: int = DEFAULT_MEMORY) -> None:
        self.memory = memory
        self._held: dict[str, Snapshot] = {}
        self._pinned: dict[str, Pinned] = {}
        self._lock = threading.Lock()

    def knows(self, digest: str) -> bool:
        """Tell whether a model has been searched before."""
        return digest in self._pinned

    def forget(self, digest: str) -> None:
        """Let go of a model that is dropped."""
        with self._lock:
            self._held.pop(digest, None)
            self._pinned.pop(digest, None)

    def pinned(self, store: Store, digest: str) -> Pinned:
        """Return the table of a model as it is in the database now."""
        with told(store.address):
            held = self._pinned.get(digest)
            if held is None or held.version != store.table(digest).version:
                newest = Pinned.newest(store, digest)
                if held is not None and newest.version < held.version:
                    # versions only grow: the model was dropped and has been added again
                    self._held.pop(digest, None)
                held = self._pinned[digest] = newest
            return held

    def of(self, pinned: Pinned, digest: str) -> Snapshot | None:
        """Return the codes of a table, or None where they are too many.

        Parameters
        ----------
        pinned
            The table.
        digest
            Its model.
        """
        held = self._held.get(digest)
        if held is not None and held.pinned.version >= pinned.version:
            return held
        with self._lock:
            held = self._held.get(digest)
            if held is not None and held.pinned.version >= pinned.version:
                return held
            size = pinned.n_rows * pinned.n_code * _FLOAT
            if size > self.memory:
                self._held.pop(digest, None)
                return None
            others = sum(one.vectors.nbytes for name, one in self._held.items() if name != digest)
            if size + others > self.memory:
                self._held = {name: one for name, one in self._held.items() if name == digest}
            self._held[digest] = read(pinned) if held is None else renewed(held, pinned)
            return self._held[digest]


def read(pinned: Pinned) -> Snapshot:
    """Read the codes of a table."""
    pa = require("pyarrow")
    columns = _columns(pinned)
    vectors, light, done = np.empty((pinned.n_rows, pinned.n_code), np.float32), [], 0
    for batch in pinned.table.search().select([*columns, "vector"]).to_batches():
        vectors[done : done + len(batch)] = _codes(batch, pinned.n_code)
        light.append(batch.select(columns))
        done += len(batch)
    rows = pa.Table.from_batches(light) if light else pinned.table.schema.empty_table().select(columns)
    return _snapshot(pinned, rows.combine_chunks(), vectors)


def renewed(old: Snapshot, pinned: Pinned) -> Snapshot:
    """Return the snapshot of a later version of a table; codes that stay are not read again."""
    rows = pinned.table.search().select(_columns(pinned)).to_arrow().combine_chunks()
    ids, stamps = _ids(rows), _stamps(rows)
    source = _positions(old.ids, old.order, ids, missing=-1)
    if len(old.ids):
        source[old.stamps[source] != stamps] = -1
    new = np.flatnonzero(source < 0)
    if len(new) > _FETCHED:
        return read(pinned)
    vectors = np.empty((len(ids), pinned.n_code), np.float32)
    vectors[source >= 0] = old.vectors[source[source >= 0]]
    if len(new):
        fetched = _search_ids(pinned.table, [ids[place].decode() for place in new], ["id", "vector"])
        at = _positions(ids, np.argsort(ids, kind="stable"), _ids(fetched))
        vectors[at] = _codes(fetched.combine_chunks(), pinned.n_code)
    return _snapshot(pinned, rows, vectors)


def _columns(pinned: Pinned) -> list[str]:
    """Return the columns that are kept in memory: of many rows what tells whether they are the same."""
    return list(LIGHT) if pinned.n_rows <= _ROWS_IN_MEMORY else ["id", "added"]


def _codes(rows: Any, n_code: int) -> NDArray[np.float32]:
    """Return the codes of a batch of rows, or of a table in one piece."""
    column = rows.column("vector")
    column = column.combine_chunks() if hasattr(column, "combine_chunks") else column
    return np.asarray(column.flatten().to_numpy(zero_copy_only=False), np.float32).reshape(-1, n_code)


def _search_ids(table: Any, ids: Sequence[str], columns: Sequence[str]) -> pyarrow.Table:
    """Read some columns of the rows of these ids."""
    return table.search().where(any_of("id", list(ids))).select(list(columns)).to_arrow()


def _snapshot(pinned: Pinned, rows: pyarrow.Table, vectors: NDArray[np.float32]) -> Snapshot:
    """Put a snapshot together; many rows keep only their ids."""
    kept = rows if rows.num_columns == len(LIGHT) else None
    return Snapshot(pinned, _ids(rows), _stamps(rows), vectors, kept)


def _ids(rows: pyarrow.Table) -> NDArray[np.bytes_]:
    """Return the ids of rows as bytes."""
    return _as_bytes(rows.column("id").to_pylist())


def _as_bytes(ids: Iterable[str]) -> NDArray[np.bytes_]:
    """Return ids as an array of bytes, which takes a quarter of the memory of text."""
    encoded = [each.encode() for each in ids]
    return np.array(encoded, np.bytes_) if encoded else np.empty(0, "S1")


def _stamps(rows: pyarrow.Table) -> NDArray[np.int64]:
    """Return when rows were written, in microseconds."""
    pa = require("pyarrow")
    return np.asarray(rows.column("added").cast(pa.int64()).to_numpy(), np.int64)


def _positions(
    ids: NDArray[np.bytes_],
    order: NDArray[np.intp],
    wanted: NDArray[np.bytes_],
    missing: int | None = None,
) -> NDArray[np.intp]:
    """Return where ids stand; those that are not there are left out, or get the number for missing ones."""
    if not len(ids):
        return np.full(0 if missing is None else len(wanted), -1)
    place = order[np.minimum(np.searchsorted(ids, wanted, sorter=order), len(ids) - 1)]
    there = ids[place] == wanted
    return place[there] if missing is None else np.where(there, place, missing)
