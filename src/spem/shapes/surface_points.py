"""Points spread evenly over a triangle surface, whatever the sizes of its faces."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from spem.errors import ParameterError, ShapeError
from spem.shapes.surface import Surface

# Steps of the sequence of least discrepancy in the plane: powers of 1 / x, x³ = x + 1.
_STRIDES = np.array([0.7548776662466927, 0.5698402909980532])


@dataclass(frozen=True, eq=False)
class SurfacePoints:
    """Points of a surface, each by the corners of its face.

    Parameters
    ----------
    corners
        ``(n_points, 3)`` vertices of the face of each point.
    weights
        ``(n_points, 3)`` barycentric coordinates, which sum to one.
    """

    corners: NDArray[np.int64]
    weights: NDArray[np.float64]

    def interpolate(self, values: ArrayLike) -> NDArray[np.float64]:
        """Interpolate values of the vertices, ``(n_vertices, ...)``, linearly: ``(n_points, ...)``."""
        at_vertices = np.asarray(values)
        one, two, three = self.corners.T
        a, b, c = self.weights.T.reshape(3, -1, *(1,) * (at_vertices.ndim - 1))
        return np.asarray(a * at_vertices[one] + b * at_vertices[two] + c * at_vertices[three])


def spread_points(surface: Surface, count: int) -> SurfacePoints:
    """Spread points over a surface, as many on each part of it as its share of the area.

    They are the same whenever asked for: equal steps of area from face to face, small faces first, and within
    faces a sequence of low discrepancy. In what order faces and their corners stand does not matter, but for
    faces of one size.

    Parameters
    ----------
    surface
        The surface.
    count
        Number of points.

    Raises
    ------
    ParameterError
        When `count` is below 1.
    ShapeError
        When the surface has no area.

    Examples
    --------
    >>> corners = np.array([[0.0, 0, 0], [3, 0, 0], [0, 3, 0], [0, 0, 3]])
    >>> surface = Surface(corners, np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]))
    >>> spread_points(surface, 1000).interpolate(corners).mean(axis=0).round(2)
    array([0.79, 0.79, 0.79])
    """
    if count < 1:
        msg = f"count={count}: expected at least 1 point"
        raise ParameterError(msg)
    faces, areas = _ordered(surface)
    reach = np.cumsum(areas)
    if not reach[-1] > 0:
        msg = "the surface has no area; no points can be spread over it"
        raise ShapeError(msg)
    face = np.searchsorted(reach, (np.arange(count) + 0.5) / count * reach[-1])
    side, along = (np.arange(1, count + 1)[:, None] * _STRIDES % 1.0).T
    root = np.sqrt(side)
    weights = np.stack([1 - root, root * (1 - along), root * along], axis=1)
    return SurfacePoints(faces[face], weights)


def _ordered(surface: Surface) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Return faces by size, each from the corner across its longest edge, and their areas."""
    corners = surface.vertices[surface.faces]
    across = _steps(np.linalg.norm(np.roll(corners, -1, axis=1) - np.roll(corners, 1, axis=1), axis=2))
    place = (across.argmax(axis=1)[:, None] + np.arange(3)) % 3
    order = np.lexsort((across.max(axis=1), _steps(surface.face_areas)))
    return np.take_along_axis(surface.faces, place, axis=1)[order], surface.face_areas[order]


def _steps(sizes: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return sizes in whole steps, so that rounding does not tell equal ones apart."""
    return np.asarray(np.rint(sizes / max(sizes.max(), np.finfo(np.float64).tiny) * 2**20))
