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
_EXPLAINED = 1e-24  # share of ½‖X‖² that counts as nothing: residuals of 1e-12
_WINDOW = 5  # iterations over which the fall is judged
_INNER_SWEEPS, _INNER_TOL = 50, 1e-3
_EXACT_SWEEPS, _EXACT_TOL = 10_000, 1e-12
# Extrapolation: first step, growth of the step and of its bound after a success, division after a failure.
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


@dataclass(frozen=True, eq=False)
class _Pair:
    """Atoms and codes on the way."""

    atoms: NDArray[np.float64]
    codes: NDArray[np.float64]


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


def residual_squares(X: Any, atoms: NDArray[np.float64], codes: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the ``(n_samples,)`` squared norms of the rows of X − CD."""
    return _squares(X, _Pair(atoms, codes), positive=False)


def encode(X: Any, atoms: NDArray[np.float64], sparsity: float) -> NDArray[np.float64]:
    """Return the ``(n_samples, k)`` codes of samples: the non-negative lasso of each on the atoms."""
    codes = np.zeros((X.shape[0], len(atoms)))
    sweep_codes(atoms @ atoms.T, _times(X, atoms.T), sparsity, codes, _EXACT_SWEEPS, _EXACT_TOL)
    return codes


def descend(X: Any, atoms: NDArray[np.float64], sparsity: float, max_iter: int, tol: float) -> Coding:
    """Lower (4.3) from given atoms until five iterations lower it by no more than `tol` of it.

    The scheme is block descent with extrapolation: from the current point plus a share of the last change,
    minimise over the codes, extrapolate them, minimise over the atoms. What does not lower the objective
    is dropped, and the share shrinks. At the end, components that no sample uses are put where they
    lower the objective, if there is such a place, and the descent goes on.

    Parameters
    ----------
    X
        ``(n_samples, n_features)`` samples, an array or a CSR matrix; float32 for products in float32.
    atoms
        ``(k, n_features)`` where to start.
    sparsity
        λ.
    max_iter
        Most iterations.
    tol
        Share of the objective.
    """
    half = 0.5 * _square_sum(X)
    best = ahead = _Pair(atoms, np.zeros((X.shape[0], len(atoms))))
    path = [half]
    share, bound, revivals, restart = 0.0, 1.0, len(atoms), 0
    converged = False
    for _ in range(max_iter):
        new, beyond, value = _iterate(X, best, ahead, share, sparsity, half)
        if value > path[-1]:
            bound, share, ahead = share, share / _FAIL, best
            path.append(path[-1])
        else:
            share = min(bound, _GROW * share) if share else _STEP
            bound = min(1.0, _GROW_BOUND * bound)
            best, ahead = new, beyond
            path.append(value)
        if _settled(path[restart:], tol, half):
            revived = _revive(X, best, sparsity) if revivals else None
            if revived is None:
                converged = True
                break
            best = ahead = revived
            revivals, restart, share = revivals - 1, len(path) - 1, 0.0
    return _finish(X, best, sparsity, path, converged=converged)


def _iterate(
    X: Any, best: _Pair, ahead: _Pair, share: float, sparsity: float, half: float
) -> tuple[_Pair, _Pair, float]:
    """Return the next point, the point extrapolated from it, and the objective of the former."""
    codes = ahead.codes.copy()
    sweep_codes(
        ahead.atoms @ ahead.atoms.T, _times(X, ahead.atoms.T), sparsity, codes, _INNER_SWEEPS, _INNER_TOL
    )
    codes = np.maximum(codes + share * (codes - best.codes), 0)
    gram, product = codes.T @ codes, np.ascontiguousarray(_times(X.T, codes).T)
    atoms = ahead.atoms.copy()
    sweep_atoms(gram, product, atoms, _INNER_SWEEPS, _INNER_TOL)
    new = _Pair(atoms, codes)
    value = half - np.vdot(product, atoms) + 0.5 * np.vdot(gram, atoms @ atoms.T)
    if value < _CANCELLED * half:
        value = 0.5 * _squares(X, new, positive=False).sum()
    further = np.maximum(atoms + share * (atoms - best.atoms), 0)
    further /= np.maximum(np.linalg.norm(further, axis=1, keepdims=True), 1)
    return new, _Pair(further, codes), float(value + sparsity * codes.sum())


def _settled(path: list[float], tol: float, half: float) -> bool:
    """Say whether the last iterations lowered the objective too little to go on."""
    if path[-1] <= _EXPLAINED * half:
        return True
    return len(path) > _WINDOW and path[-1 - _WINDOW] - path[-1] <= tol * path[-1]


def _revive(X: Any, pair: _Pair, sparsity: float) -> _Pair | None:
    """Give the first unused component the sample it helps most, or return None if there is none to help.

    An atom can help a sample only if the positive part of its residual is longer than λ, and that part is
    the atom which helps it most.
    """
    unused = np.flatnonzero(~pair.codes.any(axis=0))
    if unused.size == 0:
        return None
    length = np.sqrt(_squares(X, pair, positive=True))
    sample = int(np.argmax(length))
    if length[sample] <= sparsity + np.sqrt(_EXPLAINED * _square_sum(X)):
        return None
    atoms, codes = pair.atoms.copy(), pair.codes.copy()
    rest = _dense(X[[sample]])[0] - codes[sample] @ atoms
    atoms[unused[0]] = np.maximum(rest, 0) / length[sample]
    codes[sample, unused[0]] = length[sample] - sparsity
    return _Pair(atoms, codes)


def _finish(X: Any, best: _Pair, sparsity: float, path: list[float], *, converged: bool) -> Coding:
    """Bring atoms to unit norm, which never raises the objective, and solve for their codes exactly."""
    norms = np.linalg.norm(best.atoms, axis=1)
    norms[norms == 0] = 1
    atoms, codes = best.atoms / norms[:, None], best.codes * norms
    sweep_codes(atoms @ atoms.T, _times(X, atoms.T), sparsity, codes, _EXACT_SWEEPS, _EXACT_TOL)
    path[-1] = objective(X, atoms, codes, sparsity)
    # the last value is summed in another order; the ones before it yield if they differ by rounding
    return Coding(atoms, codes, np.maximum(path[1:], path[-1]), converged)


def _squares(X: Any, pair: _Pair, *, positive: bool) -> NDArray[np.float64]:
    """Return the squared norms of the rows of X − CD, or of their positive parts."""
    squares = np.empty(X.shape[0])
    atoms, codes = pair.atoms.astype(X.dtype, copy=False), pair.codes.astype(X.dtype, copy=False)
    for start in range(0, X.shape[0], _ROWS):
        block = slice(start, start + _ROWS)
        rest = _dense(X[block]) - codes[block] @ atoms
        if positive:
            np.maximum(rest, 0, out=rest)
        squares[block] = np.einsum("ij,ij->i", rest, rest)
    return squares


def _times(X: Any, factor: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return a product with the samples in their precision, as float64."""
    return np.asarray(X @ factor.astype(X.dtype, copy=False), np.float64)


def _dense(X: Any) -> NDArray[Any]:
    """Return an array of a sparse or dense matrix."""
    return np.asarray(X.toarray() if scipy.sparse.issparse(X) else X)


def _square_sum(X: Any) -> float:
    """Return ‖X‖²."""
    data = X.data if scipy.sparse.issparse(X) else X
    return float(np.square(data, dtype=np.float64).sum())
