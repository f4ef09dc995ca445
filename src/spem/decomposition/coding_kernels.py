"""Inner sweeps of sparse coding: one block against the other's Gram matrix, without touching the data."""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

# Sweeps of a row after which its quadratic is minimised on the support it has settled on.
_SETTLED = 6
# Pivot, as a share of its diagonal entry, below which atoms count as linearly dependent.
_SINGULAR = 1e-10


@njit(cache=True, nogil=True)
def sweep_codes(
    gram: NDArray[np.float64],
    product: NDArray[np.float64],
    sparsity: float,
    codes: NDArray[np.float64],
    sweeps: int,
    tol: float,
) -> None:
    """Lower ½ cᵀGc − bᵀc + λ Σc over c ≥ 0 for each row c of `codes`, in place, by coordinate descent.

    Every few sweeps a row steps toward the minimum on its support, as far as it stays non-negative; so the
    descent ends in a few steps however alike the atoms are.

    Parameters
    ----------
    gram
        ``(k, k)`` G, products of the atoms.
    product
        ``(n_samples, k)`` rows b, products of the samples with the atoms.
    sparsity
        λ.
    codes
        ``(n_samples, k)`` where to start; overwritten.
    sweeps
        Most sweeps of one row.
    tol
        A row is done when no entry moves by more than this share of its largest entry.
    """
    n, k = codes.shape
    slope = np.empty(k)
    support = np.empty(k, np.int64)
    factor, target = np.empty((k, k)), np.empty(k)
    for i in range(n):
        row = codes[i]
        _slope(gram, product[i], sparsity, row, slope)
        for sweep in range(1, sweeps + 1):
            moved, largest = _sweep_row(gram, row, slope)
            if moved <= tol * largest:
                break
            if sweep % _SETTLED == 0:
                _step_on_support(gram, product[i], sparsity, row, support, factor, target)
                _slope(gram, product[i], sparsity, row, slope)


@njit(cache=True, nogil=True)
def _slope(
    gram: NDArray[np.float64],
    product: NDArray[np.float64],
    sparsity: float,
    row: NDArray[np.float64],
    slope: NDArray[np.float64],
) -> None:
    """Write the derivative Gc − b + λ."""
    k = row.size
    for j in range(k):
        slope[j] = sparsity - product[j]
    for j in range(k):
        if row[j] != 0:
            for m in range(k):
                slope[m] += gram[j, m] * row[j]


@njit(cache=True, nogil=True)
def _sweep_row(
    gram: NDArray[np.float64], row: NDArray[np.float64], slope: NDArray[np.float64]
) -> tuple[float, float]:
    """Minimise over each entry in turn; return the largest change and the largest entry."""
    moved, largest = 0.0, 0.0
    for j in range(row.size):
        if gram[j, j] <= 0:
            continue
        new = max(row[j] - slope[j] / gram[j, j], 0.0)
        step = new - row[j]
        if step != 0:
            row[j] = new
            for m in range(row.size):
                slope[m] += gram[j, m] * step
            moved = max(moved, abs(step))
        largest = max(largest, new)
    return moved, largest


@njit(cache=True, nogil=True)
def _step_on_support(
    gram: NDArray[np.float64],
    product: NDArray[np.float64],
    sparsity: float,
    row: NDArray[np.float64],
    support: NDArray[np.int64],
    factor: NDArray[np.float64],
    target: NDArray[np.float64],
) -> None:
    """Step from the row toward the minimum on its positive entries, until one of them is zero."""
    size = 0
    for j in range(row.size):
        if row[j] > 0:
            support[size] = j
            size += 1
    for a in range(size):
        target[a] = product[support[a]] - sparsity
        for b in range(a + 1):
            value = gram[support[a], support[b]]
            for m in range(b):
                value -= factor[a, m] * factor[b, m]
            if a != b:
                factor[a, b] = value / factor[b, b]
            elif value <= _SINGULAR * gram[support[a], support[a]]:
                return
            else:
                factor[a, a] = np.sqrt(value)
        for m in range(a):
            target[a] -= factor[a, m] * target[m]
        target[a] /= factor[a, a]
    share = 1.0
    for a in range(size - 1, -1, -1):
        for m in range(a + 1, size):
            target[a] -= factor[m, a] * target[m]
        target[a] /= factor[a, a]
        value = row[support[a]]
        if target[a] < 0:
            share = min(share, value / (value - target[a]))
    for a in range(size):
        j = support[a]
        row[j] = max(target[a] if share == 1 else row[j] + share * (target[a] - row[j]), 0.0)


@njit(cache=True, nogil=True)
def sweep_atoms(
    gram: NDArray[np.float64],
    product: NDArray[np.float64],
    atoms: NDArray[np.float64],
    sweeps: int,
    tol: float,
) -> None:
    """Lower ½ tr(DᵀGD) − tr(BᵀD) over D ≥ 0 with rows in the unit ball, in place, one exact row at a time.

    A row's quadratic is isotropic: its minimiser is the free one, clipped at zero, shrunk onto the ball.

    Parameters
    ----------
    gram
        ``(k, k)`` G, products of the codes.
    product
        ``(k, n_features)`` B, products of the codes with the samples.
    atoms
        ``(k, n_features)`` D, where to start; overwritten. Rows that no code uses stay.
    sweeps
        Most sweeps.
    tol
        Done when no row moves by more than this.
    """
    k, p = atoms.shape
    row = np.empty(p)
    for _ in range(sweeps):
        moved = 0.0
        for j in range(k):
            if gram[j, j] <= 0:
                continue
            row[:] = product[j]
            for m in range(k):
                if m != j and gram[j, m] != 0:
                    for q in range(p):
                        row[q] -= gram[j, m] * atoms[m, q]
            square = 0.0
            for q in range(p):
                row[q] = max(row[q] / gram[j, j], 0.0)
                square += row[q] * row[q]
            shrink = 1 / np.sqrt(square) if square > 1 else 1.0
            change = 0.0
            for q in range(p):
                new = row[q] * shrink
                change += (new - atoms[j, q]) ** 2
                atoms[j, q] = new
            moved = max(moved, change)
        if moved <= tol * tol:
            break
