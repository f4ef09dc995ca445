"""Shape contexts: where the rest of the contour lies, seen from each of its points (2-D).

Belongie, Malik, Puzicha, "Shape matching and object recognition using shape contexts", PAMI 24 (2002) count
the other points by distance and direction, in bins of equal size of log r and of angle; Ling, Jacobs, "Shape
classification using the inner-distance", PAMI 29 (2007) by the shortest way inside the shape and its
direction where it starts, which articulation leaves nearly as they are.
"""

from __future__ import annotations

from typing import Literal, get_args

import numpy as np
from numba import njit
from numpy.typing import NDArray

from spem.embedding.contour_ways import contour_ways
from spem.embedding.contours import ContourPoints, contour_points
from spem.errors import ParameterError
from spem.fields.operator import Boundary
from spem.shapes.shape import Shape

Array = NDArray[np.float64]
Frame = Literal["tangent", "fixed"]
# Distances that are told apart, in units of their mean.
_NEAREST, _FARTHEST = 0.125, 2.0


def shape_context(
    shape: Shape,
    n_points: int = 128,
    *,
    n_radii: int = 8,
    n_angles: int = 8,
    frame: Frame = "tangent",
    smoothing: float = 1.0,
    holes: bool = True,
    boundary: Boundary = "surface",
) -> Array:
    """Count the points of the contours by distance and direction from each, as Belongie et al. do.

    Distances are in units of their mean; nearer than 1/8 or farther than 2 count with those at the end. A
    point counts for its two nearest bins of distance and of direction, in proportion, so that counts move
    continuously with the contour. Translation and scale change nothing, nor does rotation with the frame of
    the tangent; a mirrored shape has the directions of its bins in reverse order.

    Parameters
    ----------
    shape
        A shape of two dimensions.
    n_points
        Number of points, spread by `spem.embedding.contours.contour_points`.
    n_radii
        Number of bins of distance; 5 in both publications.
    n_angles
        Number of bins of direction; 12 in both publications.
    frame
        Where directions are measured from: the tangent, with the shape on the left, or axis 0.
    smoothing, holes, boundary
        As `contour_points` takes them.

    Returns
    -------
    NDArray
        ``(n_points, n_radii * n_angles)`` shares of the other points, by distance, then direction; rows add
        up to 1.

    Raises
    ------
    ShapeError
        When the shape is not of two dimensions.
    ParameterError
        When a number is out of its range, or there is no such frame.

    Examples
    --------
    >>> from spem.shapes.synthetic import disk
    >>> seen = shape_context(disk(1.0, 0.02), 100)
    >>> seen.shape, bool(np.ptp(seen, axis=0).max() < 0.02)
    ((100, 64), True)
    """
    points = contour_points(shape, n_points, smoothing=smoothing, holes=holes, boundary=boundary)
    target = np.broadcast_to(np.arange(n_points, dtype=np.int32), (n_points, n_points))
    return _count(points, _straight(points), target, n_radii, n_angles, frame)


def inner_distance_shape_context(
    shape: Shape,
    n_points: int = 128,
    *,
    n_radii: int = 8,
    n_angles: int = 8,
    frame: Frame = "tangent",
    smoothing: float = 1.0,
    holes: bool = True,
    boundary: Boundary = "surface",
) -> Array:
    """Count the points of the contours by the ways to them inside the shape, as Ling and Jacobs do.

    As `shape_context`, with the length of the shortest way inside the polygon of the points and its direction
    where it starts. Of a convex shape both are the same. Points that no way leads to do not count.

    Parameters
    ----------
    shape
        A shape of two dimensions.
    n_points
        Number of points, spread by `spem.embedding.contours.contour_points`.
    n_radii
        Number of bins of distance; 5 in both publications.
    n_angles
        Number of bins of direction; 12 in both publications.
    frame
        Where directions are measured from: the tangent, with the shape on the left, or axis 0.
    smoothing, holes, boundary
        As `contour_points` takes them.

    Returns
    -------
    NDArray
        ``(n_points, n_radii * n_angles)`` shares of the points reached, by distance, then direction; rows add
        up to 1.

    Raises
    ------
    ShapeError
        When the shape is not of two dimensions.
    ParameterError
        When a number is out of its range, or there is no such frame.

    Examples
    --------
    >>> from spem.shapes.synthetic import disk
    >>> shape = disk(1.0, 0.02)
    >>> bool(np.allclose(inner_distance_shape_context(shape, 100), shape_context(shape, 100)))
    True
    """
    points = contour_points(shape, n_points, smoothing=smoothing, holes=holes, boundary=boundary)
    return _count(points, *contour_ways(points), n_radii, n_angles, frame)


def _straight(points: ContourPoints) -> Array:
    """Return the straight distances between points."""
    offset = points.position[None] - points.position[:, None]
    return np.asarray(np.hypot(offset[..., 0], offset[..., 1]))


def _count(
    points: ContourPoints,
    distance: Array,
    target: NDArray[np.int32],
    n_radii: int,
    n_angles: int,
    frame: Frame,
) -> Array:
    """Check the bins and count, in units of the mean distance between different points."""
    if frame not in get_args(Frame):
        msg = f"frame={frame!r}: expected one of {', '.join(get_args(Frame))}"
        raise ParameterError(msg)
    if n_radii < 1 or n_angles < 1:
        msg = f"n_radii={n_radii!r}, n_angles={n_angles!r}: expected at least one bin of each"
        raise ParameterError(msg)
    reached = np.isfinite(distance) & (distance > 0)
    unit = float(distance[reached].mean()) if reached.any() else 1.0
    axes = points.tangent if frame == "tangent" else np.broadcast_to([1.0, 0.0], points.tangent.shape)
    relative = distance / unit
    return np.asarray(_histograms(points.position, axes, relative, target, n_radii, n_angles))


@njit(cache=True, nogil=True)
def _histograms(
    position: Array, axes: Array, distance: Array, target: NDArray[np.int32], n_radii: int, n_angles: int
) -> Array:
    """Divide each point that is reached among the two nearest bins of log distance and of direction."""
    n = len(distance)
    result = np.zeros((n, n_radii, n_angles))
    per_radius = n_radii / np.log(_FARTHEST / _NEAREST)
    per_turn = n_angles / (2 * np.pi)
    for i in range(n):
        reached = 0
        for j in range(n):
            if i == j or not np.isfinite(distance[i, j]):
                continue
            reached += 1
            aim = target[i, j]
            x, y = position[aim, 0] - position[i, 0], position[aim, 1] - position[i, 1]
            angle = np.arctan2(axes[i, 0] * y - axes[i, 1] * x, axes[i, 0] * x + axes[i, 1] * y)
            far = np.log(max(distance[i, j], _NEAREST) / _NEAREST) * per_radius - 0.5
            turn, far = angle * per_turn, min(max(far, 0.0), n_radii - 1.0)
            a, b = int(np.floor(turn)), int(far)
            across, beyond = turn - a, far - b
            a %= n_angles
            c, d = (a + 1) % n_angles, min(b + 1, n_radii - 1)
            result[i, b, a] += (1 - beyond) * (1 - across)
            result[i, b, c] += (1 - beyond) * across
            result[i, d, a] += beyond * (1 - across)
            result[i, d, c] += beyond * across
        result[i] /= max(reached, 1)
    return result.reshape(n, n_radii * n_angles)
