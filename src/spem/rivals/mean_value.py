"""Mean value coordinates: what is known at the vertices of a closed surface, carried inside it."""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import ArrayLike, NDArray

from spem.errors import ParameterError
from spem.shapes.surface import Surface

Array = NDArray[np.float64]
# A triangle whose plane holds the point to this sine adds nothing; rounding would add as much as is left out.
_FLAT = 1e-8
_BLOCK_BYTES = 2**26


def mean_value_coordinates(surface: Surface, points: ArrayLike) -> Array:
    """Compute the mean value coordinates of points with respect to a closed triangle surface.

    The weight of a vertex is w_i = Σ n_i·m / (d_i det(u)) over its triangles: u are the unit vectors to the
    corners, d_i the distance to the vertex, n_i the cross product of the other two u and m the integral of
    the normal over the spherical triangle, ½ Σ θ_j n_j/|n_j|; coordinates are weights over their sum. They
    reproduce linear functions, in and outside (Ju, Schaefer and Warren, "Mean value coordinates for closed
    triangular meshes", ACM Trans. Graph. 24, 2005).

    Parameters
    ----------
    surface
        Closed, its faces turned alike. With holes, linear functions are reproduced but for what the holes
        take of the view.
    points
        ``(n_points, 3)`` anywhere; on the surface the coordinates are those of the face.

    Returns
    -------
    numpy.ndarray
        ``(n_points, n_vertices)``, rows sum to one.

    Raises
    ------
    ParameterError
        When the points are not of three coordinates.

    Examples
    --------
    >>> corners = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
    >>> tetrahedron = Surface(corners, np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]))
    >>> mean_value_coordinates(tetrahedron, [[0.1, 0.2, 0.3]]).round(6).tolist()
    [[0.4, 0.1, 0.2, 0.3]]
    """
    places = _points(points)
    weights = np.zeros((len(places), len(surface.vertices)))
    _weigh(places, surface.vertices, surface.faces, weights)
    return weights


def carry_inside(surface: Surface, values: ArrayLike, points: ArrayLike) -> Array:
    """Interpolate values at the vertices of a closed surface with mean value coordinates.

    Parameters
    ----------
    surface
        Closed, its faces turned alike.
    values
        ``(n_vertices, n_functions)``.
    points
        ``(n_points, 3)``.

    Returns
    -------
    numpy.ndarray
        ``(n_points, n_functions)``.

    Raises
    ------
    ParameterError
        When the points are not of three coordinates.

    Examples
    --------
    >>> corners = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
    >>> tetrahedron = Surface(corners, np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]))
    >>> carry_inside(tetrahedron, corners, [[0.1, 0.2, 0.3]]).round(6).tolist()
    [[0.1, 0.2, 0.3]]
    """
    places, known = _points(points), np.asarray(values, np.float64)
    step = max(1, _BLOCK_BYTES // (8 * len(surface.vertices)))
    blocks = [
        mean_value_coordinates(surface, places[first : first + step]) @ known
        for first in range(0, len(places), step)
    ]
    return np.concatenate(blocks) if blocks else np.empty((0, *known.shape[1:]))


def _points(points: ArrayLike) -> Array:
    """Check that points have three coordinates."""
    places = np.ascontiguousarray(points, np.float64)
    if places.ndim != 2 or places.shape[1] != 3:
        msg = f"points of shape {places.shape}: expected (n_points, 3)"
        raise ParameterError(msg)
    return places


@njit(cache=True, nogil=True)
def _weigh(points: Array, vertices: Array, faces: NDArray[np.int64], weights: Array) -> None:
    """Write the coordinates of each point to its row, which is zero before."""
    n = len(vertices)
    unit, distance = np.empty((n, 3)), np.empty(n)
    normal, mean, share = np.empty((3, 3)), np.empty(3), np.empty(3)  # made once: room for one face
    for p in range(len(points)):
        nearest = 0
        for i in range(n):
            for k in range(3):
                unit[i, k] = vertices[i, k] - points[p, k]
            distance[i] = math.sqrt(unit[i, 0] ** 2 + unit[i, 1] ** 2 + unit[i, 2] ** 2)
            if distance[i] < distance[nearest]:
                nearest = i
        if distance[nearest] <= 1e-14 * distance.max():
            weights[p, nearest] = 1.0
            continue
        for i in range(n):
            for k in range(3):
                unit[i, k] /= distance[i]
        for f in range(len(faces)):
            if _add_face(unit, distance, faces[f], weights[p], normal, mean, share):
                break
        weights[p] /= weights[p].sum()


@njit(cache=True, nogil=True)
def _add_face(
    unit: Array,
    distance: Array,
    face: NDArray[np.int64],
    weights: Array,
    normal: Array,
    mean: Array,
    share: Array,
) -> bool:
    """Add what a triangle gives to its corners; on it, give that alone and return True."""
    mean[:] = 0.0
    turn, largest = 0.0, 0.0
    for i in range(3):
        a, b = unit[face[(i + 1) % 3]], unit[face[(i + 2) % 3]]
        for k in range(3):
            u, v = (k + 1) % 3, (k + 2) % 3
            normal[i, k] = a[u] * b[v] - a[v] * b[u]
        length = math.sqrt(normal[i, 0] ** 2 + normal[i, 1] ** 2 + normal[i, 2] ** 2)
        angle = math.atan2(length, a[0] * b[0] + a[1] * b[1] + a[2] * b[2])
        turn += angle
        largest = max(largest, length)
        if length > 0:
            for k in range(3):
                mean[k] += 0.5 * angle / length * normal[i, k]
    first = unit[face[0]]
    volume = normal[0, 0] * first[0] + normal[0, 1] * first[1] + normal[0, 2] * first[2]
    for i in range(3):
        along = normal[i, 0] * mean[0] + normal[i, 1] * mean[1] + normal[i, 2] * mean[2]
        share[i] = along / distance[face[i]]
    if abs(volume) > _FLAT * largest * largest:
        for i in range(3):
            weights[face[i]] += share[i] / volume
        return False
    if turn < 2 * math.pi - _FLAT:
        return False
    weights[:] = 0.0
    for i in range(3):
        weights[face[i]] = share[i]
    return True
