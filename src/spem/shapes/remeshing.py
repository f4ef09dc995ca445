"""Triangle surfaces with more faces, or with fewer."""

from __future__ import annotations

import igl
import numpy as np
from numpy.typing import NDArray

from spem.errors import ParameterError, ShapeError
from spem.shapes.surface import Surface


def subdivide(surface: Surface, n_vertices: int) -> Surface:
    """Cut each face into four at the middles of its edges, until there are enough vertices.

    Parameters
    ----------
    surface
        The surface; as a set of points it stays what it is.
    n_vertices
        Least number of vertices wanted.

    Returns
    -------
    Surface
        With what was done in `repairs`.

    Raises
    ------
    ShapeError
        When there is no face to cut.

    Examples
    --------
    >>> corners = np.array([[0.0, 0, 0], [3, 0, 0], [0, 3, 0], [0, 0, 3]])
    >>> tetrahedron = Surface(corners, np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]))
    >>> finer = subdivide(tetrahedron, 30)
    >>> len(finer.vertices), finer.area == tetrahedron.area, finer.repairs
    (34, True, ('cut each face into 16: 4 vertices are fewer than 30',))
    """
    before = len(surface.vertices)
    if before >= n_vertices:
        return surface
    if not len(surface.faces):
        msg = f"a surface of {before} vertices has no faces to cut; check the mesh"
        raise ShapeError(msg)
    fine = surface
    while len(fine.vertices) < n_vertices:
        fine = _quartered(fine)
    each = len(fine.faces) // len(surface.faces)
    phrase = f"cut each face into {each}: {before} vertices are fewer than {n_vertices}"
    return fine.with_faces(fine.faces, phrase)


def decimate(surface: Surface, n_vertices: int) -> Surface:
    """Collapse short edges until a surface has no more vertices than wanted.

    Parameters
    ----------
    surface
        A manifold surface, closed or with holes.
    n_vertices
        Most vertices wanted, at least 4. Where no further edge can go there are more.

    Returns
    -------
    Surface
        With what was done in `repairs`.

    Raises
    ------
    ParameterError
        When fewer than 4 vertices are asked for.

    Examples
    --------
    >>> from spem.shapes.boundary_surface import boundary_surface
    >>> from spem.shapes.synthetic import ball
    >>> sphere = boundary_surface(ball(radius=8.0, spacing=1.0))
    >>> coarse = decimate(sphere, 300)
    >>> len(coarse.vertices) <= 300, coarse.closed, round(coarse.area / sphere.area, 1)
    (True, True, 1.0)
    """
    if n_vertices < 4:
        msg = f"n_vertices={n_vertices}: expected at least 4, the corners of a tetrahedron"
        raise ParameterError(msg)
    before = len(surface.vertices)
    if before <= n_vertices:
        return surface
    # with each vertex of a closed surface two faces go
    most = len(surface.faces) - 2 * (before - n_vertices)
    vertices = np.asfortranarray(surface.vertices, np.float64)
    found = igl.decimate(vertices, np.asfortranarray(surface.faces, np.int64), most, False)
    coarse, faces = np.ascontiguousarray(found[0]), np.ascontiguousarray(found[1], np.int64)
    phrase = f"decimated from {before} vertices to {len(coarse)}"
    return Surface(coarse, faces, (*surface.repairs, phrase))


def _quartered(surface: Surface) -> Surface:
    """Cut each face into four at the middles of its edges."""
    faces, n = surface.faces, len(surface.vertices)
    sides = np.sort(np.stack([faces, np.roll(faces, -1, axis=1)], axis=2).reshape(-1, 2), axis=1)
    key, side = np.unique(sides[:, 0] * n + sides[:, 1], return_inverse=True)
    middle = (surface.vertices[key // n] + surface.vertices[key % n]) / 2
    ab, bc, ca = (n + side.reshape(-1, 3)).T
    a, b, c = faces.T
    parts: list[list[NDArray[np.int64]]] = [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
    cut = np.stack([np.stack(part, axis=1) for part in parts], axis=1).reshape(-1, 3)
    return Surface(np.concatenate([surface.vertices, middle]), cut, surface.repairs)
