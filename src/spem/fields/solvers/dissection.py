"""Nested dissection: an order of elimination, and the fronts of the factorisation, from the grid itself."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray

from spem.fields.domain import Domain

# Regions of at most this many nodes are eliminated as one dense block: below it, dense algebra on a few
# zeros costs less than one more front. It must exceed 2 d + 1, or a region may have no separator.
_LEAF = 64


@dataclass(frozen=True, eq=False)
class Dissection:
    """Fronts of a factorisation, children before parents.

    Positions are places in the order of elimination. Front f eliminates the positions ``start[f]`` to
    ``start[f + 1]``, and couples them to its rows, all later positions.

    Parameters
    ----------
    order
        ``(n_nodes,)`` node at each position.
    rank
        ``(n_nodes,)`` position of each node.
    start
        ``(n_fronts + 1,)`` first position of each front.
    row_start
        ``(n_fronts + 1,)`` where the rows of each front begin.
    rows
        Ascending positions of the rows of all fronts, one front after another.
    parent
        ``(n_fronts,)`` front that takes the update of each; -1 for roots.
    """

    order: NDArray[np.int32]
    rank: NDArray[np.int32]
    start: NDArray[np.int64]
    row_start: NDArray[np.int64]
    rows: NDArray[np.int32]
    parent: NDArray[np.int32]

    @property
    def n_fronts(self) -> int:
        """Number of fronts."""
        return self.parent.size

    @property
    def n_entries(self) -> int:
        """Numbers that the factor holds, its dense blocks in full."""
        columns, rows = np.diff(self.start), np.diff(self.row_start)
        return int(columns @ (columns + rows))

    @property
    def peak_entries(self) -> int:
        """Most numbers held at a time during a factorisation: the factor so far and the updates that wait."""
        columns, rows = np.diff(self.start), np.diff(self.row_start)
        waiting = np.zeros(self.n_fronts + 1, np.int64)  # the last entry takes what roots would add
        kept = peak = held = 0
        for f, (own, update) in enumerate(zip(columns * (columns + rows), rows**2, strict=True)):
            kept += int(own)
            held += int(update)
            peak = max(peak, kept + held)
            held -= int(waiting[f])
            waiting[self.parent[f]] += update
        return peak

    @property
    def flops(self) -> float:
        """Floating-point operations of the factorisation."""
        columns, rows = np.diff(self.start).astype(float), np.diff(self.row_start).astype(float)
        return float(np.sum(columns**3 / 3 + columns**2 * rows + columns * rows**2))


def dissect(domain: Domain, index: NDArray[np.int32]) -> Dissection:
    """Order the nodes of a domain by nested dissection and find the fronts.

    A region is split where a plane of the grid, or a level of the distance along the grid from one of its
    ends, is narrow and divides it evenly: legs are cut across, wherever they point.

    Parameters
    ----------
    domain
        Neighbours of the nodes.
    index
        ``(n_nodes, d)`` grid index of each node.

    Examples
    --------
    >>> import numpy as np
    >>> from spem.fields.domain import voxel_domain
    >>> from spem.shapes.shape import Shape
    >>> shape = Shape.from_mask(np.ones((40, 10)))
    >>> index = np.argwhere(shape.mask).astype(np.int32)
    >>> found = dissect(voxel_domain(shape), index)
    >>> bool((np.sort(found.order) == np.arange(400)).all())
    True
    """
    order, start = _dissect(domain.neighbours, index, _LEAF)
    start = np.append(np.sort(start), order.size)
    rank = np.empty_like(order)
    rank[order] = np.arange(order.size, dtype=np.int32)
    row_start, rows, parent = _structure(domain.neighbours, order, rank, start)
    return Dissection(order, rank, start, row_start, rows, parent)


@njit(cache=True, nogil=True)
def _dissect(
    neighbours: NDArray[np.int32], index: NDArray[np.int32], leaf: int
) -> tuple[NDArray[np.int32], NDArray[np.int64]]:
    """Order of elimination and first positions of the fronts, unsorted."""
    n, d = index.shape
    order = np.arange(n).astype(np.int32)
    queue = np.empty(n, np.int32)
    mark = np.zeros(n, np.int64)  # which region, component or side a node is in, by a number never reused
    level = np.empty((n, d + 1), np.int32)
    level[:, :d] = index
    starts = [np.int64(0) for _ in range(0)]
    stack = [(np.int64(0), np.int64(n))]
    fresh = np.int64(0)
    while len(stack):
        low, high = stack.pop()
        fresh += 1
        region = fresh
        for p in range(low, high):
            mark[order[p]] = region
        ends = _components(neighbours, order, queue, mark, level, low, high, region)
        begin = low  # of the leaf that gathers small components
        first = low
        for end in ends:
            if end - first > leaf:
                if begin < first:
                    starts.append(begin)
                fresh += 4
                left, right = _split(neighbours, order, queue, mark, level, first, end, fresh)
                stack.append((first, left))
                stack.append((left, right))
                starts.append(right)
                begin = end
            elif end - begin > leaf:
                starts.append(begin)
                begin = first
            first = end
        if begin < high:
            starts.append(begin)
    return order, np.array(starts)


@njit(cache=True, nogil=True)
def _components(
    neighbours: NDArray[np.int32],
    order: NDArray[np.int32],
    queue: NDArray[np.int32],
    mark: NDArray[np.int64],
    level: NDArray[np.int32],
    low: int,
    high: int,
    region: int,
) -> list[np.int64]:
    """Sort a region by connected components, each by distance from one of its ends; return their ends."""
    ends = [np.int64(0) for _ in range(0)]
    tail = low
    for p in range(low, high):
        seed = order[p]
        if mark[seed] != region:
            continue
        first = tail
        # the node met last by a search from anywhere is an end; the distances are taken from there
        tail = _search(neighbours, queue, mark, level, seed, first, region, -region)
        tail = _search(neighbours, queue, mark, level, queue[tail - 1], first, -region, 0)
        ends.append(tail)
    order[low:high] = queue[low:high]
    return ends


@njit(cache=True, nogil=True)
def _search(
    neighbours: NDArray[np.int32],
    queue: NDArray[np.int32],
    mark: NDArray[np.int64],
    level: NDArray[np.int32],
    seed: int,
    first: int,
    old: int,
    new: int,
) -> int:
    """Breadth-first search over nodes marked `old`, which become `new`; return the queue's end."""
    n, last = neighbours.shape[0], level.shape[1] - 1
    queue[first], mark[seed], level[seed, last] = seed, new, 0
    head, tail = first, first + 1
    while head < tail:
        node = queue[head]
        head += 1
        for j in neighbours[node]:
            if j < n and mark[j] == old:
                mark[j] = new
                level[j, last] = level[node, last] + 1
                queue[tail] = j
                tail += 1
    return tail


@njit(cache=True, nogil=True)
def _split(
    neighbours: NDArray[np.int32],
    order: NDArray[np.int32],
    queue: NDArray[np.int32],
    mark: NDArray[np.int64],
    level: NDArray[np.int32],
    first: int,
    end: int,
    fresh: int,
) -> tuple[int, int]:
    """Sort a component into left, right and separator; return where right and separator begin."""
    n = neighbours.shape[0]
    axis, plane = _best_plane(order, level, first, end)
    left, right, between = fresh, fresh - 1, fresh - 2
    for p in range(first, end):
        node = order[p]
        side = level[node, axis] - plane
        mark[node] = left if side < 0 else (right if side > 0 else between)
    counts = np.zeros(3, np.int64)
    for p in range(first, end):
        node = order[p]
        if mark[node] == between:  # what touches one side only belongs to the other
            near_left = near_right = False
            for j in neighbours[node]:
                if j < n:
                    near_left |= mark[j] == left
                    near_right |= mark[j] == right
            if not near_left:
                mark[node] = right
            elif not near_right:
                mark[node] = left
    for p in range(first, end):
        counts[left - mark[order[p]]] += 1
    place = np.array([first, first + counts[0], first + counts[0] + counts[1]])
    for p in range(first, end):
        queue[p] = order[p]
    for p in range(first, end):
        side = left - mark[queue[p]]
        order[place[side]] = queue[p]
        place[side] += 1
    return first + counts[0], first + counts[0] + counts[1]


@njit(cache=True, nogil=True)
def _best_plane(order: NDArray[np.int32], level: NDArray[np.int32], first: int, end: int) -> tuple[int, int]:
    """Axis (the last: distance from an end) and level of the least ratio cut, nodes / (left · right)."""
    best, best_axis, best_plane = np.inf, -1, -1
    for axis in range(level.shape[1]):
        low = high = level[order[first], axis]
        for p in range(first, end):
            low, high = min(low, level[order[p], axis]), max(high, level[order[p], axis])
        count = np.zeros(high - low + 1, np.int64)
        for p in range(first, end):
            count[level[order[p], axis] - low] += 1
        before = count[0]
        for plane in range(1, count.size - 1):
            after = end - first - before - count[plane]
            score = count[plane] / (float(before) * float(after))
            if score < best:
                best, best_axis, best_plane = score, axis, low + plane
            before += count[plane]
    return best_axis, best_plane


@njit(cache=True, nogil=True)
def _structure(
    neighbours: NDArray[np.int32],
    order: NDArray[np.int32],
    rank: NDArray[np.int32],
    start: NDArray[np.int64],
) -> tuple[NDArray[np.int64], NDArray[np.int32], NDArray[np.int32]]:
    """Rows of each front, where they begin, and its parent: the front of its first row."""
    n, n_fronts = order.size, start.size - 1
    front = np.empty(n, np.int32)
    for f in range(n_fronts):
        front[start[f] : start[f + 1]] = f
    parent = np.full(n_fronts, -1, np.int32)
    child, sibling = np.full(n_fronts, -1, np.int32), np.full(n_fronts, -1, np.int32)
    stamp = np.full(n, -1, np.int32)
    row_start = np.zeros(n_fronts + 1, np.int64)
    rows = np.empty(4 * n, np.int32)
    for f in range(n_fronts):
        size = first = row_start[f]
        if size + n > rows.size:
            rows = np.concatenate((rows, np.empty(rows.size + n, np.int32)))
        for p in range(start[f], start[f + 1]):
            for j in neighbours[order[p]]:
                if j < n and rank[j] >= start[f + 1] and stamp[rank[j]] != f:
                    stamp[rank[j]] = f
                    rows[size] = rank[j]
                    size += 1
        c = child[f]
        while c >= 0:
            for i in range(row_start[c], row_start[c + 1]):
                row = rows[i]
                if row >= start[f + 1] and stamp[row] != f:
                    stamp[row] = f
                    rows[size] = row
                    size += 1
            c = sibling[c]
        row_start[f + 1] = size
        if size > first:
            rows[first:size] = np.sort(rows[first:size])
            up = front[rows[first]]
            parent[f], sibling[f], child[up] = up, child[up], f
    return row_start, rows[: row_start[-1]].copy(), parent
