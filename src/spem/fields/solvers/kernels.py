"""Numba kernels of the block multigrid: each node carries one value per lane, each lane has its own shift.

A level is a graph in C order with, per node, neighbours in 2d directions (a dummy row of zeros stands for a
missing one), a Laplacian diagonal and a mass; lane l of node i has the diagonal ``diagonal[i] + shift[l] *
mass[i]``. `weight` has one row for all nodes (finest level, `step` 0) or one per node (`step` 1).

Nodes are cut along the first axis into slabs, even and odd ones in turn; ``slabs[k]`` is the first node
of slab k. A kernel does the slabs `first`, ``first + stride``, ... . Sweeps do all even slabs, then all odd
ones, and back in reverse: slabs of one colour never touch, so threads share them and the answer does not
depend on how many there are.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

from spem.fields.solvers.engine import LANES
from spem.fields.solvers.lanes import add, div, load, mul, splat, store, sub, widen

Lanes = NDArray[np.float32]
Table = NDArray[np.int32]
Slabs = NDArray[np.int64]
Partial = NDArray[np.float64]


@njit(cache=True, nogil=True)
def multiply(
    p: Lanes, q: Lanes, partial: Partial, level: Any, shift: Lanes, slabs: Slabs, first: int, stride: int
) -> None:
    """Write q = (A + shift) p, and the dot products of p and q for each slab."""
    neighbours, weight, step, diagonal, mass = level
    s = load(shift, 0)
    for slab in range(first, slabs.size - 1, stride):
        partial[slab] = 0
        dot = load(partial, slab)
        for i in range(slabs[slab], slabs[slab + 1]):
            here = load(p, i)
            value = mul(add(splat(diagonal[i]), mul(s, splat(mass[i]))), here)
            for k in range(neighbours.shape[1]):
                value = sub(value, mul(splat(weight[i * step, k]), load(p, neighbours[i, k])))
            store(q, i, value)
            dot = add(dot, mul(widen(here), widen(value)))
        store(partial, slab, dot)


@njit(cache=True, nogil=True)
def advance(
    x: Lanes, r: Lanes, p: Lanes, q: Lanes, alpha: Lanes, slabs: Slabs, first: int, stride: int
) -> None:
    """Add alpha p to x and subtract alpha q from r."""
    a = load(alpha, 0)
    for slab in range(first, slabs.size - 1, stride):
        for i in range(slabs[slab], slabs[slab + 1]):
            store(x, i, add(load(x, i), mul(a, load(p, i))))
            store(r, i, sub(load(r, i), mul(a, load(q, i))))


@njit(cache=True, nogil=True)
def relax_forward(
    r: Lanes, z: Lanes, level: Any, shift: Lanes, slabs: Slabs, first: int, stride: int
) -> None:
    """Do the slabs' part of a Gauss-Seidel sweep for z from zero: only nodes done before have a value.

    Those are the lower neighbours and, for odd slabs, the even slab above; z is zero where nothing is done.
    """
    neighbours, weight, step, diagonal, mass = level
    s, one = load(shift, 0), splat(np.float32(1.0))  # the reciprocal does not wait for the node before
    for slab in range(first, slabs.size - 1, stride):
        high = slabs[slab + 1]
        later = high if slab % 2 == 1 else neighbours.shape[0] + 1
        for i in range(slabs[slab], high):
            value = load(r, i)
            for k in range(0, neighbours.shape[1], 2):
                value = add(value, mul(splat(weight[i * step, k]), load(z, neighbours[i, k])))
            if neighbours[i, 1] >= later:
                value = add(value, mul(splat(weight[i * step, 1]), load(z, neighbours[i, 1])))
            store(z, i, mul(value, div(one, add(splat(diagonal[i]), mul(s, splat(mass[i]))))))


@njit(cache=True, nogil=True)
def restrict(
    z: Lanes, coarse: Lanes, aggregate: Table, level: Any, slabs: Slabs, first: int, stride: int
) -> None:
    """Sum the residual over aggregates: after a forward sweep it is what later nodes contribute.

    Slabs hold whole aggregates, and the rows of `coarse` are zero before.
    """
    neighbours, weight, step, _, _ = level
    for slab in range(first, slabs.size - 1, stride):
        low, high = slabs[slab], slabs[slab + 1]
        earlier = low if slab % 2 == 0 else 0
        later = high if slab % 2 == 1 else neighbours.shape[0]
        for i in range(low, high):
            value = load(coarse, aggregate[i])
            for k in range(3, neighbours.shape[1], 2):
                value = add(value, mul(splat(weight[i * step, k]), load(z, neighbours[i, k])))
            below, above = neighbours[i, 0], neighbours[i, 1]
            if above < later:
                value = add(value, mul(splat(weight[i * step, 1]), load(z, above)))
            if below < earlier:
                value = add(value, mul(splat(weight[i * step, 0]), load(z, below)))
            store(coarse, aggregate[i], value)


@njit(cache=True, nogil=True)
def correct(z: Lanes, coarse: Lanes, aggregate: Table, slabs: Slabs, first: int, stride: int) -> None:
    """Add the correction of the coarser level."""
    for slab in range(first, slabs.size - 1, stride):
        for i in range(slabs[slab], slabs[slab + 1]):
            store(z, i, add(load(z, i), load(coarse, aggregate[i])))


@njit(cache=True, nogil=True)
def relax_backward(
    r: Lanes, z: Lanes, partial: Partial, level: Any, shift: Lanes, slabs: Slabs, first: int, stride: int
) -> None:
    """Do the slabs' part of a reverse Gauss-Seidel sweep, and the dot products of r and z for each slab."""
    neighbours, weight, step, diagonal, mass = level
    s, one = load(shift, 0), splat(np.float32(1.0))
    for slab in range(first, slabs.size - 1, stride):
        partial[slab] = 0
        dot = load(partial, slab)
        for i in range(slabs[slab + 1] - 1, slabs[slab] - 1, -1):
            source = load(r, i)
            value = source
            for k in range(neighbours.shape[1]):
                value = add(value, mul(splat(weight[i * step, k]), load(z, neighbours[i, k])))
            value = mul(value, div(one, add(splat(diagonal[i]), mul(s, splat(mass[i])))))
            store(z, i, value)
            dot = add(dot, mul(widen(source), widen(value)))
        store(partial, slab, dot)


@njit(cache=True, nogil=True)
def turn(z: Lanes, p: Lanes, beta: Lanes, slabs: Slabs, first: int, stride: int) -> None:
    """Make p = z + beta p, the next search directions."""
    b = load(beta, 0)
    for slab in range(first, slabs.size - 1, stride):
        for i in range(slabs[slab], slabs[slab + 1]):
            store(p, i, add(load(z, i), mul(b, load(p, i))))


@njit(cache=True, nogil=True)
def apply_dense(r: Lanes, z: Lanes, inverse: Lanes) -> None:
    """Write z = inverse r on the coarsest level; row ``i * n + j`` of `inverse` is its entry (i, j)."""
    n = r.shape[0] - 1
    for i in range(n):
        value = mul(load(inverse, i * n), load(r, 0))
        for j in range(1, n):
            value = add(value, mul(load(inverse, i * n + j), load(r, j)))
        store(z, i, value)


@njit(cache=True, nogil=True)
def peak(z: Lanes, partial: Partial, slabs: Slabs, first: int, stride: int) -> None:
    """Largest magnitude in each lane, for each slab."""
    for slab in range(first, slabs.size - 1, stride):
        partial[slab] = 0
        for i in range(slabs[slab], slabs[slab + 1]):
            for lane in range(LANES):
                partial[slab, lane] = max(partial[slab, lane], abs(z[i, lane]))


@njit(cache=True, nogil=True)
def coarsen(aggregate: Table, n_coarse: int, level: Any) -> Any:
    """Galerkin graph of unsmoothed aggregation with the Laplacian halved.

    Piecewise constant interpolation overestimates the stiffness by two per level, the mass not at all.
    """
    neighbours, weight, step, diagonal, mass = level
    width = neighbours.shape[1]
    table = np.full((n_coarse, width), n_coarse, np.int32)
    weight_c = np.zeros((n_coarse, width), np.float32)
    diagonal_c = np.zeros(n_coarse, np.float32)
    mass_c = np.zeros(n_coarse, np.float32)
    for i in range(neighbours.shape[0]):
        here = aggregate[i]
        diagonal_c[here] += np.float32(0.5) * diagonal[i]
        mass_c[here] += mass[i]
        for k in range(width):
            j = neighbours[i, k]
            if j == neighbours.shape[0]:
                continue
            half = np.float32(0.5) * weight[i * step, k]
            if aggregate[j] == here:
                diagonal_c[here] -= half
            else:
                table[here, k] = aggregate[j]
                weight_c[here, k] += half
    return table, weight_c, diagonal_c, mass_c


@njit(cache=True, nogil=True)
def aggregate_voxels(
    voxels: NDArray[np.int64], shape: NDArray[np.int64], coarse_shape: NDArray[np.int64]
) -> tuple[NDArray[np.int64], Table]:
    """Group nodes in 2^d blocks; return the flat coarse index of each block, and the block of each node."""
    d = shape.size
    size = 1
    for a in range(d):
        size *= coarse_shape[a]
    number = np.full(size, -1, np.int32)
    aggregate = np.empty(voxels.size, np.int32)
    for i in range(voxels.size):
        rest, flat, stride = voxels[i], 0, 1
        for a in range(d - 1, -1, -1):
            flat += (rest % shape[a]) // 2 * stride
            rest //= shape[a]
            stride *= coarse_shape[a]
        number[flat] = 0
        aggregate[i] = flat
    n_coarse = 0
    for flat in range(size):
        if number[flat] == 0:
            number[flat] = n_coarse
            n_coarse += 1
    blocks = np.empty(n_coarse, np.int64)
    for flat in range(size):
        if number[flat] >= 0:
            blocks[number[flat]] = flat
    for i in range(voxels.size):
        aggregate[i] = number[aggregate[i]]
    return blocks, aggregate
