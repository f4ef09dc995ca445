"""Straight ways between the nodes of a shape, and how far they reach."""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray


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
    corner = np.empty(1 << d, np.int32)
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
                if _in_sight(index, neighbours, seed, near, corner):
                    queue[last] = near
                    last += 1


@njit(cache=True, nogil=True)
def _in_sight(
    index: NDArray[np.int32],
    neighbours: NDArray[np.int32],
    start: int,
    end: int,
    corner: NDArray[np.int32],
) -> bool:
    """Walk the voxels on the straight line from node to node; False where a face is no uncut edge."""
    d, n = index.shape[1], index.shape[0]
    length = np.abs(index[end] - index[start])
    crossed = np.zeros(d, np.int64)
    node = start
    for _ in range(length.sum()):
        # axis a is crossed next at (2 crossed + 1) / (2 length); equal ones at a corner of voxels, at once
        ties, lead = 0, -1
        for a in range(d):
            if crossed[a] == length[a]:
                continue
            order = 1
            if lead >= 0:
                order = (2 * crossed[lead] + 1) * length[a] - (2 * crossed[a] + 1) * length[lead]
            if order > 0:
                ties, lead = 1 << a, a
            elif order == 0:
                ties |= 1 << a
        corner[0] = node
        for part in range(1, ties + 1):
            if part & ties != part:
                continue
            corner[part] = n
            for a in range(d):
                if part >> a & 1 and corner[part ^ (1 << a)] < n and corner[part] == n:
                    way = 2 * a + int(index[end, a] > index[start, a])
                    corner[part] = neighbours[corner[part ^ (1 << a)], way]
        node = corner[ties]
        if node == n:
            return False
        for a in range(d):
            crossed[a] += ties >> a & 1
        if node == end:
            return True
    return True
