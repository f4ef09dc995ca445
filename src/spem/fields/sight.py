"""Straight ways between the nodes of a shape, and how far they reach."""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

# Beyond every crossing: an axis along which a line does not run.
_NEVER = np.iinfo(np.int64).max


@njit(cache=True, nogil=True)
def see(
    index: NDArray[np.int32],
    neighbours: NDArray[np.int32],
    spacing: NDArray[np.float64],
    seed: int,
    offset: NDArray[np.float64],
    distance: NDArray[np.float64],
) -> None:
    """Lower `distance`, in place, to the length of the straight way where that is free.

    The way from the seed to a node is free when every voxel face that it crosses is an uncut edge between
    two nodes. Only nodes beside others in sight are tried.

    Parameters
    ----------
    index
        ``(n_nodes, d)`` place of each node in its grid.
    neighbours
        ``(n_nodes, 2 d)`` table of `Domain.neighbours`.
    spacing
        ``(d,)`` length of the edges.
    seed
        The node that looks.
    offset
        ``(d,)`` where the distance is measured from, less the position of the seed.
    distance
        ``(n_nodes,)``; infinite where nothing is known yet.
    """
    n, d = index.shape
    tried = np.zeros(n, np.bool_)
    queue = np.empty(n, np.int32)
    crossing, corner = np.empty((d, 3), np.int64), np.empty(1 << d, np.int32)
    queue[0], tried[seed] = seed, True
    first, last = 0, 1
    while first < last:
        node = queue[first]
        first += 1
        squared = 0.0
        for a in range(d):
            squared += ((index[node, a] - index[seed, a]) * spacing[a] - offset[a]) ** 2
        distance[node] = min(distance[node], np.sqrt(squared))
        for k in range(2 * d):
            near = neighbours[node, k]
            if near < n and not tried[near]:
                tried[near] = True
                if _in_sight(index, neighbours, seed, near, crossing, corner):
                    queue[last] = near
                    last += 1


@njit(cache=True, nogil=True)
def _in_sight(
    index: NDArray[np.int32],
    neighbours: NDArray[np.int32],
    start: int,
    end: int,
    crossing: NDArray[np.int64],
    corner: NDArray[np.int32],
) -> bool:
    """Walk the voxels on the straight line from node to node; False where a face is no uncut edge."""
    n, d = index.shape
    # the k-th face across axis a is crossed at (2 k + 1) / (2 |steps_a|): whole numbers after scaling
    scale = 1
    for a in range(d):
        scale *= max(abs(index[end, a] - index[start, a]), 1)
    for a in range(d):
        steps = abs(index[end, a] - index[start, a])
        crossing[a, 0] = scale // steps if steps else _NEVER
        crossing[a, 1] = 2 * crossing[a, 0] if steps else 0
        crossing[a, 2] = 2 * a + int(index[end, a] > index[start, a])
    node = start
    while node != end:
        lead, ties = 0, 1
        for a in range(1, d):
            if crossing[a, 0] < crossing[lead, 0]:
                lead, ties = a, 1 << a
            elif crossing[a, 0] == crossing[lead, 0]:
                ties |= 1 << a
        if ties == 1 << lead:
            node = neighbours[node, crossing[lead, 2]]
            crossing[lead, 0] += crossing[lead, 1]
        else:
            node = _round_corner(neighbours, node, ties, crossing, corner)
        if node == n:
            return False
    return True


@njit(cache=True, nogil=True)
def _round_corner(
    neighbours: NDArray[np.int32],
    node: int,
    ties: int,
    crossing: NDArray[np.int64],
    corner: NDArray[np.int32],
) -> int:
    """Cross several faces at once, where they meet: on any way along edges; the number of nodes if none."""
    n, d = neighbours.shape[0], crossing.shape[0]
    corner[0] = node
    for part in range(1, ties + 1):
        if part & ties != part:
            continue
        corner[part] = n
        for a in range(d):
            if part >> a & 1 and corner[part] == n and corner[part ^ (1 << a)] < n:
                corner[part] = neighbours[corner[part ^ (1 << a)], crossing[a, 2]]
    for a in range(d):
        if ties >> a & 1:
            crossing[a, 0] += crossing[a, 1]
    return int(corner[ties])
