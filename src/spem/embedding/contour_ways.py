"""Shortest ways between the points of contours that stay inside the shape, by the graph of what each sees."""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from spem.embedding.contours import ContourPoints

Array = NDArray[np.float64]
# Corners that stick out by a smaller angle are straight to rounding.
_STRAIGHT = 1e-9


def contour_ways(points: ContourPoints) -> tuple[Array, NDArray[np.int32]]:
    """Find the shortest ways between points of contours inside the polygon that they make.

    A shortest way in a polygon, with holes or without, is straight from corner to corner; so the graph of the
    corners that see each other holds it, and distances are exact.

    Parameters
    ----------
    points
        The corners of the polygon.

    Returns
    -------
    distance
        ``(n_points, n_points)`` lengths, symmetric; infinite between parts that do not hang together.
    first
        ``(n_points, n_points)`` where the way from point i to point j goes first; j itself where i sees j.

    Examples
    --------
    >>> from spem.embedding.contours import contour_points
    >>> from spem.shapes.synthetic import disk
    >>> points = contour_points(disk(1.0, 0.02), 40)
    >>> distance, _ = contour_ways(points)
    >>> round(float(distance[0, 20]), 1)
    2.0
    """
    length, first = _sight(points.position, points.onward)
    _shorten(length, first, _bends(points))
    return length, first


def _bends(points: ContourPoints) -> NDArray[np.int64]:
    """Return the numbers of the corners that a way may bend at or pass: all but those that stick out."""
    after = points.position[points.onward] - points.position
    before = np.empty_like(after)
    before[points.onward] = after
    turn = before[:, 0] * after[:, 1] - before[:, 1] * after[:, 0]
    size = np.linalg.norm(before, axis=1) * np.linalg.norm(after, axis=1)
    return np.flatnonzero(turn <= _STRAIGHT * size)


@njit(cache=True, nogil=True)
def _turn(ax: float, ay: float, bx: float, by: float) -> float:
    """Return the cross product: positive where b is to the left of a."""
    return ax * by - ay * bx


@njit(cache=True, nogil=True)
def _opens(p: Array, at: int, after: int, before: int, to: int) -> bool:
    """Tell whether the way from a corner to another point starts into the shape."""
    ax, ay = p[after, 0] - p[at, 0], p[after, 1] - p[at, 1]
    bx, by = p[before, 0] - p[at, 0], p[before, 1] - p[at, 1]
    dx, dy = p[to, 0] - p[at, 0], p[to, 1] - p[at, 1]
    left, right = _turn(ax, ay, dx, dy), _turn(dx, dy, bx, by)
    if _turn(ax, ay, bx, by) > 0:
        return bool(left >= 0 and right >= 0)
    return bool(left >= 0 or right >= 0)


@njit(cache=True, nogil=True)
def _meets(p: Array, i: int, j: int, k: int, m: int) -> bool:
    """Tell whether the segments i j and k m have a point in common."""
    for a in range(2):
        if min(p[i, a], p[j, a]) > max(p[k, a], p[m, a]) or min(p[k, a], p[m, a]) > max(p[i, a], p[j, a]):
            return False
    dx, dy = p[j, 0] - p[i, 0], p[j, 1] - p[i, 1]
    one = _turn(dx, dy, p[k, 0] - p[i, 0], p[k, 1] - p[i, 1])
    two = _turn(dx, dy, p[m, 0] - p[i, 0], p[m, 1] - p[i, 1])
    if (one > 0 and two > 0) or (one < 0 and two < 0):
        return False
    ex, ey = p[m, 0] - p[k, 0], p[m, 1] - p[k, 1]
    three = _turn(ex, ey, p[i, 0] - p[k, 0], p[i, 1] - p[k, 1])
    four = _turn(ex, ey, p[j, 0] - p[k, 0], p[j, 1] - p[k, 1])
    return not ((three > 0 and four > 0) or (three < 0 and four < 0))


@njit(cache=True, nogil=True)
def _sight(p: Array, onward: NDArray[np.int32]) -> tuple[Array, NDArray[np.int32]]:
    """Return the lengths of sides and of ways free of any side, infinite for others, and where they go.

    A way that meets another corner counts as blocked: over that corner there is one of the same length.
    """
    n = len(p)
    before = np.empty(n, np.int32)
    for i in range(n):
        before[onward[i]] = i
    length, first = np.full((n, n), np.inf), np.full((n, n), -1, np.int32)
    for i in range(n):
        length[i, i], first[i, i] = 0.0, i
        for j in range(i):
            free = onward[i] == j or onward[j] == i
            if not free and _opens(p, i, onward[i], before[i], j) and _opens(p, j, onward[j], before[j], i):
                free = True
                for k in range(n):
                    m = onward[k]
                    if k != i and k != j and m != i and m != j and _meets(p, i, j, k, m):
                        free = False
                        break
            if free:
                length[i, j] = length[j, i] = np.hypot(p[i, 0] - p[j, 0], p[i, 1] - p[j, 1])
                first[i, j], first[j, i] = j, i
    return length, first


@njit(cache=True, nogil=True)
def _shorten(length: Array, first: NDArray[np.int32], bends: NDArray[np.int64]) -> None:
    """Shorten ways over each bend in turn (Floyd and Warshall), in place."""
    n = len(length)
    for k in bends:
        for i in range(n):
            start = length[i, k]
            if i == k or start == np.inf:
                continue
            for j in range(n):
                if start + length[k, j] < length[i, j]:
                    length[i, j] = start + length[k, j]
                    first[i, j] = first[i, k]
