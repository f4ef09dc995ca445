"""Fill a closed triangle surface on a grid, exactly, and keep where it cuts the grid's edges.

Inside is where the winding number is positive, summed along grid lines from signed crossings:
overlapping parts are a union, a shell turned the other way inside another is a hollow. The same
crossings, along all three axes, say where each edge between neighbouring voxel centres is cut.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray

from spem.shapes.crossings import Crossings, cross_lines
from spem.shapes.shape import MIN_FRACTION, Cuts

# The lines that decide the mask: those that are contiguous in memory.
FILL_AXIS = 2
# Keeps the size of an absurdly fine lattice a number that can be reported.
MOST_NODES = 2.0**50


@dataclass(frozen=True)
class Lattice:
    """A regular grid in space, with one layer outside the surface it was made for.

    Parameters
    ----------
    origin
        Coordinates of node (0, 0, 0).
    spacing
        Distance between nodes along each axis.
    shape
        Nodes along each axis.
    """

    origin: tuple[float, float, float]
    spacing: tuple[float, float, float]
    shape: tuple[int, int, int]

    def grid_units(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return points in coordinates in which the nodes are the integer points."""
        return np.asarray((points - np.array(self.origin)) / np.array(self.spacing))

    def positions(self, nodes: NDArray[np.int64]) -> NDArray[np.float64]:
        """Return the coordinates of nodes given by flat index."""
        index = np.stack(np.unravel_index(nodes, self.shape), axis=-1)
        return np.asarray(np.array(self.origin) + index * np.array(self.spacing))


@dataclass(frozen=True, eq=False)
class Filling:
    """A surface filled on a lattice.

    Parameters
    ----------
    mask
        ``(n_0, n_1, n_2)`` the nodes inside.
    cuts
        Where the surface cuts the edges between nodes.
    n_reversed
        Nodes in parts of space that the surface winds around backwards; they count as outside.
    """

    mask: NDArray[np.bool_]
    cuts: Cuts
    n_reversed: int = 0


def lattice_around(vertices: NDArray[np.float64], spacing: tuple[float, float, float]) -> Lattice:
    """Centre a grid on the bounding box of a surface.

    The outermost nodes within the box lie between a quarter and three quarters of a spacing from
    its sides, so faces of aligned boxes never pass through nodes, and a symmetric surface gets a
    symmetric grid.

    Parameters
    ----------
    vertices
        ``(n_vertices, 3)`` coordinates.
    spacing
        Spacing along each axis.

    Returns
    -------
    Lattice
        With one layer of nodes outside the box on each side. Nothing is allocated.

    Examples
    --------
    >>> import numpy as np
    >>> lattice_around(np.array([[0.0, 0.0, 0.0], [2.0, 1.0, 3.0]]), (1.0, 1.0, 1.0))
    Lattice(origin=(-0.5, -0.5, -0.5), spacing=(1.0, 1.0, 1.0), shape=(4, 3, 5))
    """
    low, high = vertices.min(axis=0), vertices.max(axis=0)
    origin, shape = [], []
    for start, stop, step in zip(low.tolist(), high.tolist(), spacing, strict=True):
        count = max(round(min((stop - start) / step, MOST_NODES)), 1)
        origin.append((start + stop) / 2 - step * (count + 1) / 2)
        shape.append(count + 2)
    return Lattice((origin[0], origin[1], origin[2]), spacing, (shape[0], shape[1], shape[2]))


def voxelize(vertices: NDArray[np.float64], faces: NDArray[np.int64], lattice: Lattice) -> Filling:
    """Fill a closed surface by scanlines.

    Parameters
    ----------
    vertices
        ``(n_vertices, 3)`` coordinates.
    faces
        ``(n_faces, 3)`` vertex indices, counter-clockwise seen from outside. Every edge is used
        as often in one direction as in the other.
    lattice
        The grid, with at least one layer outside the surface.

    Returns
    -------
    Filling
        With the cut of every edge that leaves the shape or that two surfaces pass through.

    Examples
    --------
    >>> import numpy as np
    >>> corners = np.array([[0.0, 0, 0], [3, 0, 0], [0, 3, 0], [0, 0, 3]])
    >>> tetrahedron = np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])
    >>> filling = voxelize(corners, tetrahedron, lattice_around(corners, (1.0, 1.0, 1.0)))
    >>> int(filling.mask.sum()), len(filling.cuts)
    (4, 18)
    """
    points = lattice.grid_units(vertices)
    crossings = [cross_lines(points, faces, lattice.shape, axis) for axis in range(3)]
    winding, _ = winding_range(crossings[FILL_AXIS : FILL_AXIS + 1])
    mask = winding > 0
    return Filling(mask, cut_edges(mask, crossings), int(np.count_nonzero(winding < 0)))


def winding_range(crossings: list[Crossings]) -> tuple[NDArray[np.int16], NDArray[np.int16]]:
    """Return the least and the greatest winding number at each node, seen from both ends of its lines.

    For a closed surface the two are equal, and equal for all axes up to rounding.
    """
    shape = crossings[0].shape
    low = np.full(shape, np.iinfo(np.int16).max, np.int16)
    high = np.full(shape, np.iinfo(np.int16).min, np.int16)
    for lines in crossings:
        _wind(lines.layout, lines.start, lines.where, lines.sign, low.reshape(-1), high.reshape(-1))
    return low, high


def cut_edges(
    mask: NDArray[np.bool_], crossings: list[Crossings], winding: NDArray[np.float64] | None = None
) -> Cuts:
    """Find where the surface cuts the grid's edges.

    Parameters
    ----------
    mask
        ``(n_0, n_1, n_2)`` the nodes inside.
    crossings
        The crossings along each axis.
    winding
        ``(n_0, n_1, n_2)`` generalised winding number at the nodes, of which `mask` is the part
        above one half; None for a closed surface, where the crossings alone tell it.

    Returns
    -------
    Cuts
        For each edge with a change of side in it: from its inside end(s) to the first change.
    """
    values = np.empty(0) if winding is None else winding.reshape(-1)
    parts = []
    for lines in crossings:
        occupied = mask.any(axis=lines.axis).reshape(-1)
        arguments = (lines.layout, lines.start, lines.where, lines.sign, occupied, mask.reshape(-1), values)
        nowhere = np.empty(0, np.int64), np.empty(0, np.uint8), np.empty(0)
        count = _cut(*arguments, lines.axis, *nowhere)
        found = np.empty(count, np.int64), np.empty(count, np.uint8), np.empty(count)
        if count:
            _cut(*arguments, lines.axis, *found)
        parts.append(found)
    voxel, direction, fraction = (np.concatenate(columns) for columns in zip(*parts, strict=True))
    return Cuts(voxel, direction, np.clip(fraction, MIN_FRACTION, 1.0))


@njit(cache=True, nogil=True)
def _wind(
    layout: tuple[int, int, int, int, int, int],
    start: NDArray[np.int64],
    where: NDArray[np.float64],
    sign: NDArray[np.int8],
    low: NDArray[np.int16],
    high: NDArray[np.int16],
) -> None:
    """Narrow the range of winding numbers at each node by those seen from both ends of its line."""
    n_columns, n_rows, n_nodes, column_step, row_step, step = layout
    for line in range(n_rows * n_columns):
        node = line // n_columns * row_step + line % n_columns * column_step
        total = 0
        for k in range(start[line], start[line + 1]):
            total += sign[k]
        winding, k = 0, start[line]
        for i in range(n_nodes):
            while k < start[line + 1] and where[k] <= i:
                winding += sign[k]
                k += 1
            low[node] = min(low[node], winding, winding - total)
            high[node] = max(high[node], winding, winding - total)
            node += step


@njit(cache=True, nogil=True)
def _changes(
    i: int,
    ends: tuple[float, float],
    sides: tuple[bool, bool],
    where: NDArray[np.float64],
    sign: NDArray[np.int8],
) -> tuple[float, float]:
    """Return the first and the last change of side on the edge from node i, or (2, -1) without one.

    The winding number jumps at crossings and drifts linearly between, so as to meet both ends.
    Where it contradicts the side an end was given, the surface passes through that end.
    """
    winding, last_winding = ends
    drift = last_winding - winding
    for k in range(where.size):
        drift -= sign[k]
    first, last, at = 2.0, -1.0, 0.0
    if (winding > 0.5) != sides[0]:
        first, last = 0.0, 0.0
    for k in range(where.size + 1):
        until = where[k] - i if k < where.size else 1.0
        drifted = winding + drift * (until - at)
        if (drifted > 0.5) != (winding > 0.5):
            last = at + (0.5 - winding) / drift
            first = min(first, last)
        winding, at = drifted, until
        if k < where.size:
            winding += sign[k]
            if (winding > 0.5) != (drifted > 0.5):
                last = at
                first = min(first, last)
    if (winding > 0.5) != sides[1]:
        first, last = min(first, 1.0), 1.0
    return first, last


@njit(cache=True, nogil=True)
def _cut(
    layout: tuple[int, int, int, int, int, int],
    start: NDArray[np.int64],
    where: NDArray[np.float64],
    sign: NDArray[np.int8],
    occupied: NDArray[np.bool_],
    mask: NDArray[np.bool_],
    values: NDArray[np.float64],
    axis: int,
    voxel: NDArray[np.int64],
    direction: NDArray[np.uint8],
    fraction: NDArray[np.float64],
) -> int:
    """Return how many cuts there are along one axis; with room in `voxel`, store them."""
    n_columns, n_rows, n_nodes, column_step, row_step, step = layout
    count = 0
    for line in range(n_rows * n_columns):
        if not occupied[line]:
            continue
        node = line // n_columns * row_step + line % n_columns * column_step
        winding, k = 0, start[line]
        while k < start[line + 1] and where[k] <= 0:
            winding += sign[k]
            k += 1
        for i in range(n_nodes - 1):
            begin, before = k, winding
            while k < start[line + 1] and where[k] <= i + 1:
                winding += sign[k]
                k += 1
            sides = mask[node], mask[node + step]
            if (sides[0] or sides[1]) and (k > begin or sides[0] != sides[1] or (before > 0) != sides[0]):
                ends = float(before), float(winding)
                if values.size:
                    ends = values[node], values[node + step]
                first, last = _changes(i, ends, sides, where[begin:k], sign[begin:k])
                for end in range(2):
                    if sides[end] and last >= 0:
                        if voxel.size:
                            voxel[count] = node + end * step
                            direction[count] = 2 * axis + 1 - end
                            fraction[count] = 1 - last if end else first
                        count += 1
            node += step
    return count
