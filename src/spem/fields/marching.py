"""Fronts that spread over the graph of the nodes, nearest first: fast marching, and nearest points."""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

# States of a node in `place`; others hold its place in the heap.
_SETTLED = -2
_FAR = -1


@njit(cache=True, nogil=True)
def march(
    neighbours: NDArray[np.int32], spacing: NDArray[np.float64], order: int, distance: NDArray[np.float64]
) -> None:
    """Solve the eikonal equation |∇u| = 1 outward from the nodes of finite distance, in place.

    Upwind differences over settled neighbours, of second order along an axis where two in a row are settled
    and the farther one is no larger (Sethian 1999), else of first.

    Parameters
    ----------
    neighbours
        ``(n_nodes, 2 d)`` table of `Domain.neighbours`.
    spacing
        ``(d,)`` length of the edges.
    order
        1 or 2, the highest order of the differences.
    distance
        ``(n_nodes,)`` distance where it is given, infinite elsewhere; it stays so where no edge leads.
    """
    n, directions = neighbours.shape
    heap = np.empty(n, np.int32)
    place = np.full(n, _FAR, np.int32)
    value, weight = np.empty(directions // 2), np.empty(directions // 2)
    size = 0
    for node in range(n):
        if distance[node] < np.inf:
            place[node] = _SETTLED
    for node in range(n):
        if place[node] != _SETTLED:
            size = _update(neighbours, spacing, order, node, distance, heap, place, size, value, weight)
    while size > 0:
        node = heap[0]
        size -= 1
        place[node] = _SETTLED
        if size > 0:
            _sift_down(heap, place, distance, heap[size], size)
        for k in range(directions):
            near = neighbours[node, k]
            if near < n and place[near] != _SETTLED:
                size = _update(neighbours, spacing, order, near, distance, heap, place, size, value, weight)


@njit(cache=True, nogil=True)
def _update(
    neighbours: NDArray[np.int32],
    spacing: NDArray[np.float64],
    order: int,
    node: int,
    distance: NDArray[np.float64],
    heap: NDArray[np.int32],
    place: NDArray[np.int32],
    size: int,
    value: NDArray[np.float64],
    weight: NDArray[np.float64],
) -> int:
    """Lower the trial distance of a node and its place in the heap; return the heap's size."""
    axes = _upwind(neighbours, spacing, order, node, distance, place, value, weight)
    return int(_lower(node, _solve(value[:axes], weight[:axes]), distance, heap, place, size))


@njit(cache=True, nogil=True)
def _lower(
    node: int,
    trial: float,
    distance: NDArray[np.float64],
    heap: NDArray[np.int32],
    place: NDArray[np.int32],
    size: int,
) -> int:
    """Lower the value of a node where the trial is less, and move it up the heap; return the heap's size."""
    if trial < distance[node]:
        distance[node] = trial
        if place[node] == _FAR:
            heap[size] = node
            place[node] = size
            size += 1
        _sift_up(heap, place, distance, place[node])
    return size


@njit(cache=True, nogil=True)
def _upwind(
    neighbours: NDArray[np.int32],
    spacing: NDArray[np.float64],
    order: int,
    node: int,
    distance: NDArray[np.float64],
    place: NDArray[np.int32],
    value: NDArray[np.float64],
    weight: NDArray[np.float64],
) -> int:
    """Fill in the terms weight² (u − value)² of the axes that have a settled neighbour, least value first."""
    n, axes = neighbours.shape[0], 0
    for a in range(spacing.size):
        least, term, scale = np.inf, 0.0, 0.0
        for k in (2 * a, 2 * a + 1):
            near = neighbours[node, k]
            if near == n or place[near] != _SETTLED or distance[near] >= least:
                continue
            least = distance[near]
            term, scale = least, 1.0 / spacing[a]
            next_one = neighbours[near, k]
            if order == 2 and next_one < n and place[next_one] == _SETTLED and distance[next_one] <= least:
                term, scale = (4.0 * least - distance[next_one]) / 3.0, 1.5 / spacing[a]
        if least < np.inf:
            slot = axes
            while slot > 0 and value[slot - 1] > term:
                value[slot], weight[slot] = value[slot - 1], weight[slot - 1]
                slot -= 1
            value[slot], weight[slot] = term, scale
            axes += 1
    return axes


@njit(cache=True, nogil=True)
def _solve(value: NDArray[np.float64], weight: NDArray[np.float64]) -> float:
    """Return the largest root u of Σ weight² (u − value)² = 1 over the axes whose value it exceeds."""
    trial = np.inf
    squares, linear, constant = 0.0, 0.0, -1.0
    for a in range(value.size):
        if value[a] >= trial:
            break
        # relative to the first value: squares of large distances would cancel
        step = value[a] - value[0]
        squares += weight[a] ** 2
        linear += weight[a] ** 2 * step
        constant += (weight[a] * step) ** 2
        root = max(linear**2 - squares * constant, 0.0)
        trial = value[0] + (linear + np.sqrt(root)) / squares
    return trial


@njit(cache=True, nogil=True)
def _sift_up(
    heap: NDArray[np.int32], place: NDArray[np.int32], distance: NDArray[np.float64], at: int
) -> None:
    """Move a node toward the root of the heap, past those that are farther."""
    node = heap[at]
    while at > 0:
        above = (at - 1) // 2
        if distance[heap[above]] <= distance[node]:
            break
        heap[at] = heap[above]
        place[heap[at]] = at
        at = above
    heap[at] = node
    place[node] = at


@njit(cache=True, nogil=True)
def _sift_down(
    heap: NDArray[np.int32], place: NDArray[np.int32], distance: NDArray[np.float64], node: int, size: int
) -> None:
    """Put a node at the root of the heap and move it down, past those that are nearer."""
    at = 0
    while True:
        below = 2 * at + 1
        if below >= size:
            break
        if below + 1 < size and distance[heap[below + 1]] < distance[heap[below]]:
            below += 1
        if distance[heap[below]] >= distance[node]:
            break
        heap[at] = heap[below]
        place[heap[at]] = at
        at = below
    heap[at] = node
    place[node] = at


@njit(cache=True, nogil=True)
def spread(
    position: NDArray[np.float64],
    neighbours: NDArray[np.int32],
    starts: NDArray[np.int64],
    feet: NDArray[np.float64],
    beside: NDArray[np.int64],
) -> NDArray[np.int64]:
    """Find the nearest foot of each node: among those of its neighbours, then along the feet downhill.

    Parameters
    ----------
    position
        ``(n_nodes, d)`` coordinates of the nodes.
    neighbours
        ``(n_nodes, 2 d)`` table of `Domain.neighbours`.
    starts
        ``(n_feet,)`` node that has each foot to begin with.
    feet
        ``(n_feet, d)`` coordinates of the feet.
    beside
        ``(n_feet, k)`` numbers of feet beside each foot.

    Returns
    -------
    foot
        ``(n_nodes,)`` number of the foot; -1 where none can be reached.
    """
    n, directions = neighbours.shape
    heap = np.empty(n, np.int32)
    place = np.full(n, _FAR, np.int32)
    squared, foot = np.full(n, np.inf), np.full(n, -1)
    size = 0
    for e in range(starts.size):
        size = _offer(position, feet, starts[e], e, squared, foot, heap, place, size)
    while size > 0:
        node = heap[0]
        size -= 1
        place[node] = _FAR
        if size > 0:
            _sift_down(heap, place, squared, heap[size], size)
        for k in range(directions):
            near = neighbours[node, k]
            if near < n:
                size = _offer(position, feet, near, foot[node], squared, foot, heap, place, size)
    for node in range(n):
        before = -2
        while foot[node] != before:
            before = foot[node]
            for e in beside[before] if before >= 0 else beside[0, :0]:
                trial = _squared(position[node], feet[e])
                if trial < squared[node]:
                    squared[node], foot[node] = trial, e
    return foot


@njit(cache=True, nogil=True)
def _squared(here: NDArray[np.float64], there: NDArray[np.float64]) -> float:
    """Square of the distance between two points."""
    total = 0.0
    for a in range(here.size):
        total += (here[a] - there[a]) ** 2
    return total


@njit(cache=True, nogil=True)
def _offer(
    position: NDArray[np.float64],
    feet: NDArray[np.float64],
    node: int,
    candidate: int,
    squared: NDArray[np.float64],
    foot: NDArray[np.int64],
    heap: NDArray[np.int32],
    place: NDArray[np.int32],
    size: int,
) -> int:
    """Let a node take a foot that is nearer than its own; return the heap's size."""
    trial = _squared(position[node], feet[candidate])
    if trial < squared[node]:
        foot[node] = candidate
    return int(_lower(node, trial, squared, heap, place, size))
