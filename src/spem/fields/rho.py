"""Which ρ to sample: checked values, schemes, and a default range set by the shape's size."""

from __future__ import annotations

from collections.abc import Callable
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from spem.errors import ParameterError

Scheme = Literal["linear", "squared", "log"]

# ρ from 1 to 10 voxels of a shape of 60,000 voxels, in units of the shape's size L = volume^(1/d): the range
# that served best in retrieval, whatever the number of voxels.
DEFAULT_RANGE = (60_000 ** (-1 / 3), 10 * 60_000 ** (-1 / 3))
DEFAULT_COUNT = 64


def check_rho(rho: ArrayLike) -> NDArray[np.float64]:
    """Return ρ as a 1-D array; each must be positive, `inf` included.

    Raises
    ------
    ParameterError
        If there is none, or one is NaN, zero or negative.

    Examples
    --------
    >>> check_rho([1, float("inf")])
    array([ 1., inf])
    """
    try:
        values = np.atleast_1d(np.asarray(rho, np.float64))
    except (TypeError, ValueError) as error:
        msg = f"rho={rho!r}: expected positive numbers"
        raise ParameterError(msg) from error
    if values.ndim != 1 or values.size == 0:
        msg = (
            f"rho of shape {values.shape}: expected at least one positive number, in the unit of the spacing"
        )
        raise ParameterError(msg)
    bad = values[~(values > 0)]
    if bad.size:
        msg = f"rho={bad[0]:g}: expected a positive length in the unit of the spacing, or inf"
        raise ParameterError(msg)
    return values


def single_rho(rho: ArrayLike) -> float:
    """Return the one ρ that is given; it must be positive, `inf` included.

    Raises
    ------
    ParameterError
        If there is none or are several, or it is NaN, zero or negative.

    Examples
    --------
    >>> single_rho(2)
    2.0
    """
    values = check_rho(rho)
    if values.size != 1:
        msg = f"rho={rho!r}: expected one length in the unit of the spacing, or inf; got {values.size}"
        raise ParameterError(msg)
    return float(values[0])


def linear(low: float, high: float, count: int) -> NDArray[np.float64]:
    """Sample ρ evenly between two lengths (Fig. 2 of the paper)."""
    return np.linspace(low, high, count)


def squared(low: float, high: float, count: int) -> NDArray[np.float64]:
    """Sample ρ² evenly (2.2 as printed)."""
    return np.sqrt(np.linspace(low**2, high**2, count))


def log(low: float, high: float, count: int) -> NDArray[np.float64]:
    """Sample log ρ evenly."""
    return np.geomspace(low, high, count)


SCHEMES: dict[str, Callable[[float, float, int], NDArray[np.float64]]] = {
    "linear": linear,
    "squared": squared,
    "log": log,
}


def sample_rho(
    size: float,
    low: float | None = None,
    high: float | None = None,
    count: int = DEFAULT_COUNT,
    scheme: Scheme = "linear",
) -> NDArray[np.float64]:
    """Sample ρ for a shape.

    Parameters
    ----------
    size
        The shape's size L = volume^(1/d), which sets the bounds that are not given.
    low, high
        Bounds in the unit of the spacing.
    count
        Number of samples.
    scheme
        ``"linear"`` in ρ, ``"squared"`` (linear in ρ²) or ``"log"``.

    Examples
    --------
    >>> sample_rho(100.0, 2, 8, 4).tolist()
    [2.0, 4.0, 6.0, 8.0]
    >>> sample_rho(39.149, count=3).round(2).tolist()
    [1.0, 5.5, 10.0]
    """
    if scheme not in SCHEMES:
        msg = f"scheme={scheme!r}: expected one of {', '.join(map(repr, SCHEMES))}"
        raise ParameterError(msg)
    if count < 1:
        msg = f"count={count}: expected at least one ρ"
        raise ParameterError(msg)
    bounds = check_rho(
        [DEFAULT_RANGE[0] * size if low is None else low, DEFAULT_RANGE[1] * size if high is None else high]
    )
    if not np.all(np.isfinite(bounds)) or bounds[0] >= bounds[1]:
        msg = f"rho from {bounds[0]:g} to {bounds[1]:g}: expected finite bounds in ascending order"
        raise ParameterError(msg)
    return SCHEMES[scheme](float(bounds[0]), float(bounds[1]), count)
