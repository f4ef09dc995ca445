"""Counting the local features that two shapes share."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numba import njit
from numpy.typing import NDArray

# Angles below 1.4e-3 are rounding of single precision, and equal.
_SAME = 1 - 1e-6
# Cosines held at once: 16 MB, what a core's share of the last cache holds a good part of.
_BLOCK = 1 << 22


def count_matches(features: Sequence[NDArray[np.float32]], ratio: float) -> NDArray[np.int64]:
    """Count the matching features of every two shapes.

    Two features match when each is nearest in angle to the other among the features of the other's shape, and
    nearer than `ratio` times the angle to the second nearest, both ways.

    Parameters
    ----------
    features
        ``(n_features, n_entries)`` unit vectors of each shape; shapes may have none.
    ratio
        Largest ratio of the angle of the nearest to that of the second nearest, in (0, 1].

    Returns
    -------
    numpy.ndarray
        ``(n_shapes, n_shapes)`` symmetric counts; on the diagonal, the features that no other of
        their own shape equals.

    Examples
    --------
    >>> three = np.eye(3, dtype=np.float32)
    >>> count_matches([three, three[:2]], 0.8)
    array([[3, 2],
           [2, 2]])
    """
    sizes = [len(rows) for rows in features]
    ends = np.concatenate([[0], np.cumsum(sizes)])
    stacked = np.concatenate([np.ascontiguousarray(rows, np.float32) for rows in features])
    counts = np.zeros((len(features), len(features)), np.int64)
    for i, size in enumerate(sizes):
        j = i
        while size and j < len(features):
            fits = int(np.searchsorted(ends, ends[j] + _BLOCK // size, side="right")) - 1
            stop = max(j + 1, fits)
            cosines = stacked[ends[i] : ends[i + 1]] @ stacked[ends[j] : ends[stop]].T
            counts[i, j:stop] = _count(cosines, ends[j : stop + 1] - ends[j], ratio)
            j = stop
    return np.maximum(counts, counts.T)


@njit(cache=True, nogil=True)
def _distinct(best: float, second: float, ratio: float) -> bool:
    """Tell whether the angle of one cosine is below `ratio` times that of another."""
    return bool(np.arccos(min(max(best, -1.0), _SAME)) < ratio * np.arccos(min(max(second, -1.0), _SAME)))


@njit(cache=True, nogil=True)
def _count(cosines: NDArray[np.float32], ends: NDArray[np.int64], ratio: float) -> NDArray[np.int64]:
    """Count mutual matches of one shape's features, the rows, with each shape's, groups of columns."""
    n_rows = len(cosines)
    counts = np.zeros(len(ends) - 1, np.int64)
    choice = np.empty(n_rows, np.int64)
    lowest = np.float32(-1.0)
    for group in range(len(ends) - 1):
        low, n_columns = ends[group], ends[group + 1] - ends[group]
        # a lone feature has no rival: its second nearest counts as opposite
        top, runner = np.full(n_columns, lowest), np.full(n_columns, lowest)
        owner = np.full(n_columns, -1)
        for row in range(n_rows):
            best, second, place = lowest, lowest, -1
            for column in range(n_columns):
                value = cosines[row, low + column]
                if value > best:
                    best, second, place = value, best, column
                elif value > second:
                    second = value
                if value > top[column]:
                    top[column], runner[column], owner[column] = value, top[column], row
                elif value > runner[column]:
                    runner[column] = value
            choice[row] = place if place >= 0 and _distinct(best, second, ratio) else -1
        for row in range(n_rows):
            column = choice[row]
            if column >= 0 and owner[column] == row and _distinct(top[column], runner[column], ratio):
                counts[group] += 1
    return counts
