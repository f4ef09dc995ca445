"""Size as a control: how far size alone tells classes apart, and which shapes are of one size."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from spem.errors import ParameterError


def size_distance(volumes: ArrayLike) -> NDArray[np.float64]:
    """Return the distances between shapes of which nothing but the volume is known.

    Codes do not depend on size. Where classes differ in size, a ranking by it alone is what scores of codes
    are to be held against.

    Parameters
    ----------
    volumes
        ``(n,)`` volumes, of one unit.

    Returns
    -------
    numpy.ndarray
        ``(n, n)`` |log V_i − log V_j|.

    Raises
    ------
    ParameterError
        When a volume is not positive, or not known.

    Examples
    --------
    >>> size_distance([1.0, np.e, 1.0]).round(12).tolist()
    [[0.0, 1.0, 0.0], [1.0, 0.0, 1.0], [0.0, 1.0, 0.0]]
    """
    logs = np.log(_checked(volumes))
    return np.asarray(np.abs(logs[:, None] - logs))


def of_one_size(volumes: ArrayLike, factor: float) -> NDArray[np.bool_]:
    """Return which shapes are at most `factor` times as large or as small as each other.

    Parameters
    ----------
    volumes
        ``(n,)`` volumes, of one unit.
    factor
        Largest quotient of two volumes, at least 1.

    Returns
    -------
    numpy.ndarray
        ``(n, n)``, true where two shapes are of one size.

    Raises
    ------
    ParameterError
        When a volume is not positive, or not known, or the factor is below 1.

    Examples
    --------
    >>> of_one_size([1.0, 1.2, 4.0], 1.25)[0].tolist()
    [True, True, False]
    """
    if not 1 <= factor < np.inf:
        msg = f"factor={factor}: expected a finite number of at least 1, such as 1.25"
        raise ParameterError(msg)
    # the quotient of two volumes is rounded by a few units in the last place
    return np.asarray(size_distance(volumes) <= np.log(factor) + 1e-12)


def _checked(volumes: ArrayLike) -> NDArray[np.float64]:
    """Return volumes, all of them known."""
    values = np.asarray(volumes, float)
    if values.ndim != 1:
        msg = f"volumes of shape {values.shape}; expected one for each shape"
        raise ParameterError(msg)
    odd = np.flatnonzero(~(np.isfinite(values) & (values > 0)))
    if odd.size:
        msg = f"volumes: that of shape {odd[0]} is {values[odd[0]]:g}; encode it again to have its volume"
        raise ParameterError(msg)
    return values
