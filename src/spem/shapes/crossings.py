"""Where the lines of a grid cross a triangle surface: the scanline kernels behind mesh filling.

All positions are in grid units: voxel centres are the integer points. A line runs along one
`axis`; `axes_of` names the two others. The lines of one axis are numbered ``row * n_columns + column``.

A vertex or edge of the surface that meets a line is given to one side by one rule (half-open
intervals, the line counts as shifted by an infinitesimal amount toward higher indices), and the
place where an edge meets a row is computed from its lower to its upper end. Both triangles at an
edge so see the same number, bit for bit: over a closed surface the signs of every line sum to
zero, whatever the rounding.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray


@dataclass(frozen=True, eq=False)
class Crossings:
    """The crossings of all grid lines along one axis, sorted along each line.

    Parameters
    ----------
    axis
        The axis the lines run along.
    shape
        ``(3,)`` nodes of the grid along each axis.
    start
        ``(n_lines + 1,)`` first crossing of each line, as in compressed sparse rows.
    where
        ``(n_crossings,)`` position along the line in grid units.
    sign
        ``(n_crossings,)`` +1 where the line enters the surface, -1 where it leaves. Equal
        positions are sorted entering first: surfaces that touch leave no gap.
    """

    axis: int
    shape: tuple[int, int, int]
    start: NDArray[np.int64]
    where: NDArray[np.float64]
    sign: NDArray[np.int8]

    def __len__(self) -> int:
        return self.where.size

    @property
    def layout(self) -> tuple[int, int, int, int, int, int]:
        """Columns, rows and nodes of a line; flat-index steps along column, row and line."""
        column, row, _ = axes_of(self.axis)
        steps = (self.shape[1] * self.shape[2], self.shape[2], 1)
        extents = self.shape[column], self.shape[row], self.shape[self.axis]
        return *extents, steps[column], steps[row], steps[self.axis]


def axes_of(axis: int) -> tuple[int, int, int]:
    """Return the column axis and row axis of the lines along `axis`, and their handedness with it.

    The column axis is the one that varies fastest in memory.

    Examples
    --------
    >>> axes_of(0), axes_of(1), axes_of(2)
    ((2, 1, -1), (2, 0, 1), (1, 0, -1))
    """
    return ((2, 1, -1), (2, 0, 1), (1, 0, -1))[axis]


def cross_lines(
    points: NDArray[np.float64], faces: NDArray[np.int64], shape: tuple[int, int, int], axis: int
) -> Crossings:
    """Find where the lines along one axis cross the triangles.

    Parameters
    ----------
    points
        ``(n_vertices, 3)`` vertices in grid units.
    faces
        ``(n_faces, 3)`` vertex indices, counter-clockwise seen from outside.
    shape
        Nodes of the grid along each axis.
    axis
        Direction of the lines.

    Returns
    -------
    Crossings
        Sorted along each line.

    Examples
    --------
    >>> import numpy as np
    >>> corners = np.array([[0.5, 0.5, 0.5], [3.5, 0.5, 0.5], [0.5, 3.5, 0.5], [0.5, 0.5, 3.5]])
    >>> tetrahedron = np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])
    >>> crossings = cross_lines(corners, tetrahedron, (5, 5, 5), axis=0)
    >>> crossings.where[:2], crossings.sign[:2]
    (array([0.5, 2.5]), array([ 1, -1], dtype=int8))
    """
    column, row, handedness = axes_of(axis)
    order = np.array([column, row, axis])
    frame = shape[column], shape[row], handedness
    cursor = np.zeros(shape[column] * shape[row] + 1, np.int64)
    _scan(points, faces, order, frame, cursor, np.empty(0), np.empty(0, np.int8))
    start = np.cumsum(cursor)
    where, sign = np.empty(start[-1]), np.empty(start[-1], np.int8)
    if where.size:
        _scan(points, faces, order, frame, start.copy(), where, sign)
    _sort_lines(start, where, sign)
    return Crossings(axis, shape, start, where, sign)


@njit(cache=True, nogil=True)
def _meet_row(lower: NDArray[np.float64], upper: NDArray[np.float64], row: int) -> tuple[float, float]:
    """Return column and depth where an edge meets a row, always computed from its lower end."""
    fraction = (row - lower[1]) / (upper[1] - lower[1])
    return lower[0] + fraction * (upper[0] - lower[0]), lower[2] + fraction * (upper[2] - lower[2])


@njit(cache=True, nogil=True)
def _scan(
    points: NDArray[np.float64],
    faces: NDArray[np.int64],
    order: NDArray[np.int64],
    frame: tuple[int, int, int],
    cursor: NDArray[np.int64],
    where: NDArray[np.float64],
    sign: NDArray[np.int8],
) -> None:
    """Count the crossings of each line in ``cursor[line + 1]``; with room in `where`, store them."""
    n_columns, n_rows, handedness = frame
    corner = np.empty((3, 3))
    for f in range(faces.shape[0]):
        for i in range(3):
            for j in range(3):
                corner[i, j] = points[faces[f, i], order[j]]
        low, middle, high, turn = 0, 1, 2, -handedness
        if corner[low, 1] > corner[middle, 1]:
            low, middle, turn = middle, low, -turn
        if corner[middle, 1] > corner[high, 1]:
            middle, high, turn = high, middle, -turn
        if corner[low, 1] > corner[middle, 1]:
            low, middle, turn = middle, low, -turn
        last_row = min(int(np.ceil(corner[high, 1])), n_rows)
        for row in range(max(int(np.ceil(corner[low, 1])), 0), last_row):
            at, depth = _meet_row(corner[low], corner[high], row)
            short = (low, middle) if row < corner[middle, 1] else (middle, high)
            other, other_depth = _meet_row(corner[short[0]], corner[short[1]], row)
            # Where low, middle, high run with the face, its short side runs toward higher rows and
            # the long side back: seen along the axis it is counter-clockwise if the short side lies beyond.
            crossing = turn if other > at else -turn
            last = min(int(np.ceil(max(at, other))), n_columns)
            for column in range(max(int(np.ceil(min(at, other))), 0), last):
                line = row * n_columns + column
                if where.size == 0:
                    cursor[line + 1] += 1
                    continue
                where[cursor[line]] = depth + (column - at) / (other - at) * (other_depth - depth)
                sign[cursor[line]] = crossing
                cursor[line] += 1


@njit(cache=True, nogil=True)
def _sort_lines(start: NDArray[np.int64], where: NDArray[np.float64], sign: NDArray[np.int8]) -> None:
    """Sort the crossings of each line by position, entering first; lines hold few crossings."""
    for line in range(start.size - 1):
        for i in range(start[line] + 1, start[line + 1]):
            key, key_sign = where[i], sign[i]
            j = i - 1
            while j >= start[line] and (where[j] > key or (where[j] == key and sign[j] < key_sign)):
                where[j + 1], sign[j + 1] = where[j], sign[j]
                j -= 1
            where[j + 1], sign[j + 1] = key, key_sign
