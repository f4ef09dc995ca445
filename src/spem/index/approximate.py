"""The approximate index of a table: built on demand, and its recall measured against all codes."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from spem.errors import ParameterError
from spem.index.extra import require

NAME = "nearest"
# Where the last measurement is kept: metadata of the column, which goes with the table.
_KEY = "spem.approximate"
# Codes that recall is measured on, and answers to each.
_QUERIES, _ANSWERS = 100, 10
# The search goes through more cells until so many of the nearest are found.
TARGET = 0.97
# Cells searched, in this order; beyond the last one the nearest are hardly ever missed.
_PROBES = (8, 16, 32, 64, 128, 256)
# The compressed codes choose so many times the answers, which are read and compared whole: most of the time
# that a search takes.
_REFINE = 4
# Lance trains its compression on at least so many codes.
_LEAST_ROWS = 256
# Distances of equal codes differ by as much in float32.
_ROUNDING = 1e-5


@dataclass(frozen=True)
class Approximation:
    """What is known of an approximate index.

    Parameters
    ----------
    kind
        How LanceDB names it.
    n_probes
        Cells that a search goes through.
    refine
        Candidates that are compared whole, in multiples of the answers.
    recall
        Share of the ten nearest other codes that were found, over 100 codes of the table.
    n_rows
        Rows of the table when that was measured.
    n_trained
        Rows of the table when the index was built.
    """

    kind: str
    n_probes: int
    refine: int
    recall: float
    n_rows: int
    n_trained: int

    @classmethod
    def of(cls, table: Any) -> Self | None:
        """Return what is known of the approximate index of a table, or None where it has none."""
        kept = (table.schema.field("vector").metadata or {}).get(_KEY.encode())
        if kept is None or all(index.name != NAME for index in table.list_indices()):
            return None
        return cls(**json.loads(kept))

    def ask(self, table: Any, vector: NDArray[np.float32]) -> Any:
        """Return the search of a table for the codes nearest to one; rows that came later are found too."""
        return table.search(vector).distance_type("l2").nprobes(self.n_probes).refine_factor(self.refine)


def exhaustive(table: Any, vector: NDArray[np.float32]) -> Any:
    """Return the search of a table that compares all codes."""
    return table.search(vector).distance_type("l2").bypass_vector_index()


def build(table: Any, kind: str = "IvfSq", **options: Any) -> None:
    """Build the approximate index of a table, in place of one that is there.

    Parameters
    ----------
    table
        The table.
    kind
        One of the kinds of `lancedb.index`.
    options
        For it.

    Raises
    ------
    ParameterError
        When the table has too few codes to train on.
    """
    n_rows = int(table.count_rows())
    if n_rows < _LEAST_ROWS:
        msg = f"{n_rows} codes, an approximate index needs {_LEAST_ROWS}; exact search is quick, keep to it"
        raise ParameterError(msg)
    config = getattr(require("lancedb.index"), kind)(distance_type="l2", **options)
    table.create_index("vector", config=config, replace=True, name=NAME)


def drop(table: Any) -> None:
    """Remove the approximate index of a table, and what is known of it."""
    if any(index.name == NAME for index in table.list_indices()):
        table.drop_index(NAME)
    _keep(table, None)


def measure(
    table: Any,
    rng: np.random.Generator,
    *,
    n_trained: int | None = None,
    probes: Sequence[int] = _PROBES,
    target: float = TARGET,
) -> Approximation:
    """Measure the recall of an approximate index, and keep the least number of cells that reaches a target.

    Parameters
    ----------
    table
        The table.
    rng
        Chooses the codes to ask by.
    n_trained
        Rows of the table when the index was built; those it has now by default.
    probes
        Numbers of cells to try, ascending.
    target
        Recall to be reached; where none does, the last is kept.
    """
    n_rows = int(table.count_rows())
    queries = _sample(table, min(_QUERIES, n_rows), rng)
    true = nearest_cosines(table, queries, _ANSWERS + 1)
    kind = next(str(each.index_type) for each in table.list_indices() if each.name == NAME)
    way = Approximation(kind, 0, _REFINE, 0.0, n_rows, n_trained or n_rows)
    for n_probes in probes:
        way = replace(way, n_probes=n_probes)
        way = replace(way, recall=recall_of(way, table, queries, true))
        if way.recall >= target:
            break
    _keep(table, way)
    return way


def recall_of(
    way: Approximation, table: Any, queries: NDArray[np.float32], true: NDArray[np.float32]
) -> float:
    """Return the share of the nearest other codes that a search finds, as good ones counting for them.

    Parameters
    ----------
    way
        How the index is asked.
    table
        The table.
    queries
        ``(n, n_code)`` standardised codes of the table.
    true
        ``(n, 1 + k)`` their largest cosines, descending, as `nearest_cosines` has them: the first is the
        code itself and not counted.
    """
    k = true.shape[1] - 1
    hits = 0
    for vector, cosines in zip(queries, true, strict=True):
        found = way.ask(table, vector).select(["vector", "_distance"]).limit(k + 1).to_arrow()
        codes = found.column("vector").combine_chunks().flatten().to_numpy(zero_copy_only=False)
        own = codes.reshape(-1, len(vector)) @ vector
        hits += min(k, int((own >= cosines[-1] - _ROUNDING).sum()) - 1)
    return float(hits / (k * len(queries)))


def nearest_cosines(table: Any, queries: NDArray[np.float32], k: int) -> NDArray[np.float32]:
    """Return the largest cosines of codes with all of a table, ``(n, k)`` and descending, in one pass."""
    best = np.empty((len(queries), 0), np.float32)
    for batch in table.search().select(["vector"]).to_batches():
        codes = batch.column("vector").flatten().to_numpy(zero_copy_only=False)
        cosines = np.hstack([best, queries @ codes.reshape(-1, queries.shape[1]).T])
        kept = min(k, cosines.shape[1])
        best = np.partition(cosines, cosines.shape[1] - kept, axis=1)[:, cosines.shape[1] - kept :]
    return np.sort(best, axis=1)[:, ::-1]


def _sample(table: Any, count: int, rng: np.random.Generator) -> NDArray[np.float32]:
    """Return the codes of some rows."""
    places = np.sort(rng.choice(int(table.count_rows()), count, replace=False))
    found = table.take_offsets(places.tolist()).select(["vector"]).to_arrow()
    flat = found.column("vector").combine_chunks().flatten().to_numpy(zero_copy_only=False)
    return np.asarray(flat.reshape(count, -1), np.float32)


def _keep(table: Any, way: Approximation | None) -> None:
    """Keep what was measured with the table."""
    value = None if way is None else json.dumps(asdict(way))
    table.update_field_metadata({"path": "vector", "metadata": {_KEY: value}})
