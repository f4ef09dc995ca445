"""One streamline step by step: kernels of `spem.fields.streamlines`.

A point is given by the node whose part of space it lies in and its offset from there, in edges. Along an axis
that part reaches half an uncut edge, or a cut edge as far as the cut.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

# Why a line ends.
BOUNDARY, STAGNATION, LENGTH, SOURCE = range(4)
# A line that in this many steps gets no farther than this many turns about a point.
_WINDOW, _PROGRESS = 8, 2.0
# After so many detours by single edges a line goes on by edges alone, which always leads up.
_CLIMBS = 32
# Interpolated unit vectors shorter than this point every way: there is no direction.
_LEAST = 1e-3
# Offsets stop short of the next node, so that the node itself always has some weight.
_MOST = 1 - 1e-9
# A point this near a cut, in edges, is on the boundary.
_TOUCH = 1e-9


@njit(cache=True, nogil=True)
def follow(
    node: int,
    index: NDArray[np.float64],
    unit: NDArray[np.float64],
    domain: Any,
    height: NDArray[np.float64],
    step: NDArray[np.float64],
    most: int,
) -> tuple[NDArray[np.float64], int]:
    """Points of one line in grid indices, and why it ends; positions are offsets from the nearest node."""
    line = np.empty((most, step.size))
    line[0] = index[node]
    offset, after, way = np.zeros(step.size), np.zeros(step.size), np.zeros(step.size)
    n_points, climbs = 1, 0
    while height[node] < np.inf and n_points < most:
        end = STAGNATION
        if climbs < _CLIMBS and _runge_kutta(node, offset, unit, domain, step, way):
            after[:] = offset + step * way
            here = node
            node = _settle(node, after, domain[0])
            offset += index[here] - index[node]
            share = _inside_share(node, offset, after, domain)
            line[n_points] = index[node] + offset + min(share, 1.0) * (after - offset)
            n_points += 1
            offset[:] = after
            back = n_points - 1 - _WINDOW
            turns = back >= 0 and np.square((line[n_points - 1] - line[back]) / step).sum() < _PROGRESS**2
            if height[node] == np.inf or (share > 1 and not turns):
                continue
            if share <= 1:
                end = BOUNDARY
            else:
                n_points = back + 1
        higher = _highest(node, height, domain[0])
        if higher < 0:
            return line[:n_points].copy(), end
        node = higher
        offset[:] = 0
        climbs += 1
        n_points = _walk(line, n_points - (end == BOUNDARY), index[node], step)
    return line[:n_points].copy(), SOURCE if height[node] == np.inf else LENGTH


@njit(cache=True, nogil=True)
def _highest(node: int, height: NDArray[np.float64], neighbours: NDArray[np.int32]) -> int:
    """Neighbour by an uncut edge that lies highest above a node, -1 if none does."""
    best, top = -1, height[node]
    for j in neighbours[node]:
        if j < height.size and height[j] > top:
            best, top = j, height[j]
    return best


@njit(cache=True, nogil=True)
def _walk(
    line: NDArray[np.float64], n_points: int, to: NDArray[np.float64], step: NDArray[np.float64]
) -> int:
    """Append points on the straight way to a place, as long as there is room; return their number."""
    start = line[n_points - 1].copy()
    count = int(np.ceil(np.sqrt(np.square((to - start) / step).sum())))
    for k in range(1, min(count, line.shape[0] - n_points) + 1):
        line[n_points] = start + (to - start) * (k / count)
        n_points += 1
    return n_points


@njit(cache=True, nogil=True)
def _runge_kutta(
    node: int,
    offset: NDArray[np.float64],
    unit: NDArray[np.float64],
    domain: Any,
    step: NDArray[np.float64],
    way: NDArray[np.float64],
) -> bool:
    """Find the unit vector of a step of fourth order; beyond the boundary the stage before holds."""
    if not _mean_direction(node, offset, unit, domain[0], way):
        return False
    slope, mean, trial = way.copy(), way.copy(), np.empty(offset.size)
    for stage in range(1, 4):
        trial[:] = offset + (1.0 if stage == 3 else 0.5) * step * slope
        there = _settle(node, trial, domain[0])
        if _inside_share(there, trial, trial, domain) > 1:
            _mean_direction(there, trial, unit, domain[0], slope)
        mean += (1.0 if stage == 3 else 2.0) * slope
    length = np.sqrt(np.square(mean).sum())
    # Stages that point apart say that the field turns within a step: the first one holds.
    if length > 3:
        way[:] = mean / length
    return True


@njit(cache=True, nogil=True)
def _settle(node: int, offset: NDArray[np.float64], neighbours: NDArray[np.int32]) -> int:
    """Walk by uncut edges to the node whose part of space holds a point; the offset becomes that from it."""
    n, d = neighbours.shape[0], offset.size
    walking = True
    while walking:
        walking = False
        for axis in range(d):
            if abs(offset[axis]) > 0.5:
                side = 1 if offset[axis] > 0 else 0
                j = neighbours[node, 2 * axis + side]
                if j < n:
                    offset[axis] -= 2 * side - 1
                    node, walking = j, True
    return node


@njit(cache=True, nogil=True)
def _inside_share(node: int, before: NDArray[np.float64], after: NDArray[np.float64], domain: Any) -> float:
    """Part of the way between two offsets from a node that lies before a cut; 2 if the way meets none."""
    neighbours, first_edge, fraction = domain
    n = neighbours.shape[0]
    share, edge = 2.0, first_edge[node]
    for k in range(neighbours.shape[1]):
        if neighbours[node, k] < n:
            continue
        sign = 2 * (k % 2) - 1
        start, stop = sign * before[k // 2], sign * after[k // 2]
        if stop > fraction[edge] - _TOUCH:
            share = min(share, min(max((fraction[edge] - start) / max(stop - start, _TOUCH), 0.0), 1.0))
        edge += 1
    return share


@njit(cache=True, nogil=True)
def _mean_direction(
    node: int,
    offset: NDArray[np.float64],
    unit: NDArray[np.float64],
    neighbours: NDArray[np.int32],
    direction: NDArray[np.float64],
) -> bool:
    """Interpolate unit vectors among the nodes around a point that uncut edges join; False if they cancel."""
    n, d = neighbours.shape[0], offset.size
    corner = np.full(1 << d, -1)
    corner[0] = node
    direction[:] = 0
    total = 0.0
    for s in range(1 << d):  # bit a of s: one edge along axis a toward the point
        weight = 1.0
        for axis in range(d):
            t = min(abs(offset[axis]), _MOST)
            if s >> axis & 1:
                weight *= t
                near = corner[s ^ (1 << axis)]
                j = n if near < 0 else neighbours[near, 2 * axis + (1 if offset[axis] > 0 else 0)]
                if j < n:
                    corner[s] = j
            else:
                weight *= 1 - t
        if corner[s] >= 0:
            total += weight
            for axis in range(d):
                direction[axis] += weight * unit[corner[s], axis]
    length = np.sqrt(np.square(direction).sum())
    if length < _LEAST * total:
        return False
    direction /= length
    return True
