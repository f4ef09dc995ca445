"""Near-duplicates: shapes whose codes are next to equal, in groups."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import Any, overload

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from spem.codes.arguments import finite_number
from spem.errors import ParameterError
from spem.index.approximate import Approximation
from spem.index.comparison import correlation_distances
from spem.index.database_errors import told
from spem.index.filters import to_sql
from spem.index.row import Row
from spem.index.searching import EXACT_ROWS
from spem.index.snapshot import Snapshot, Snapshots
from spem.index.store import Store

# Measured on SHREC'11 with the codes that solids get by default: a mesh turned and scaled is at 0.018 from
# itself (median; at most 0.13), the same animal in another pose at 0.10 at least, another animal at 0.45.
DISTANCE = 0.05
# Codes of a block that is compared with all others by one product.
_BLOCK = 1024
# Distances within a group that are in memory at a time.
_DISTANCES = 2**22
# Cosines in float32 are right to this; pairs so near the limit are compared in float64.
_ROUNDING = 1e-5
_MANY_PAIRS = 20_000_000
# Neighbours that the approximate index is asked for.
_NEIGHBOURS = 32
_CLIENTS = 4
_COPIED = "array_length(copies) > 0"


@dataclass(frozen=True)
class Group:
    """Shapes that are near-duplicates of each other.

    Parameters
    ----------
    rows
        The shapes: first the representative, whose mean distance to the others is least, then these from
        near to far.
    distances
        Distance of each to the representative.
    diameter
        Largest distance between two of them; over the limit where a chain of near ones joins them.
    """

    rows: tuple[Row, ...]
    distances: tuple[float, ...]
    diameter: float

    @property
    def representative(self) -> Row:
        """The shape that stands for the group."""
        return self.rows[0]


@dataclass(frozen=True, repr=False)
class Duplicates(Sequence[Group]):
    """Near-duplicates of an index.

    Parameters
    ----------
    groups
        Groups of at least two shapes, the largest first.
    copies
        Rows whose file is there more than once, byte by byte; see `Row.copies`.
    distance
        Correlation distance below which two shapes are near-duplicates.
    method
        ``"exact"`` where all pairs were compared, ``"approximate"`` where the nearest 32 of each were.
    """

    groups: tuple[Group, ...]
    copies: tuple[Row, ...]
    distance: float
    method: str = "exact"

    @overload
    def __getitem__(self, index: int) -> Group: ...
    @overload
    def __getitem__(self, index: slice) -> tuple[Group, ...]: ...
    def __getitem__(self, index: int | slice) -> Group | tuple[Group, ...]:
        return self.groups[index]

    def __len__(self) -> int:
        return len(self.groups)

    def __iter__(self) -> Iterator[Group]:
        return iter(self.groups)

    def to_dicts(self) -> list[dict[str, Any]]:
        """Return the groups as plain values, which `json` can write."""
        return [
            {
                "representative": group.representative.id,
                "diameter": group.diameter,
                "shapes": [
                    {"id": row.id, "name": row.name, "path": row.path, "distance": distance}
                    for row, distance in zip(group.rows, group.distances, strict=True)
                ],
            }
            for group in self.groups
        ]

    def __repr__(self) -> str:
        shapes = sum(len(group.rows) for group in self.groups)
        within = f"within {self.distance:g}, {self.method}"
        return f"Duplicates({len(self.groups)} groups of {shapes} shapes {within})"


def find_duplicates(
    store: Store,
    snapshots: Snapshots,
    digest: str,
    distance: float = DISTANCE,
    where: str | None = None,
) -> Duplicates:
    """Group the shapes of a table that are nearer than a distance: the connected components of such pairs.

    Parameters
    ----------
    store
        The database.
    snapshots
        Codes in memory.
    digest
        The model.
    distance
        Correlation distance, in (0, 1).
    where
        Filter of rows.

    Raises
    ------
    ParameterError
        When the distance is out of its range or joins too many pairs, or the codes do not fit into memory.
    """
    limit = finite_number("distance", distance)
    if not 0 < limit < 1:
        msg = f"distance={distance}: expected a correlation distance in (0, 1), such as {DISTANCE}"
        raise ParameterError(msg)
    with told(store.address, where=where):
        pinned = snapshots.pinned(store, digest)
        snapshot = snapshots.of(pinned, digest)
        if snapshot is None:
            msg = f"{store.address}: the codes take over {snapshots.memory} bytes of memory; filter them"
            raise ParameterError(msg)
        places = np.arange(len(snapshot.ids)) if where is None else snapshot.matching(to_sql(where))
        vectors = snapshot.vectors if where is None else snapshot.vectors[places]
        way = pinned.approximation if len(places) > EXACT_ROWS else None
        pairs = _asked_pairs(way, snapshot, places, limit) if way else near_pairs(vectors, limit)
        ids = snapshot.ids[places]
        together = components(pairs, len(places))
        found = [_Found.of(vectors, members[np.argsort(ids[members])]) for members in together]
        order = sorted(found, key=lambda one: (-len(one.members), ids[one.members[0]]))
        groups = tuple(_group(store, snapshot, places, one) for one in order)
        copies = store.rows(digest, _COPIED if where is None else f"({where}) AND {_COPIED}")
    return Duplicates(groups, tuple(copies), limit, "exact" if way is None else "approximate")


def near_pairs(vectors: NDArray[np.float32], limit: float) -> NDArray[np.intp]:
    """Return all pairs of codes at a correlation distance of at most a limit.

    Parameters
    ----------
    vectors
        ``(n, n_code)`` standardised codes.
    limit
        The distance.

    Returns
    -------
    numpy.ndarray
        ``(n_pairs, 2)``, the lower place first.

    Raises
    ------
    ParameterError
        When there are more than twenty million.

    Examples
    --------
    >>> near_pairs(np.array([[1, 0], [0, 1], [1, 0]], np.float32), 0.1)
    array([[0, 2]])
    """
    found, count = [np.empty((0, 2), np.intp)], 0
    for top in range(0, len(vectors), _BLOCK):
        for left in range(top, len(vectors), _BLOCK):
            cosines = vectors[top : top + _BLOCK] @ vectors[left : left + _BLOCK].T
            first, second = np.nonzero(cosines >= 1 - limit - _ROUNDING)
            pairs = np.stack([first + top, second + left], axis=1)
            pairs = pairs[pairs[:, 0] < pairs[:, 1]]
            if len(pairs):
                found.append(pairs[_within(vectors, pairs, limit)])
                count += len(found[-1])
        if count > _MANY_PAIRS:
            msg = f"distance={limit:g} joins more than {_MANY_PAIRS} pairs; give a smaller one"
            raise ParameterError(msg)
    return np.concatenate(found)


def components(pairs: NDArray[np.intp], n: int) -> list[NDArray[np.intp]]:
    """Return the connected components of two and more of `n` that pairs join.

    Examples
    --------
    >>> components(np.array([[0, 2], [2, 3]]), 5)
    [array([0, 2, 3])]
    """
    graph = coo_array((np.ones(len(pairs), bool), (pairs[:, 0], pairs[:, 1])), shape=(n, n))
    _, label = connected_components(graph, directed=False)
    order = np.argsort(label, kind="stable")
    starts = np.flatnonzero(np.diff(label[order])) + 1
    return [members for members in np.split(order, starts) if len(members) > 1]


@dataclass(frozen=True, eq=False)
class _Found:
    """A group: its places from the representative on, their distances to it, and its diameter."""

    members: NDArray[np.intp]
    distances: NDArray[np.float64]
    diameter: float

    @classmethod
    def of(cls, vectors: NDArray[np.float32], members: NDArray[np.intp]) -> _Found:
        """Find the representative of a group."""
        codes = vectors[members].astype(np.float64)
        codes /= np.linalg.norm(codes, axis=1, keepdims=True)
        sums, diameter, step = np.empty(len(members)), 0.0, max(1, _DISTANCES // len(members))
        for start in range(0, len(members), step):
            block = np.maximum(1 - codes[start : start + step] @ codes.T, 0)
            sums[start : start + step] = block.sum(axis=1)
            diameter = max(diameter, float(block.max()))
        # of a pair both are as good but for rounding
        middle = int(np.argmax(sums <= sums.min() + _ROUNDING))
        distances = correlation_distances(vectors, members, vectors[members[middle]])
        order = np.argsort(distances, kind="stable")
        # the representative leads, whatever is equal to it
        order = np.concatenate([[middle], order[order != middle]])
        return cls(members[order], distances[order], diameter)


def _within(vectors: NDArray[np.float32], pairs: NDArray[np.intp], limit: float) -> NDArray[np.bool_]:
    """Tell which pairs are within a distance, in float64."""
    keep = np.empty(len(pairs), bool)
    for start in range(0, len(pairs), _BLOCK):
        first, second = (vectors[column].astype(np.float64) for column in pairs[start : start + _BLOCK].T)
        cosine = np.einsum("ij,ij->i", first, second)
        lengths = np.linalg.norm(first, axis=1) * np.linalg.norm(second, axis=1)
        keep[start : start + _BLOCK] = 1 - cosine / np.maximum(lengths, np.finfo(float).tiny) <= limit
    return keep


def _asked_pairs(
    way: Approximation, snapshot: Snapshot, places: NDArray[np.intp], limit: float
) -> NDArray[np.intp]:
    """Return the pairs within a distance that the approximate index finds, by several clients at once."""
    among = np.full(len(snapshot.ids), -1)
    among[places] = np.arange(len(places))

    def ask(place: int) -> NDArray[np.intp]:
        """Return the pairs of one code."""
        # half the squared difference of unit vectors is their distance
        asked = way.ask(snapshot.pinned.table, snapshot.vectors[place]).distance_range(upper_bound=2 * limit)
        ids = asked.select(["id", "_distance"]).limit(_NEIGHBOURS).to_arrow().column("id").to_pylist()
        others = among[snapshot.positions(ids)]
        others = others[(others >= 0) & (others != among[place])]
        return np.stack([np.full(len(others), among[place]), others], axis=1)

    with ThreadPoolExecutor(_CLIENTS) as clients:
        return np.concatenate(list(clients.map(ask, places)))


def _group(store: Store, snapshot: Snapshot, places: NDArray[np.intp], found: _Found) -> Group:
    """Put a group together."""
    rows = tuple(store.row(record) for record in snapshot.records(places[found.members]))
    return Group(rows, tuple(found.distances.tolist()), found.diameter)
