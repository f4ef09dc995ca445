"""Distances between codes, and their fusion."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from spem.codes.joining import standardised
from spem.errors import ParameterError


def correlation_distance(queries: ArrayLike, codes: ArrayLike) -> NDArray[np.float64]:
    """Return one minus the Pearson correlation of every query with every code (section 5.5).

    A constant vector correlates with nothing: its distance to any other vector is 1. When both
    arguments are the same object the result is exactly symmetric with a zero diagonal.

    Parameters
    ----------
    queries
        ``(n_q, m)`` vectors.
    codes
        ``(n, m)`` vectors.

    Returns
    -------
    numpy.ndarray
        ``(n_q, n)`` distances in [0, 2].

    Raises
    ------
    ParameterError
        If the vectors differ in length or hold values that are not finite.

    Examples
    --------
    >>> correlation_distance([[1.0, 2.0, 3.0]], [[2.0, 4.0, 6.0], [3.0, 2.0, 1.0], [1.0, 1.0, 1.0]]).round(12)
    array([[0., 2., 1.]])
    """
    same = queries is codes
    left = _standardised(queries, "queries")
    right = left if same else _standardised(codes, "codes")
    if left.shape[1] != right.shape[1]:
        msg = f"queries have {left.shape[1]} entries and codes {right.shape[1]}; make both with one model"
        raise ParameterError(msg)
    distance = np.clip(1.0 - left @ right.T, 0.0, 2.0)
    if same:
        distance = 0.5 * (distance + distance.T)
        np.fill_diagonal(distance, 0.0)
    return distance


def min_max(distances: ArrayLike) -> NDArray[np.float64]:
    """Return distances shifted and scaled to the range [0, 1]; all zeros where they are all equal.

    Parameters
    ----------
    distances
        Array of any shape, normalised as a whole.

    Raises
    ------
    ParameterError
        If the array is empty or holds values that are not finite.

    Examples
    --------
    >>> min_max([[0.0, 2.0], [2.0, 4.0]]).tolist()
    [[0.0, 0.5], [0.5, 1.0]]
    """
    values = np.asarray(distances, float)
    if not values.size or not np.isfinite(values).all():
        msg = f"distances of shape {values.shape} must be finite, at least one"
        raise ParameterError(msg)
    low, high = values.min(), values.max()
    return np.asarray((values - low) / (high - low)) if high > low else np.zeros_like(values)


def fuse(*distances: ArrayLike) -> NDArray[np.float64]:
    """Return the sum of min-max normalised distance matrices (section 5.5).

    Parameters
    ----------
    *distances
        Matrices of one shape, one from each method, each an argument of its own.

    Raises
    ------
    ParameterError
        If there is none, one is no matrix or not finite, or their shapes differ.

    Examples
    --------
    >>> fuse([[0.0, 1.0], [1.0, 0.0]], [[0.0, 8.0], [8.0, 0.0]]).tolist()
    [[0.0, 2.0], [2.0, 0.0]]
    """
    matrices = [np.asarray(d, float) for d in distances]
    shapes = sorted({m.shape for m in matrices})
    if len(shapes) != 1 or len(shapes[0]) != 2:
        found = ", ".join(map(str, shapes)) or "none"
        msg = f"fusion needs one or more matrices of one shape, not {found}; give each by itself: fuse(a, b)"
        raise ParameterError(msg)
    return np.asarray(np.sum([min_max(m) for m in matrices], axis=0))


def rank_others(distances: NDArray[np.float64]) -> NDArray[np.int64]:
    """Rank all other shapes for each shape as a query, nearest first.

    Parameters
    ----------
    distances
        ``(n, n)`` distances, queries along the rows; the diagonal is not looked at.

    Returns
    -------
    numpy.ndarray
        ``(n, n - 1)`` indices; of equal distances the first index first.

    Examples
    --------
    >>> rank_others(np.array([[0.0, 3.0, 1.0], [3.0, 0.0, 3.0], [1.0, 3.0, 0.0]])).tolist()
    [[2, 1], [0, 2], [0, 1]]
    """
    n = len(distances)
    order = np.argsort(distances, axis=1, kind="stable")
    return np.asarray(order[order != np.arange(n)[:, None]].reshape(n, n - 1))


def _standardised(vectors: ArrayLike, what: str) -> NDArray[np.float64]:
    """Return vectors centred and of unit length; constant ones become zero."""
    x = np.asarray(vectors, float)
    if x.ndim != 2:
        msg = f"{what} must be an array of shape (n, m), not of shape {x.shape}"
        raise ParameterError(msg)
    bad = np.flatnonzero(~np.isfinite(x).all(axis=1))
    if bad.size:
        msg = f"{what}: row {bad[0]} holds values that are not finite"
        raise ParameterError(msg)
    return standardised(x)
