"""Kernels that walk: uniform numbers of a stream of one's own for each node, and steps over a table."""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from spem.errors import ParameterError, require_kind
from spem.fields.walks.killed import Walk

# Rounding of the rows of a conservative walk.
_ROUNDING = 1e-9
_MANTISSA = np.uint64(11)
_UNIT = 2.0**-53


def streams(n: int, rng: np.random.Generator) -> NDArray[np.uint64]:
    """Return the starting states of `n` independent streams of uniform numbers, one a row.

    Each is a generator xoshiro256++ of period 2^256 - 1, started at random.

    Examples
    --------
    >>> streams(3, np.random.default_rng(0)).shape
    (3, 4)
    """
    require_kind(rng, np.random.Generator, "make one: numpy.random.default_rng(seed)")
    return rng.integers(1, 2**64, size=(n, 4), dtype=np.uint64)


def step_table(walk: Walk) -> NDArray[np.float64]:
    """Return the running sums of the chances of each node's edges; above the last one it is killed.

    Parameters
    ----------
    walk
        A walk with no negative chance to be killed.

    Returns
    -------
    table
        ``(n_nodes, 2 d)``, the last column 1 less `Walk.killing`.

    Raises
    ------
    ParameterError
        When at some node the chances of all edges exceed 1, so that there is no such walk.

    Examples
    --------
    >>> from spem.fields.walks.killed import killed_walk
    >>> from spem.shapes.shape import Shape
    >>> step_table(killed_walk(Shape.from_mask(np.ones(2)), np.inf, boundary="voxel"))
    array([[0.5, 1. ],
           [0.5, 1. ]])
    """
    worst = float(walk.killing.min())
    if worst < -_ROUNDING:
        msg = (
            f"{walk.system.shape.name}: the chances of a step add up to {1 - worst:.6g} at some node; h must "
            "be an upper solution of (A + M/rho²) h = b, such as the field itself"
        )
        raise ParameterError(msg)
    table = np.cumsum(walk.probability, axis=1)
    total = table[:, -1:]
    # chances of exactly 0 and 1 stay exact, so no walk takes an edge that it cannot take
    table = np.divide(table, total, out=np.zeros_like(table), where=total > 0)
    return np.asarray(table * np.where(walk.killing < _ROUNDING**2, 1.0, 1.0 - walk.killing)[:, None])


@njit(cache=True, nogil=True, inline="always")
def uniform(state: NDArray[np.uint64]) -> float:
    """Next number of a stream, in [0, 1)."""
    a, b, c, d = state[0], state[1], state[2], state[3]
    mixed = a + d
    result = ((mixed << np.uint64(23)) | (mixed >> np.uint64(41))) + a
    shifted = b << np.uint64(17)
    c ^= a
    d ^= b
    b ^= c
    a ^= d
    c ^= shifted
    d = (d << np.uint64(45)) | (d >> np.uint64(19))
    state[0], state[1], state[2], state[3] = a, b, c, d
    return float(result >> _MANTISSA) * _UNIT


@njit(cache=True, nogil=True)
def count_ends(
    start: int,
    n_walks: int,
    state: NDArray[np.uint64],
    table: NDArray[np.float64],
    target: NDArray[np.int32],
    counts: NDArray[np.int64],
) -> int:
    """Walk many times from one node, count where the walks end, and return the number of steps of all.

    A target below zero is an end: -1 - g is that of group g.
    """
    width = table.shape[1]
    steps = 0
    for _ in range(n_walks):
        node = np.int64(start)
        while node >= 0:
            number = uniform(state)
            edge = 0
            for k in range(width):
                edge += number >= table[node, k]
            steps += 1
            if edge == width:
                break
            node = np.int64(target[node, edge])
        if node < 0:
            counts[-1 - node] += 1
    return steps


@njit(cache=True, nogil=True)
def discount(
    start: int,
    state: NDArray[np.uint64],
    table: NDArray[np.float64],
    target: NDArray[np.int32],
    survival: NDArray[np.float64],
    weights: NDArray[np.float64],
) -> None:
    """Walk from one node to the boundary, never killed, and keep the product of survivals of each walk."""
    width = table.shape[1]
    for walk in range(weights.size):
        node, weight = np.int64(start), 1.0
        while node >= 0:
            weight *= survival[node]
            number = uniform(state)
            edge = 0
            for k in range(width):
                edge += number >= table[node, k]
            node = np.int64(target[node, min(edge, width - 1)])
        weights[walk] = weight


@njit(cache=True, nogil=True)
def trace(
    start: int, state: NDArray[np.uint64], table: NDArray[np.float64], target: NDArray[np.int32]
) -> tuple[NDArray[np.int64], int]:
    """Walk once; return the nodes on the way, and the edge over which it left the last one, -1 if killed."""
    width = table.shape[1]
    nodes = np.empty(64, np.int64)
    count, node, edge = 0, np.int64(start), 0
    while node >= 0:
        if count == nodes.size:
            grown = np.empty(2 * count, np.int64)
            grown[:count] = nodes
            nodes = grown
        nodes[count] = node
        count += 1
        number = uniform(state)
        edge = 0
        for k in range(width):
            edge += number >= table[node, k]
        if edge == width:
            return nodes[:count].copy(), -1
        node = np.int64(target[node, edge])
    return nodes[:count].copy(), edge
