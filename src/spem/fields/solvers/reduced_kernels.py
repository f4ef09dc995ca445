"""Numba kernels of the reduced basis, in double precision whatever the basis is stored in.

A block is an ``(n + 1, LANES)`` array of columns with a last row of zeros. Slabs are those of `kernels`.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

from spem.fields.solvers.engine import LANES
from spem.fields.solvers.lanes import add, load, load_wide, mul, splat, store, sub

Block = NDArray[Any]
Small = NDArray[np.float64]
Slabs = NDArray[np.int64]


@njit(cache=True, nogil=True)
def combine(block: Block, mix: Small, out: Block, keep: bool, slabs: Slabs, first: int, stride: int) -> None:
    """Write ``block @ mix`` to `out`, or add it where `keep` is True."""
    for slab in range(first, slabs.size - 1, stride):
        for i in range(slabs[slab], slabs[slab + 1]):
            value = load_wide(out, i) if keep else splat(0.0)
            for k in range(LANES):
                value = add(value, mul(splat(np.float64(block[i, k])), load(mix, k)))
            store(out, i, value)


@njit(cache=True, nogil=True)
def cross(block: Block, other: Block, partial: Small, slabs: Slabs, first: int, stride: int) -> None:
    """Write ``block.T @ other`` to the first `LANES` rows of a slab's part, the column sums to the last."""
    for slab in range(first, slabs.size - 1, stride):
        total = partial[slab]
        total[:] = 0
        for i in range(slabs[slab], slabs[slab + 1]):
            value = load_wide(other, i)
            for k in range(LANES):
                store(total, k, add(load(total, k), mul(splat(np.float64(block[i, k])), value)))
            store(total, LANES, add(load(total, LANES), value))


@njit(cache=True, nogil=True)
def cross_operator(
    block: Block,
    other: Block,
    partial: Small,
    neighbours: NDArray[np.int32],
    weights: Small,
    diagonal: Small,
    mass: Small,
    slabs: Slabs,
    first: int,
    stride: int,
) -> None:
    """Write ``block.T @ A @ other`` and ``block.T @ M @ other``, the column sums of ``M @ other`` last."""
    for slab in range(first, slabs.size - 1, stride):
        stiff, heavy = partial[slab, 0], partial[slab, 1]
        stiff[:] = 0
        heavy[:] = 0
        for i in range(slabs[slab], slabs[slab + 1]):
            here = load_wide(other, i)
            value = mul(splat(diagonal[i]), here)
            for k in range(neighbours.shape[1]):
                value = sub(value, mul(splat(weights[k]), load_wide(other, neighbours[i, k])))
            here = mul(splat(mass[i]), here)
            for k in range(LANES):
                factor = splat(np.float64(block[i, k]))
                store(stiff, k, add(load(stiff, k), mul(factor, value)))
                store(heavy, k, add(load(heavy, k), mul(factor, here)))
            store(heavy, LANES, add(load(heavy, LANES), here))


@njit(cache=True, nogil=True)
def true_residual(
    u: Block,
    r: Block,
    neighbours: NDArray[np.int32],
    weights: Small,
    diagonal: Small,
    mass: Small,
    shift: Small,
    slabs: Slabs,
    first: int,
    stride: int,
) -> None:
    """Write r = shift M (1 - u) - A u: how far u is from the deficit 1 - v."""
    s = load(shift, 0)
    one = splat(1.0)
    for slab in range(first, slabs.size - 1, stride):
        for i in range(slabs[slab], slabs[slab + 1]):
            here = load_wide(u, i)
            value = sub(mul(mul(s, splat(mass[i])), sub(one, here)), mul(splat(diagonal[i]), here))
            for k in range(neighbours.shape[1]):
                value = add(value, mul(splat(weights[k]), load_wide(u, neighbours[i, k])))
            store(r, i, value)


@njit(cache=True, nogil=True)
def source_residual(
    rhs: Small,
    v: Small,
    r: Block,
    neighbours: NDArray[np.int32],
    weights: Small,
    diagonal: Small,
    mass: Small,
    shift: Small,
    slabs: Slabs,
    first: int,
    stride: int,
) -> None:
    """Write r = b - (A + shift M) v."""
    s = load(shift, 0)
    for slab in range(first, slabs.size - 1, stride):
        for i in range(slabs[slab], slabs[slab + 1]):
            value = sub(load(rhs, i), mul(add(splat(diagonal[i]), mul(s, splat(mass[i]))), load(v, i)))
            for k in range(neighbours.shape[1]):
                value = add(value, mul(splat(weights[k]), load(v, neighbours[i, k])))
            store(r, i, value)
