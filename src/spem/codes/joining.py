"""Codes of several kinds in one vector, whose correlation distance is the weighted sum of theirs."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from spem.errors import ParameterError

# A vector whose deviation from its mean is below this part of its length is constant to rounding.
CONSTANT = 1e-13
# With so many shapes weights are halfway between equal ones and the inverse spreads, in logarithms.
_FEW_SHAPES = 20


def join_codes(codes: Sequence[ArrayLike], weights: ArrayLike | None = None) -> NDArray[np.float64]:
    """Put codes of several kinds side by side, so that their correlation distances add up.

    Each code x is brought to mean zero and unit length and multiplied by √w, w being its share of the sum of
    the weights. The whole has mean zero and unit length, and of two shapes

        1 − corr([x; y], [x'; y']) = w (1 − corr(x, x')) + (1 − w) (1 − corr(y, y')).

    Parameters
    ----------
    codes
        For each kind ``(n_code,)`` the code of one shape, or ``(n_shapes, n_code)`` those of many.
    weights
        One number of at least 0 for each kind; equal by default.

    Returns
    -------
    numpy.ndarray
        ``(n_joined,)`` or ``(n_shapes, n_joined)``. A code that is constant gives zeros.

    Raises
    ------
    ParameterError
        When there is none, they differ in their shapes or are not finite, or weights do not fit.

    Examples
    --------
    >>> join_codes([[1.0, 0.0], [2.0, 0.0, 1.0]]).round(3)
    array([ 0.5, -0.5,  0.5, -0.5,  0. ])
    """
    arrays = [np.asarray(code, np.float64) for code in codes]
    if not arrays or len({array.shape[:-1] for array in arrays}) != 1 or arrays[0].ndim not in (1, 2):
        found = ", ".join(str(array.shape) for array in arrays) or "none"
        msg = f"codes to join have shapes {found}; give (n_code,) or (n_shapes, n_code) of the same shapes"
        raise ParameterError(msg)
    _require_finite(arrays)
    shares = _shares(weights, len(arrays))
    together = zip(shares, arrays, strict=True)
    return np.concatenate([np.sqrt(share) * standardised(array) for share, array in together], axis=-1)


def fusion_weights(codes: Sequence[ArrayLike]) -> NDArray[np.float64]:
    """Weigh kinds of codes by how far apart they hold the same shapes; no label enters.

    The weight of a kind is the inverse of the standard deviation of its correlation distances, so that in
    their sum no kind drowns another because its distances spread more. The spreads of a few shapes tell
    little: of n of them the power n / (n + 20) is taken, which leaves weights nearly equal.

    Parameters
    ----------
    codes
        For each kind ``(n_shapes, n_code)`` codes of the same shapes.

    Returns
    -------
    numpy.ndarray
        ``(n_kinds,)`` weights that sum to one; equal where distances of a kind do not differ.

    Raises
    ------
    ParameterError
        When there is none, they are not of the same number of shapes, or not finite.

    Examples
    --------
    >>> near, far = np.eye(3) + [1, 0, 0], [[1, 0, 0], [0.9, 0, 1], [0, 1, 0]]
    >>> fusion_weights([far, far])
    array([0.5, 0.5])
    """
    if not len(codes):
        msg = "no codes to weigh; give those of each kind"
        raise ParameterError(msg)
    arrays = [np.asarray(kind, np.float64) for kind in codes]
    if any(array.ndim != 2 or len(array) != len(arrays[0]) for array in arrays):
        found = ", ".join(str(array.shape) for array in arrays)
        msg = f"codes to weigh have shapes {found}; give (n_shapes, n_code) of the same shapes for each kind"
        raise ParameterError(msg)
    _require_finite(arrays)
    spreads = np.array([_spread(array) for array in arrays])
    if not (spreads > 0).all():
        return np.full(len(spreads), 1 / len(spreads))
    inverse = (spreads.min() / spreads) ** (len(arrays[0]) / (len(arrays[0]) + _FEW_SHAPES))
    return np.asarray(inverse / inverse.sum())


def _require_finite(codes: Sequence[NDArray[np.float64]]) -> None:
    """Refuse codes that are not finite: they would pass for constant ones."""
    for kind, array in enumerate(codes):
        if not np.isfinite(array).all():
            msg = f"codes of kind {kind} contain NaN or inf; they must be finite"
            raise ParameterError(msg)


def _spread(codes: NDArray[np.float64]) -> float:
    """Return the standard deviation of the correlation distances between different shapes."""
    unit = standardised(codes)
    pairs = (unit @ unit.T)[np.triu_indices(len(unit), 1)]
    return float(pairs.std()) if pairs.size else 0.0


def standardised(codes: NDArray[np.float64]) -> NDArray[np.float64]:
    """Bring vectors along the last axis to mean zero and unit length; constant ones to zeros.

    Examples
    --------
    >>> standardised(np.array([[1.0, 3.0], [2.0, 2.0]])).round(3)
    array([[-0.707,  0.707],
           [ 0.   ,  0.   ]])
    """
    # Dividing by the largest entry first keeps the squares in range.
    largest = np.abs(codes).max(axis=-1, keepdims=True, initial=0.0)
    x = codes / np.where(largest > 0, largest, 1.0)
    whole = np.linalg.norm(x, axis=-1, keepdims=True)
    x = x - x.mean(axis=-1, keepdims=True) if x.shape[-1] else x
    length = np.linalg.norm(x, axis=-1, keepdims=True)
    varied = length > CONSTANT * whole
    return np.asarray(np.where(varied, x / np.where(varied, length, 1.0), 0.0))


def _shares(weights: ArrayLike | None, count: int) -> NDArray[np.float64]:
    """Return weights that sum to one."""
    if weights is None:
        return np.full(count, 1 / count)
    given = np.asarray(weights, np.float64)
    if given.shape != (count,) or not np.isfinite(given).all() or (given < 0).any() or not given.sum() > 0:
        msg = f"weights={weights!r}: expected {count} numbers of at least 0, one a kind, not all 0"
        raise ParameterError(msg)
    return np.asarray(given / given.sum())
