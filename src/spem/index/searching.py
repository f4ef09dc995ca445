"""The shapes nearest to a query: exact in memory or in the database, approximate by its index."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spem.codes.arguments import finite_number, whole_number
from spem.errors import ParameterError, SpemError
from spem.index.answers import Answers, Found
from spem.index.approximate import Approximation, exhaustive
from spem.index.comparison import in_database, in_memory
from spem.index.database_errors import told
from spem.index.diffused import NEIGHBOURHOOD, diffused
from spem.index.filters import to_sql
from spem.index.pinned import Pinned
from spem.index.queries import Query, resolve
from spem.index.snapshot import Snapshots
from spem.index.store import Store
from spem.shapes.shape import Shape

# So many codes are gone through one by one; beyond them the approximate index answers where there is one.
EXACT_ROWS = 100_000


@dataclass(frozen=True)
class Search:
    """How an index is searched.

    Parameters
    ----------
    k
        Number of answers.
    where
        Filter of rows, as `spem.index.filters.to_sql` takes it.
    exact
        Whether all codes are compared, or the approximate index asked; by their number where None.
    rerank
        Whether the nearest are put in the order of diffusion over their neighbourhood.
    volume_within
        Largest ratio, above or below, of the volumes of an answer and of the query.
    """

    k: int = 10
    where: str | None = None
    exact: bool | None = None
    rerank: bool = False
    volume_within: float | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "k", whole_number("k", self.k))
        factor = self.volume_within
        if factor is not None and finite_number("volume_within", factor) < 1:
            msg = f"volume_within={factor}: expected a ratio of volumes of at least 1, such as 1.25"
            raise ParameterError(msg)

    def filter(self, query: Query) -> str | None:
        """Return the filter that the database gets for a query.

        Raises
        ------
        ParameterError
            When volumes are to be compared, and the query has none.
        """
        parts = [] if self.where is None else [to_sql(self.where)]
        if self.volume_within is not None:
            if query.volume is None:
                msg = "volume_within: a code has no volume; ask by a file, a shape or the id of a row"
                raise ParameterError(msg)
            low, high = query.volume / self.volume_within, query.volume * self.volume_within
            parts.append(f"volume BETWEEN {low!r} AND {high!r}")
        return " AND ".join(f"({part})" for part in parts) or None


def search(
    store: Store,
    snapshots: Snapshots,
    digest: str,
    query: str | Path | Shape | NDArray[Any],
    wanted: Search,
) -> Answers:
    """Return the shapes of a table that are nearest to a query.

    Parameters
    ----------
    store
        The database.
    snapshots
        Codes in memory.
    digest
        The model whose table is searched.
    query
        As `spem.index.queries.resolve` takes it.
    wanted
        How many answers, of which shapes, and how to find them.

    Raises
    ------
    SpemError
        When the query or the filter has no meaning, or the index cannot be read.
    """
    pinned = snapshots.pinned(store, digest)
    try:
        return _search(store, snapshots, digest, query, wanted, pinned)
    except SpemError:
        newer = snapshots.pinned(store, digest)
        # what was being read may have been cleaned up meanwhile
        if newer is pinned:
            raise
        return _search(store, snapshots, digest, query, wanted, newer)


def _search(
    store: Store,
    snapshots: Snapshots,
    digest: str,
    query: str | Path | Shape | NDArray[Any],
    wanted: Search,
    pinned: Pinned,
) -> Answers:
    """Search one version of a table."""
    with told(store.address, where=wanted.where):
        way = _approximation(pinned, wanted.exact, store.address)
        snapshot = None if way else snapshots.of(pinned, digest)
        found = resolve(query, store, digest, pinned, snapshot)
        where = wanted.filter(found)
        count = max(wanted.k, NEIGHBOURHOOD) if wanted.rerank else wanted.k
        if snapshot is not None:
            near = in_memory(snapshot, found.vector, count, where)
        else:
            ask = way.ask(pinned.table, found.vector) if way else exhaustive(pinned.table, found.vector)
            near = in_database(ask, found.vector, count, where)
        method = "approximate" if way else "exact"
        if wanted.rerank:
            near, method = diffused(near, found.vector, wanted.k), f"{method}, diffusion re-ranked"
        rows = [store.row(record) for record in near.records(np.arange(len(near.distances)))]
    ranked = zip(near.distances.tolist(), rows, strict=True)
    answers = tuple(Found(place, distance, row) for place, (distance, row) in enumerate(ranked, 1))
    return Answers(answers, method, digest, way.recall if way else None)


def _approximation(pinned: Pinned, exact: bool | None, address: str) -> Approximation | None:
    """Return the approximate index to ask, or None where all codes are to be compared."""
    if exact or (exact is None and pinned.n_rows <= EXACT_ROWS):
        return None
    if pinned.approximation is None and exact is False:
        msg = f"{address}: no approximate index; make it with: spem index optimize {address} --approximate"
        raise ParameterError(msg)
    return pinned.approximation
