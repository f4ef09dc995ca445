"""Descent of the sparse coding objective (4.3): codes and atoms in turn, extrapolated while it falls."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.sparse
from numpy.typing import NDArray

from spem.decomposition.coding_kernels import sweep_atoms, sweep_codes

_ROWS = 256  # samples whose residual is held at a time
_CANCELLED = 1e-3  # share of ½‖X‖² below which the objective is summed from residuals
_WINDOW = 5  # iterations over which the fall is judged
_INNER_SWEEPS, _INNER_TOL = 50, 1e-3
_EXACT_SWEEPS, _EXACT_TOL = 100_000, 1e-12
# Extrapolation: first step, largest growth of the step and of its bound, division after a failure.
_STEP, _GROW, _GROW_BOUND, _FAIL = 0.5, 1.05, 1.01, 1.5


@dataclass(frozen=True, eq=False)
class Coding:
    """A non-negative factorisation X ≈ CD with its objective.

    Parameters
    ----------
    atoms
        ``(k, n_features)`` D.
    codes
        ``(n_samples, k)`` C.
    path
        Objective after each outer iteration; never rises.
    converged
        Whether the tolerance was met within the iterations allowed.
    """

    atoms: NDArray[np.float64]
    codes: NDArray[np.float64]
    path: NDArray[np.float64]
    converged: bool


def objective(X: Any, atoms: NDArray[np.float64], codes: NDArray[np.float64], sparsity: float) -> float:
    """Return ½‖X − CD‖² + λ ΣC of (4.3), summed from the residuals themselves.

    Parameters
    ----------
    X
        ``(n_samples, n_features)`` samples, an array or a CSR matrix.
    atoms, codes
        D and C.
    sparsity
        λ.

    Examples
    --------
    >>> objective(np.eye(2), np.array([[1.0, 0.0]]), np.array([[1.0], [0.0]]), 0.25)
    0.75
    """
    return 0.5 * float(residual_squares(X, atoms, codes).sum()) + sparsity * float(codes.sum())


def residual_squares(
    X: Any, atoms: NDArray[np.float64], codes: NDArray[np.float64], *, positive: bool = False
) -> NDArray[np.float64]:
    """Return ``(n_samples,)`` squared norms of the rows of X − CD, or of their positive parts."""
    squares = np.empty(X.shape[0])
    for start in range(0, X.shape[0], _ROWS):
        block = slice(start, start + _ROWS)
        rest = _dense(X[block]) - codes[block] @ atoms
        if positive:
            np.maximum(rest, 0, out=rest)
        squares[block] = np.einsum("ij,ij->i", rest, rest)
    return squares


def encode(X: Any, atoms: NDArray[np.float64], sparsity: float) -> NDArray[np.float64]:
    """Return ``(n_samples, k)`` codes: the non-negative lasso of each row of X on the atoms."""
    codes = np.zeros((X.shape[0], len(atoms)))
    _solve_codes(X, atoms, sparsity, codes)
    return codes


def descend(X: Any, atoms: NDArray[np.float64], sparsity: float, max_iter: int, tol: float) -> Coding:
    """Lower (4.3) from given atoms until five iterations lower it by less than `tol` of it."""
    half = 0.5 * _square_sum(X)
    best = (atoms, np.zeros((X.shape[0], len(atoms))))
    ahead = best
    path = [half]
    step, bound = _STEP, 1.0
    for _ in range(max_iter):
        new, beyond, value = _iterate(X, best, ahead, step if len(path) > 1 else 0.0, sparsity, half)
        if value > path[-1]:
            bound, step, ahead = step, step / _FAIL, best
            path.append(path[-1])
        else:
            step, bound = min(bound, _GROW * step), min(1.0, _GROW_BOUND * bound)
            best, ahead = new, beyond
            path.append(value)
        if len(path) > _WINDOW and path[-1 - _WINDOW] - path[-1] <= tol * path[-1]:
            break
    return _finish(X, best, sparsity, path, len(path) <= max_iter)


def _iterate(
    X: Any,
    best: tuple[NDArray[np.float64], NDArray[np.float64]],
    ahead: tuple[NDArray[np.float64], NDArray[np.float64]],
    step: float,
    sparsity: float,
    half: float,
) -> tuple[Any, Any, float]:
    """Return the next atoms and codes, those to go on from, and the objective of the former."""
    atoms, codes = ahead[0], ahead[1].copy()
    sweep_codes(atoms @ atoms.T, X @ atoms.T, sparsity, codes, _INNER_SWEEPS, _INNER_TOL)
    codes = np.maximum(codes + step * (codes - best[1]), 0)
    gram, product = codes.T @ codes, np.ascontiguousarray(_dense((X.T @ codes).T))
    atoms = atoms.copy()
    sweep_atoms(gram, product, atoms, _INNER_SWEEPS, _INNER_TOL)
    value = half - np.vdot(product, atoms) + 0.5 * np.vdot(gram, atoms @ atoms.T)
    if value < _CANCELLED * half:
        value = 0.5 * residual_squares(X, atoms, codes).sum()
    beyond = np.maximum(atoms + step * (atoms - best[0]), 0)
    beyond /= np.maximum(np.linalg.norm(beyond, axis=1, keepdims=True), 1)
    return (atoms, codes), (beyond, codes), float(value + sparsity * codes.sum())


def _finish(
    X: Any,
    best: tuple[NDArray[np.float64], NDArray[np.float64]],
    sparsity: float,
    path: list[float],
    converged: bool,
) -> Coding:
    """Bring atoms to unit norm, which never raises the objective, and solve for their codes exactly."""
    atoms, codes = best
    norms = np.linalg.norm(atoms, axis=1)
    norms[norms == 0] = 1
    atoms, codes = atoms / norms[:, None], codes * norms
    _solve_codes(X, atoms, sparsity, codes)
    path[-1] = objective(X, atoms, codes, sparsity)
    return Coding(atoms, codes, np.array(path[1:]), converged)


def _solve_codes(X: Any, atoms: NDArray[np.float64], sparsity: float, codes: NDArray[np.float64]) -> None:
    """Improve the codes in place to the exact minimum."""
    sweep_codes(atoms @ atoms.T, _dense(X @ atoms.T), sparsity, codes, _EXACT_SWEEPS, _EXACT_TOL)


def _dense(X: Any) -> NDArray[np.float64]:
    """Return an array of a sparse or dense matrix."""
    return np.asarray(X.toarray() if scipy.sparse.issparse(X) else X)


def _square_sum(X: Any) -> float:
    """Return ‖X‖²."""
    data = X.data if scipy.sparse.issparse(X) else X
    return float(np.vdot(data, data))
