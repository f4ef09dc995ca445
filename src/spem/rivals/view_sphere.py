"""Directions of views: the vertices of a geodesic sphere, and how the symmetries of its axes permute them."""

from __future__ import annotations

from functools import cache
from itertools import permutations, product

import numpy as np
from numpy.typing import NDArray


@cache
def geodesic_sphere(subdivisions: int = 2) -> NDArray[np.float64]:
    """Return the vertices of a regular octahedron whose faces are cut in four again and again.

    Parameters
    ----------
    subdivisions
        How often; the new vertices are moved to the sphere each time.

    Returns
    -------
    numpy.ndarray
        ``(4 ** (subdivisions + 1) + 2, 3)`` unit vectors; read-only.

    Examples
    --------
    >>> geodesic_sphere(0).shape, geodesic_sphere().shape
    ((6, 3), (66, 3))
    """
    vertices = np.concatenate([np.eye(3), -np.eye(3)])
    faces = np.array([[x, 3 + y, 6 + z] for x, y, z in product((0, 3), repeat=3)]) - [0, 2, 4]
    for _ in range(subdivisions):
        edges = np.sort(np.stack([faces, np.roll(faces, -1, axis=1)], axis=2).reshape(-1, 2), axis=1)
        ends, number = np.unique(edges, axis=0, return_inverse=True)
        middle = number.reshape(-1, 3) + len(vertices)
        corners = [np.stack([faces[:, i], middle[:, i], middle[:, i - 1]], axis=1) for i in range(3)]
        faces = np.concatenate([middle, *corners])
        added = vertices[ends].sum(axis=1)
        vertices = np.concatenate([vertices, added / np.linalg.norm(added, axis=1)[:, None]])
    vertices.flags.writeable = False
    return vertices


@cache
def axis_symmetries() -> NDArray[np.float64]:
    """Return the matrices that take the three axes to each other in any order and direction.

    Returns
    -------
    numpy.ndarray
        ``(48, 3, 3)``: the 24 rotations first, the identity leading, then the 24 reflections; read-only.

    Examples
    --------
    >>> bool((np.linalg.det(axis_symmetries()).round() == [1] * 24 + [-1] * 24).all())
    True
    """
    signs = product((1.0, -1.0), repeat=3)
    found = np.array([np.diag(s)[list(p)] for s, p in product(signs, permutations(range(3)))])
    ordered: NDArray[np.float64] = found[np.argsort(-np.linalg.det(found).round(), kind="stable")]
    ordered.flags.writeable = False
    return ordered


@cache
def view_permutations(subdivisions: int = 2) -> NDArray[np.int64]:
    """Return where each symmetry of the axes takes each view.

    Returns
    -------
    numpy.ndarray
        ``(48, n_views)``: entry (g, k) is the number of the view at which view k arrives under symmetry g
        of `axis_symmetries`; read-only.

    Examples
    --------
    >>> view_permutations()[0, :4]
    array([0, 1, 2, 3])
    """
    views = geodesic_sphere(subdivisions)
    moved = np.einsum("gij,kj->gki", axis_symmetries(), views)
    found: NDArray[np.int64] = np.argmax(moved @ views.T, axis=2)
    found.flags.writeable = False
    return found
