"""Numba kernels of the reduced basis, in double precision whatever the basis is stored in.

A block is an ``(n + 1, LANES)`` array of columns with a last row of zeros; the constant is never stored.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

from spem.fields.solvers.lanes import LANES, add, load, load_wide, mul, splat, store, sub

Block = NDArray[Any]
Small = NDArray[np.float64]


@njit(cache=True, nogil=True)
def combine(block: Block, mix: Small, constant: Small, out: Block, keep: bool) -> None:
    """Write ``constant + block @ mix`` to `out`, or add ``block @ mix`` to it where `keep` is True."""
    for i in range(block.shape[0] - 1):
        value = load_wide(out, i) if keep else load(constant, 0)
        for k in range(LANES):
            value = add(value, mul(splat(np.float64(block[i, k])), load(mix, k)))
        store(out, i, value)


@njit(cache=True, nogil=True)
def cross(block: Block, other: Block) -> Small:
    """``block.T @ other`` in the first `LANES` rows, the column sums of `other` in the last."""
    total = np.zeros((LANES + 1, LANES))
    for i in range(other.shape[0] - 1):
        value = load_wide(other, i)
        for k in range(LANES):
            store(total, k, add(load(total, k), mul(splat(np.float64(block[i, k])), value)))
        store(total, LANES, add(load(total, LANES), value))
    return total


@njit(cache=True, nogil=True)
def cross_operator(
    block: Block, other: Block, neighbours: NDArray[np.int32], weights: Small, diagonal: Small
) -> Small:
    """``block.T @ A @ other`` in the first `LANES` rows, the column sums of ``A @ other`` in the last."""
    total = np.zeros((LANES + 1, LANES))
    for i in range(other.shape[0] - 1):
        value = mul(splat(diagonal[i]), load_wide(other, i))
        for k in range(neighbours.shape[1]):
            value = sub(value, mul(splat(weights[k]), load_wide(other, neighbours[i, k])))
        for k in range(LANES):
            store(total, k, add(load(total, k), mul(splat(np.float64(block[i, k])), value)))
        store(total, LANES, add(load(total, LANES), value))
    return total


@njit(cache=True, nogil=True)
def true_residual(
    u: Block, r: Block, neighbours: NDArray[np.int32], weights: Small, diagonal: Small, shift: Small
) -> None:
    """Write r = shift - (A + shift) u: how far u is from the deficit 1 - v."""
    s = load(shift, 0)
    for i in range(neighbours.shape[0]):
        value = sub(s, mul(add(splat(diagonal[i]), s), load_wide(u, i)))
        for k in range(neighbours.shape[1]):
            value = add(value, mul(splat(weights[k]), load_wide(u, neighbours[i, k])))
        store(r, i, value)
