"""The boundary divided into connected patches of nearly equal area, each one source (5.1)."""

from __future__ import annotations

import heapq
from dataclasses import replace
from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

from spem.errors import ParameterError
from spem.fields.boundary_points import point_graph
from spem.fields.operator import System
from spem.fields.sources import Sources, point_sources

# Rounds in which cells move to their centroids, and all rounds.
_MOVES = 12
_ROUNDS = 40
# Share of the excess area that one round takes from a cell; half of it and more overshoots on thin limbs.
_STEP = 0.25
# Rounds stop when no cell is larger than this, in means; single points are given away above the next.
_EQUAL = 1.03
_TOLERATED = 1.1
_PASSES = 20


def patch_sources(system: System, count: int, rng: np.random.Generator | None = None) -> Sources:
    """Divide the boundary of a system into patches of nearly equal area, each one source (5.1).

    In 2-D a patch is an arc of a contour. On surfaces patches are the cells of a power diagram, grown over
    the surface from their seeds, so that none jumps through space from one limb to another; seeds move to
    the centroids of their cells, and weights make the areas equal. Each connected piece of boundary has
    patches of its own. Where pieces are larger than a patch and a patch has ten points or more, the largest
    is at most 1.3 times the mean.

    Parameters
    ----------
    system
        The system whose boundary is divided.
    count
        Number of patches: at least one for each connected piece, at most the number of boundary points.
    rng
        Draws where the first seed of each piece lies, or the first arc of a contour begins: by default at
        its first point.

    Returns
    -------
    patches
        Every boundary point is in one of them; numbered by their first point.

    Raises
    ------
    ParameterError
        When there are fewer points, or more connected pieces of boundary, than patches.

    Examples
    --------
    >>> from spem.fields.operator import assemble
    >>> from spem.shapes.synthetic import ball
    >>> patches = patch_sources(assemble(ball(1.0, 0.1)), 20)
    >>> bool(patches.measure.max() / patches.measure.mean() < 1.1)
    True
    """
    single = point_sources(system)
    contour, measure = single.points.contour, single.points.measure
    _check_count(count, single)
    area = np.bincount(contour, measure).astype(np.float64)
    shares = _apportion(area, np.bincount(contour), int(count))
    offsets = np.zeros(shares.size, np.int64) if rng is None else rng.integers(np.bincount(contour))
    group = _arcs(single, shares, offsets) if system.shape.ndim == 2 else _cells(single, shares, offsets)
    _, first, inverse = np.unique(group, return_index=True, return_inverse=True)
    return replace(single, group=np.argsort(np.argsort(first)).astype(np.int32)[inverse])


def _check_count(count: Any, single: Sources) -> None:
    """Refuse a number of patches that the boundary does not have."""
    name, n, pieces = single.system.shape.name, single.points.n_points, single.points.n_contours
    if isinstance(count, bool) or not isinstance(count, int | np.integer) or count < 1:
        msg = f"{name}: the number of patches must be a whole number from {pieces} to {n}, got {count!r}"
        raise ParameterError(msg)
    if count > n:
        msg = f"{name}: the boundary has {n} points, too few for {count} patches; ask for at most {n}"
        raise ParameterError(msg)
    if count < pieces:
        msg = (
            f"{name}: the boundary has {pieces} separate pieces, too many for {count} patches; ask for at "
            f"least {pieces}"
        )
        raise ParameterError(msg)


def _apportion(area: NDArray[np.float64], points: NDArray[np.int64], count: int) -> NDArray[np.int64]:
    """Share patches out to pieces: one each, then to that whose patches are largest, while it has points."""
    shares = np.ones(area.size, np.int64)
    queue = [(-a, piece) for piece, a in enumerate(area.tolist()) if points[piece] > 1]
    heapq.heapify(queue)
    for _ in range(count - area.size):
        piece = queue[0][1]
        shares[piece] += 1
        if shares[piece] < points[piece]:
            heapq.heapreplace(queue, (-float(area[piece]) / int(shares[piece]), piece))
        else:
            heapq.heappop(queue)
    return shares


def _arcs(single: Sources, shares: NDArray[np.int64], offsets: NDArray[np.int64]) -> NDArray[np.int64]:
    """Cut each contour, from its offset on, into arcs of nearly equal length."""
    contour, measure = single.points.contour, single.points.measure
    group = np.empty(contour.size, np.int64)
    before = 0
    for piece, (share, offset) in enumerate(zip(shares.tolist(), offsets, strict=True)):
        along = np.roll(np.flatnonzero(contour == piece), -offset)
        length = np.cumsum(measure[along])
        ends = length[-1] / share * np.arange(1, share)
        cuts = np.searchsorted(length - measure[along] / 2, ends)
        # no arc is empty
        rank = np.arange(1, share)
        cuts = np.maximum.accumulate(np.maximum(cuts, rank) - rank) + rank
        cuts = np.minimum(cuts, along.size - share + rank)
        group[along] = before + np.searchsorted(cuts, np.arange(along.size), side="right")
        before += share
    return group


def _cells(single: Sources, shares: NDArray[np.int64], offsets: NDArray[np.int64]) -> NDArray[np.int64]:
    """Divide each piece of a surface into cells of a power diagram of nearly equal area."""
    points = single.points
    position, measure, contour = points.position, points.measure, points.contour
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
