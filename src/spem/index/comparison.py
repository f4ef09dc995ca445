"""Codes compared with a query: by one product in float32, the nearest once more in float64."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spem.index.schema import LIGHT
from spem.index.snapshot import Snapshot

# Cosines in float32 are right to this; codes that are no further from the last answer are compared again.
_ROUNDING = 1e-5
# Numbers of codes that are compared in float64 at a time.
_BLOCK = 2**20


@dataclass(frozen=True, eq=False)
class Nearest:
    """The codes nearest to a query, in order.

    Parameters
    ----------
    distances
        ``(k,)`` correlation distances.
    vectors
        ``(k, n_code)`` standardised codes.
    records
        Reads what answers tell of some of them, given their places.
    """

    distances: NDArray[np.float64]
    vectors: NDArray[np.float32]
    records: Callable[[NDArray[np.intp]], list[dict[str, Any]]]


def in_memory(snapshot: Snapshot, vector: NDArray[np.float32], k: int, where: str | None = None) -> Nearest:
    """Compare a query with all codes in memory, or with those that a filter lets through.

    Parameters
    ----------
    snapshot
        The codes.
    vector
        ``(n_code,)`` standardised code.
    k
        Number of answers; equally near ones are ordered by id.
    where
        Filter in the SQL of the database.
    """
    among = None if where is None else snapshot.matching(where)
    best, distances = nearest(snapshot.vectors, snapshot.ids, vector, k, among)
    return Nearest(distances, snapshot.vectors[best], lambda places: snapshot.records(best[places]))


def in_database(ask: Any, vector: NDArray[np.float32], k: int, where: str | None = None) -> Nearest:
    """Let the database find the nearest codes.

    Parameters
    ----------
    ask
        The search to be made, as LanceDB has it.
    vector, k, where
        As `in_memory` takes them. Of codes as far as the last answer, to seven digits, any may be left out.
    """
    if where is not None:
        ask = ask.where(where, prefilter=True)
    # the distance is named, or LanceDB warns that it will not add it by itself in future
    found = ask.select([*LIGHT, "vector", "_distance"]).limit(k).to_arrow()
    flat = found.column("vector").combine_chunks().flatten().to_numpy(zero_copy_only=False)
    vectors = flat.reshape(-1, len(vector))
    ids = np.array([each.encode() for each in found.column("id").to_pylist()], np.bytes_)
    best, distances = nearest(vectors, ids, vector, k)
    light = found.select(LIGHT)
    return Nearest(distances, vectors[best], lambda places: list(light.take(best[places]).to_pylist()))


def nearest(
    vectors: NDArray[np.float32],
    ids: NDArray[np.bytes_],
    vector: NDArray[np.float32],
    k: int,
    among: NDArray[np.intp] | None = None,
) -> tuple[NDArray[np.intp], NDArray[np.float64]]:
    """Return the places of the codes nearest to one, and their distances.

    Parameters
    ----------
    vectors
        ``(n, n_code)`` standardised codes.
    ids
        ``(n,)`` what decides between equally near ones.
    vector
        ``(n_code,)`` standardised code.
    k
        Number of answers.
    among
        Places to choose from; all where None.

    Examples
    --------
    >>> codes = np.array([[1, 0], [0, 1], [1, 0]], np.float32)
    >>> nearest(codes, np.array([b"c", b"a", b"b"]), codes[0], 2)
    (array([2, 0]), array([0., 0.]))
    """
    if among is not None and 2 * len(among) < len(vectors):
        cosines = vectors[among] @ vector
    else:
        cosines = vectors @ vector
        cosines = cosines if among is None else cosines[among]
    if len(cosines) > k:
        last = np.partition(cosines, len(cosines) - k)[len(cosines) - k]
        chosen = np.flatnonzero(cosines >= last - _ROUNDING)
    else:
        chosen = np.arange(len(cosines))
    places = chosen if among is None else among[chosen]
    distances = correlation_distances(vectors, places, vector)
    order = np.lexsort((ids[places], distances))[:k]
    return places[order], distances[order]


def correlation_distances(
    vectors: NDArray[np.float32], places: NDArray[np.intp], vector: NDArray[np.float32]
) -> NDArray[np.float64]:
    """Return the correlation distances of some codes to one, in float64.

    Half the squared difference of unit vectors: zero for equal ones, and right where they nearly are. A
    constant code, kept as zeros, is at 1 from any other.
    """
    query = _unit(vector[None].astype(np.float64))
    out = np.empty(len(places))
    step = max(1, _BLOCK // max(1, len(vector)))
    for start in range(0, len(places), step):
        block = _unit(vectors[places[start : start + step]].astype(np.float64))
        lengths = np.square(block).sum(axis=1) + np.square(query).sum()
        # of two unit vectors lengths is 2, and the last term zero
        out[start : start + step] = np.square(block - query).sum(axis=1) / 2 + 1 - np.round(lengths) / 2
    return out


def _unit(vectors: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return vectors at unit length, which float32 keeps to seven digits; zeros stay."""
    length = np.linalg.norm(vectors, axis=1, keepdims=True)
    return np.asarray(vectors / np.where(length > 0, length, 1.0))
