"""Fields that are known in closed form: balls and shells of any dimension.

A radial solution of Δv = v/ρ² in dimension d is r^(-ν) times a modified Bessel function of order
ν = d/2 − 1 of r/ρ. Scaled Bessel functions keep every factor in range for small ρ.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.special import gamma, ive, kve

from spem.errors import ParameterError

# Below this argument two terms of the power series are exact to rounding.
SERIES_LIMIT = 1e-4


def interval_field(points: ArrayLike, length: float, rho: ArrayLike) -> NDArray[np.float64]:
    """Return the field of the interval of given length about 0: cosh(x/ρ) / cosh(L/2ρ).

    Parameters
    ----------
    points
        ``(n,)`` or ``(n, 1)`` coordinates.
    length
        Length of the interval.
    rho
        One ρ, or an array of them; `inf` is allowed.

    Returns
    -------
    numpy.ndarray
        ``(n, *rho.shape)``

    Raises
    ------
    ParameterError
        If the length or a ρ is not positive, or the points are neither ``(n,)`` nor ``(n, 1)``.

    Examples
    --------
    >>> interval_field([0.0, 1.0], 2.0, 1.0).round(4).tolist()
    [0.6481, 1.0]
    """
    x = np.asarray(points, float)
    if x.ndim != 1 and x.shape[1:] != (1,):
        msg = f"points of an interval must be an array of shape (n,) or (n, 1), not {x.shape}"
        raise ParameterError(msg)
    return ball_field(x.reshape(-1, 1), length / 2, rho)


def ball_field(points: ArrayLike, radius: float, rho: ArrayLike) -> NDArray[np.float64]:
    """Return the field of the ball about 0 in the dimension of the points.

    In 1-D cosh(x/ρ)/cosh(R/ρ), in 2-D I0(r/ρ)/I0(R/ρ), in 3-D (R/r) sinh(r/ρ)/sinh(R/ρ), in 4-D
    (R/r) I1(r/ρ)/I1(R/ρ), and so on with ν = d/2 − 1.

    Parameters
    ----------
    points
        ``(n, d)`` coordinates.
    radius
        Radius R of the ball.
    rho
        One ρ, or an array of them; `inf` is allowed.

    Returns
    -------
    numpy.ndarray
        ``(n, *rho.shape)``

    Raises
    ------
    ParameterError
        If the radius or a ρ is not positive, or the points are not ``(n, d)``.

    Examples
    --------
    >>> v = ball_field([[0.0, 0.0, 0.0], [0.0, 1.0, 0.0]], 1.0, [0.5, np.inf])
    >>> v.round(4).tolist()
    [[0.5514, 1.0], [1.0, 1.0]]
    """
    r, scale, order = _radial(points, rho)
    _check_radii(0.0, radius)
    inner, outer = r / scale, radius / scale
    value = _growing(order, inner) / _growing(order, outer)
    return np.asarray(value * np.exp(inner - outer))


def shell_field(points: ArrayLike, inner: float, outer: float, rho: ArrayLike) -> NDArray[np.float64]:
    """Return the field between two concentric spheres about 0, in the dimension of the points.

    The combination of r^(-ν) I_ν(r/ρ) and r^(-ν) K_ν(r/ρ) that is 1 on both spheres: I0 and K0 for
    the annulus, exp(±r/ρ)/r for the shell in 3-D.

    Parameters
    ----------
    points
        ``(n, d)`` coordinates, d ≥ 2, with ``inner <= |x| <= outer``.
    inner, outer
        Radii of the spheres.
    rho
        One ρ, or an array of them; `inf` is allowed.

    Returns
    -------
    numpy.ndarray
        ``(n, *rho.shape)``

    Raises
    ------
    ParameterError
        If the radii are not positive and in order, a ρ is not positive, or d < 2.

    Examples
    --------
    >>> shell_field([[1.0, 0.0], [1.5, 0.0], [2.0, 0.0]], 1.0, 2.0, 0.25).round(4).tolist()
    [1.0, 0.2638, 1.0]
    """
    r, scale, order = _radial(points, rho)
    _check_radii(inner, outer)
    if order < 0 or inner <= 0:
        msg = f"a shell needs 2 dimensions or more and an inner radius above 0, not {inner}"
        raise ParameterError(msg)
    finite = np.where(np.isinf(scale), 1.0, scale)
    x, a, b = r / finite, inner / finite, outer / finite
    grow = [_growing(order, s) for s in (x, a, b)]
    decay = [s ** (-order) * kve(order, s) for s in (x, a, b)]
    gap = np.exp(a - b)
    # exp(b − a) is divided out of numerator and denominator, so no factor overflows.
    up = grow[0] * np.exp(x - b) * (decay[1] - decay[2] * gap)
    down = decay[0] * np.exp(a - x) * (grow[2] - grow[1] * gap)
    value = (up + down) / (grow[2] * decay[1] - grow[1] * decay[2] * gap**2)
    return np.where(np.isinf(scale), 1.0, value)


def _radial(points: ArrayLike, rho: ArrayLike) -> tuple[NDArray[np.float64], NDArray[np.float64], float]:
    """Return the radii ``(n, 1, ...)``, ρ, and the order ν, checked."""
    x, scale = np.asarray(points, float), np.asarray(rho, float)
    if x.ndim != 2 or x.shape[1] < 1:
        msg = f"points must be an array of shape (n, d), not {x.shape}"
        raise ParameterError(msg)
    if not np.all(scale > 0):
        msg = f"rho must be positive, not {scale[~(scale > 0)].ravel()[0]}"
        raise ParameterError(msg)
    r = np.linalg.norm(x, axis=1).reshape(-1, *(1,) * scale.ndim)
    return r, scale, x.shape[1] / 2 - 1


def _check_radii(inner: float, outer: float) -> None:
    """Refuse radii that are out of order."""
    if not 0 <= inner < outer < np.inf:
        msg = f"radii must be positive and in order, not {inner} and {outer}"
        raise ParameterError(msg)


def _growing(order: float, x: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return Γ(ν+1) (x/2)^(-ν) I_ν(x) exp(−x), which is 1 at 0."""
    small = x < SERIES_LIMIT
    safe = np.where(small, 1.0, x)
    value = gamma(order + 1) * (safe / 2) ** (-order) * ive(order, safe)
    return np.where(small, (1 + x**2 / (4 * (order + 1))) * np.exp(-x), value)
