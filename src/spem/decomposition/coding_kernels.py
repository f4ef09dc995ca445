"""Inner sweeps of sparse coding: one block against the other's Gram matrix, without touching the data."""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray


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
    for i in range(n):
        for j in range(k):
            slope[j] = sparsity - product[i, j]
        for j in range(k):
            if codes[i, j] != 0:
                for m in range(k):
                    slope[m] += gram[j, m] * codes[i, j]
        for _ in range(sweeps):
            moved, largest = 0.0, 0.0
            for j in range(k):
                if gram[j, j] <= 0:
                    continue
                new = max(codes[i, j] - slope[j] / gram[j, j], 0.0)
                step = new - codes[i, j]
                if step != 0:
                    codes[i, j] = new
                    for m in range(k):
                        slope[m] += gram[j, m] * step
                    moved = max(moved, abs(step))
                largest = max(largest, new)
            if moved <= tol * largest:
                break


@njit(cache=True, nogil=True)
def sweep_atoms(
    gram: NDArray[np.float64],
    product: NDArray[np.float64],
    atoms: NDArray[np.float64],
    sweeps: int,
    tol: float,
) -> None:
    """Lower ½ tr(DᵀGD) − tr(BᵀD) over D ≥ 0 with rows in the unit ball, in place, one exact row at a time.

    A row's minimiser is isotropic: clip the free one at zero, then shrink it onto the ball.

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
