"""Which ρ, sources and nodes of a hyperfield are asked for, as positions along its axes."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from spem.errors import ParameterError
from spem.fields.rho import check_rho

Index = NDArray[np.int64]
# Two ρ are the same sample within rounding.
_SAME = 1e-9


def samples(sampled: NDArray[np.float64], rho: ArrayLike | None, name: str) -> Index:
    """Return positions of ρ among the samples; of all for None.

    Raises
    ------
    ParameterError
        If one is no positive length, or not sampled.

    Examples
    --------
    >>> samples(np.array([1.0, 2.0, np.inf]), [np.inf, 1.0], "disk")
    array([2, 0])
    """
    if rho is None:
        return np.arange(sampled.size)
    wanted = check_rho(rho)
    with np.errstate(invalid="ignore"):
        same = np.isclose(wanted[:, None], sampled, rtol=_SAME, atol=0.0)
    found = same.any(axis=1)
    if not found.all():
        span = f"{sampled.size} from {sampled.min():g} to {sampled.max():g}"
        msg = f"rho={wanted[np.argmin(found)]:g}: {name} is sampled at {span}; see rho of the hyperfield"
        raise ParameterError(msg)
    position = same.argmax(axis=1)
    return np.asarray(position[0] if np.ndim(rho) == 0 else position)


def numbers(count: int, wanted: ArrayLike | slice | None, what: str) -> Index:
    """Return sources or nodes as numbers from 0 to count - 1; all of them for None.

    Raises
    ------
    ParameterError
        If one is out of range or no whole number.

    Examples
    --------
    >>> numbers(5, slice(None, None, 2), "sources"), numbers(5, -1, "nodes")
    (array([0, 2, 4]), array(4))
    """
    if wanted is None:
        return np.arange(count)
    key = wanted if isinstance(wanted, slice) else np.asarray(wanted)
    if not isinstance(key, slice) and key.size == 0:  # an empty list is an array of floats
        return np.arange(0)
    if not isinstance(key, slice) and key.ndim > 1:
        msg = f"{what} of shape {key.shape}: expected one number, several in a row, or a slice"
        raise ParameterError(msg)
    try:
        return np.asarray(np.arange(count)[key])
    except (IndexError, TypeError) as error:
        msg = f"{what}={wanted!r}: expected numbers from 0 to {count - 1} ({error})"
        raise ParameterError(msg) from error
