"""Shapes with exact cuts and, where `closed_forms` has them, known fields.

All are centred on the coordinate origin. `offset` shifts the grid under the shape, in edges, so
that a convergence study need not be lucky with the position of its voxel centres.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from spem.errors import ParameterError
from spem.shapes.implicit import implicit_shape
from spem.shapes.shape import Shape

__all__ = [
    "annulus",
    "ball",
    "box",
    "disk",
    "implicit_shape",
    "interval",
    "n_ball",
    "shell",
    "star_polygon",
]

Offset = float | tuple[float, ...]


def interval(length: float, spacing: float, *, offset: Offset = 0.0) -> Shape:
    """Return the interval of given length on the line.

    Parameters
    ----------
    length
        Length of the interval.
    spacing
        Distance between voxel centres.
    offset
        Shift of the grid, in edges.

    Examples
    --------
    >>> interval(1.0, 0.25, offset=0.5).points.ravel().tolist()
    [-0.375, -0.125, 0.125, 0.375]
    """
    return box((length,), spacing, name="interval", offset=offset)


def box(
    lengths: tuple[float, ...],
    spacing: float | tuple[float, ...],
    *,
    name: str = "box",
    offset: Offset = 0.0,
) -> Shape:
    """Return the box of given side lengths, in as many dimensions.

    Parameters
    ----------
    lengths
        ``(d,)`` side lengths.
    spacing
        Distance between voxel centres, one for all axes or one per axis.
    name
        Short name.
    offset
        Shift of the grid, in edges.

    Raises
    ------
    ParameterError
        If there is no side length, or one is not positive.

    Examples
    --------
    >>> box((1.0, 2.0), 0.25, offset=0.5)
    Shape('box', 2-D, 32 nodes, grid 6 x 10, spacing 0.25 x 0.25)
    """
    half = np.atleast_1d(np.asarray(lengths, float)) / 2
    if half.ndim != 1 or not half.size:
        msg = f"{name}: lengths={lengths}: expected one side length per axis, of one axis or more"
        raise ParameterError(msg)
    _check_positive(name, lengths=float(half.min()))
    return implicit_shape(
        lambda x: np.asarray((half - np.abs(x)).min(axis=1)), -half, half, spacing, name=name, offset=offset
    )


def disk(radius: float, spacing: float | tuple[float, ...], *, offset: Offset = 0.0) -> Shape:
    """Return the disk of given radius.

    Parameters
    ----------
    radius
        Radius of the disk.
    spacing
        Distance between voxel centres, one for both axes or one per axis.
    offset
        Shift of the grid, in edges.

    Examples
    --------
    >>> disk(1.0, 0.1)
    Shape('disk', 2-D, 305 nodes, grid 21 x 21, spacing 0.1 x 0.1)
    """
    return n_ball(radius, spacing, 2, name="disk", offset=offset)


def ball(radius: float, spacing: float | tuple[float, ...], *, offset: Offset = 0.0) -> Shape:
    """Return the ball of given radius in space.

    Parameters
    ----------
    radius
        Radius of the ball.
    spacing
        Distance between voxel centres, one for all axes or one per axis.
    offset
        Shift of the grid, in edges.

    Examples
    --------
    >>> ball(1.0, 0.2).ndim
    3
    """
    return n_ball(radius, spacing, 3, name="ball", offset=offset)


def n_ball(
    radius: float,
    spacing: float | tuple[float, ...],
    ndim: int,
    *,
    name: str | None = None,
    offset: Offset = 0.0,
) -> Shape:
    """Return the ball of given radius in any dimension.

    Parameters
    ----------
    radius
        Radius of the ball.
    spacing
        Distance between voxel centres, one for all axes or one per axis.
    ndim
        Dimension of the space, at least 1.
    name
        Short name; the dimension and "ball" by default.
    offset
        Shift of the grid, in edges.

    Examples
    --------
    >>> n_ball(1.0, 0.4, 4).name
    '4-ball'
    """
    name = name or f"{ndim}-ball"
    _check_positive(name, radius=radius, ndim=ndim)
    _check_whole(name, ndim=ndim)
    corner = np.full(int(ndim), float(radius))
    return implicit_shape(
        lambda x: np.asarray(radius - _norm(x)), -corner, corner, spacing, name=name, offset=offset
    )


def annulus(inner: float, outer: float, spacing: float | tuple[float, ...], *, offset: Offset = 0.0) -> Shape:
    """Return the ring between two concentric circles.

    Parameters
    ----------
    inner, outer
        Radii of the circles.
    spacing
        Distance between voxel centres, one for both axes or one per axis.
    offset
        Shift of the grid, in edges.

    Examples
    --------
    >>> annulus(0.5, 1.0, 0.1).name
    'annulus'
    """
    return _hollow("annulus", inner, outer, spacing, 2, offset)


def shell(inner: float, outer: float, spacing: float | tuple[float, ...], *, offset: Offset = 0.0) -> Shape:
    """Return the region between two concentric spheres.

    Parameters
    ----------
    inner, outer
        Radii of the spheres.
    spacing
        Distance between voxel centres, one for all axes or one per axis.
    offset
        Shift of the grid, in edges.

    Examples
    --------
    >>> shell(0.5, 1.0, 0.2).ndim
    3
    """
    return _hollow("shell", inner, outer, spacing, 3, offset)


def star_polygon(
    n: int,
    skip: int = 4,
    radius: float = 1.0,
    spacing: float = 0.02,
    *,
    offset: Offset = 0.0,
) -> Shape:
    """Return the regular star polygon {n/skip}, filled by the nonzero rule.

    Its vertices stand on a circle, each joined to the one `skip` places on; the first lies toward
    lower indices of axis 0, the top of a picture.

    Parameters
    ----------
    n
        Number of vertices, more than ``2 * skip``.
    skip
        Places from a vertex to the one it is joined to, at least 1 (a convex polygon).
    radius
        Radius of the circle.
    spacing
        Distance between voxel centres.
    offset
        Shift of the grid, in edges.

    Raises
    ------
    ParameterError
        If there are too few vertices, or no whole number of them.

    Examples
    --------
    >>> star_polygon(9).name
    'star 9/4'
    """
    name = f"star {n}/{skip}"
    _check_positive(name, radius=radius, skip=skip)
    _check_whole(name, n=n, skip=skip)
    if n <= 2 * skip:
        msg = f"{name}: n must be above 2 * skip = {2 * skip}, not {n}"
        raise ParameterError(msg)
    sector, normal = 2 * np.pi / n, np.pi * skip / n

    def level(x: NDArray[np.float64]) -> NDArray[np.float64]:
        # In the half sector beside a vertex the outline is one side of the polygon, whose distance
        # from the centre is radius * cos(π skip / n); the rest is symmetric.
        angle = np.arctan2(x[:, 1], -x[:, 0])
        folded = np.abs(angle - sector * np.round(angle / sector))
        return np.asarray(radius * np.cos(normal) - _norm(x) * np.cos(folded - normal))

    corner = np.full(2, float(radius))
    return implicit_shape(level, -corner, corner, spacing, name=name, offset=offset)


def _hollow(
    name: str,
    inner: float,
    outer: float,
    spacing: float | tuple[float, ...],
    ndim: int,
    offset: Offset,
) -> Shape:
    """Return the region between two concentric spheres of any dimension."""
    _check_positive(name, inner=inner, thickness=outer - inner)
    corner = np.full(ndim, float(outer))

    def level(x: NDArray[np.float64]) -> NDArray[np.float64]:
        r = _norm(x)
        return np.minimum(r - inner, outer - r)

    return implicit_shape(level, -corner, corner, spacing, name=name, offset=offset)


def _norm(x: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the distances of points from the origin."""
    return np.asarray(np.sqrt(np.einsum("nd,nd->n", x, x)))


def _check_positive(name: str, **sizes: Any) -> None:
    """Refuse sizes that are not positive."""
    for what, size in sizes.items():
        if not isinstance(size, (int, float, np.integer, np.floating)) or not 0 < size < np.inf:
            msg = f"{name}: {what} must be positive and finite, not {size}"
            raise ParameterError(msg)


def _check_whole(name: str, **counts: float) -> None:
    """Refuse counts that are not whole."""
    for what, count in counts.items():
        if not float(count).is_integer():
            msg = f"{name}: {what} must be a whole number, not {count}"
            raise ParameterError(msg)
