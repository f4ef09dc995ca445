"""Cells of nearly equal area on a boundary: a power diagram grown along the surface."""

from __future__ import annotations

import heapq

import numpy as np
from numba import njit
from numpy.typing import NDArray

from spem.fields.boundary.points import point_graph
from spem.fields.boundary.sources import Sources

# Rounds in which cells move to their centroids, and all rounds.
_MOVES = 12
_ROUNDS = 28
# Share of the excess area that one round takes from a cell; half of it and more overshoots on thin limbs.
_STEP = 0.25
# Rounds stop when no cell is larger than this, in means; single points are given away above the next.
_EQUAL = 1.05
_TOLERATED = 1.1
_PASSES = 20
# Coordinates are rounded to this share of a voxel: ties on the grid are ties in any unit of length, anywhere.
_FINE = 4096


def equal_cells(single: Sources, shares: NDArray[np.int64], offsets: NDArray[np.int64]) -> NDArray[np.int64]:
    """Divide each connected piece of a boundary into cells of nearly equal area.

    A cell holds the points of least power distance, |x − c|² + w with its own centre c and weight w, among
    those that it can reach over the boundary. Centres move to centroids and weights even out the areas; what
    inequality the shape of limbs still leaves is mended point by point.

    Parameters
    ----------
    single
        Every boundary point as a source.
    shares
        ``(n_pieces,)`` number of cells of each piece, at least one and at most the number of its points.
    offsets
        ``(n_pieces,)`` which of the points of a piece is the first seed.

    Returns
    -------
    cell
        ``(n_points,)`` cell of each point; all connected, none empty, those of the first piece first.

    Examples
    --------
    >>> from spem.fields.operator import assemble
    >>> from spem.fields.boundary.sources import point_sources
    >>> from spem.shapes.synthetic import ball
    >>> points = point_sources(assemble(ball(1.0, 0.1)))
    >>> cell = equal_cells(points, np.array([6]), np.array([0]))
    >>> (np.bincount(cell, points.measure) / 4 / np.pi).round(2).tolist()
    [0.17, 0.17, 0.17, 0.17, 0.17, 0.17]
    """
    points = single.points
    (position, measure), contour = _in_voxels(single), points.contour
    graph = point_graph(single.system, points.edge_point)
    members = np.split(np.argsort(contour, kind="stable"), np.cumsum(np.bincount(contour))[:-1])
    start = np.concatenate(
        [
            piece[_farthest(position[piece], share, offset)]
            for piece, share, offset in zip(members, shares, offsets, strict=True)
        ]
    )
    wanted = np.repeat(np.bincount(contour, measure) / shares, shares)
    # a cell of a surface of D dimensions grows by about its area^((D-2)/D) for each unit of weight
    dimension = max(position.shape[1] - 1, 1)
    step = _STEP * wanted ** ((2 - dimension) / dimension)
    centre, weight, best, least = position[start], np.zeros(start.size), np.empty(0, np.int64), np.inf
    for turn in range(_ROUNDS):
        cell = _grow(graph.indptr, graph.indices, position, centre, weight, start)
        area = np.bincount(cell, measure)
        if turn >= _MOVES - 1 and (worst := float((area / wanted).max())) < least:
            best, least = cell, worst
        if least < _EQUAL:
            break
        weight = weight + step * (area - wanted) * min(1.0, _MOVES / (turn + 1))
        if turn < _MOVES - 1:
            centre, start = _centroids(cell, position, measure)
    _even(graph.indptr, graph.indices, best, measure, wanted, np.bincount(best, measure))
    return best


def _in_voxels(single: Sources) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Positions on the grid and areas of the points, in units of the smallest spacing."""
    shape, points = single.system.shape, single.points
    unit = min(shape.spacing)
    position = (points.position - np.asarray(shape.origin)) / unit
    measure = points.measure / unit ** (shape.ndim - 1)
    return np.rint(position * _FINE) / _FINE, np.rint(measure * _FINE) / _FINE


def _centroids(
    cell: NDArray[np.int64], position: NDArray[np.float64], measure: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Centroid of each cell, and its point nearest to that."""
    area = np.bincount(cell, measure)
    centre = np.stack([np.bincount(cell, measure * x) / area for x in position.T], axis=1)
    order = np.lexsort((np.square(position - centre[cell]).sum(axis=1), cell))
    return centre, order[np.searchsorted(cell[order], np.arange(area.size))]


@njit(cache=True, nogil=True)
def _farthest(position: NDArray[np.float64], count: int, first: int) -> NDArray[np.int64]:
    """Points chosen one after another, each as far as can be from those before."""
    n, d = position.shape
    seeds = np.empty(count, np.int64)
    nearest = np.full(n, np.inf)
    for i in range(count):
        seeds[i] = first
        taken, farthest = first, -2.0
        for p in range(n):
            square = 0.0
            for a in range(d):
                square += (position[p, a] - position[taken, a]) ** 2
            nearest[p] = min(nearest[p], square) if p != taken else -1.0
            if nearest[p] > farthest:
                farthest, first = nearest[p], p
    return seeds


@njit(cache=True, nogil=True)
def _grow(
    indptr: NDArray[np.int32],
    indices: NDArray[np.int32],
    position: NDArray[np.float64],
    centre: NDArray[np.float64],
    weight: NDArray[np.float64],
    start: NDArray[np.int64],
) -> NDArray[np.int64]:
    """Grow cells from their seeds over the graph, points of least power distance first."""
    n, d = position.shape
    cell, least = np.full(n, -1, np.int64), np.full(n, np.inf)
    queue = [(-np.inf, start[i], np.int64(i)) for i in range(start.size)]
    # all seeds come first, so every cell has its own
    heapq.heapify(queue)
    while len(queue) > 0:
        _, p, i = heapq.heappop(queue)
        if cell[p] >= 0:
            continue
        cell[p] = i
        for e in range(indptr[p], indptr[p + 1]):
            q = np.int64(indices[e])
            if cell[q] >= 0:
                continue
            power = weight[i]
            for a in range(d):
                power += (position[q, a] - centre[i, a]) ** 2
            if power < least[q]:
                least[q] = power
                heapq.heappush(queue, (power, q, i))
    return cell


@njit(cache=True, nogil=True)
def _even(
    indptr: NDArray[np.int32],
    indices: NDArray[np.int32],
    cell: NDArray[np.int64],
    measure: NDArray[np.float64],
    wanted: NDArray[np.float64],
    area: NDArray[np.float64],
) -> None:
    """Give single points of cells that are too large, or beside one too small, away; all stay connected."""
    n = cell.size
    seen, queue = np.zeros(n, np.int64), np.empty(n, np.int64)
    stamp = 0
    for _ in range(_PASSES):
        moved = False
        for p in range(n):
            i, taker = cell[p], np.int64(-1)
            for e in range(indptr[p], indptr[p + 1]):
                j = cell[indices[e]]
                uneven = area[i] > _TOLERATED * wanted[i] or area[j] < wanted[j] / _TOLERATED
                if (
                    j != i
                    and uneven
                    and area[j] + measure[p] < area[i]
                    and (taker < 0 or area[j] < area[taker])
                ):
                    taker = j
            if taker < 0:
                continue
            stamp += 1
            if _holds(indptr, indices, cell, p, seen, stamp, queue):
                cell[p] = taker
                area[i] -= measure[p]
                area[taker] += measure[p]
                moved = True
        if not moved:
            break


@njit(cache=True, nogil=True)
def _holds(
    indptr: NDArray[np.int32],
    indices: NDArray[np.int32],
    cell: NDArray[np.int64],
    p: int,
    seen: NDArray[np.int64],
    stamp: int,
    queue: NDArray[np.int64],
) -> bool:
    """Tell whether a point's cell stays connected, and has points, without it."""
    wanted, tail = 0, 0
    for e in range(indptr[p], indptr[p + 1]):
        if cell[indices[e]] == cell[p]:
            wanted += 1
            if tail == 0:
                queue[0] = indices[e]
                tail = 1
    if wanted == 0:
        return False
    seen[p] = seen[queue[0]] = stamp
    head, found = 0, 1
    while head < tail and found < wanted:
        q = queue[head]
        head += 1
        for e in range(indptr[q], indptr[q + 1]):
            r = indices[e]
            if cell[r] != cell[p] or seen[r] == stamp:
                continue
            seen[r] = stamp
            queue[tail] = r
            tail += 1
            for f in range(indptr[p], indptr[p + 1]):
                if indices[f] == r:
                    found += 1
    return found == wanted
