"""One triangle surface of a solid: its mesh where that is sound, else taken from its grid."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from skimage.measure import marching_cubes

from spem.errors import ShapeError, require_kind
from spem.shapes.distance import signed_distance
from spem.shapes.shape import Shape
from spem.shapes.surface import Surface, count_of

# Holes whose flat fillings have more than this share of the area change what the surface is.
_HOLE_SHARE = 0.02
# A part of a mesh is the kept solid's when at least this share of its faces begins beside kept voxels.
_BESIDE_SHARE = 0.5
# No voxel changes side and no vertex falls onto a node: least distance of a node, in the smallest spacing.
_LEAST = 0.02


def boundary_surface(shape: Shape) -> Surface:
    """Return one connected, oriented, manifold surface of a solid.

    It is the mesh that the shape was filled from where each of its edges has at most two faces, its holes
    are small (together below 2 % of the area; they stay open) and one part of it bounds the solid that was
    kept. Else, and for volumes, it is the zero of the signed distance on the grid, its largest part: closed,
    but surfaces closer than a voxel may have merged. Hollows are left out in both cases.

    Parameters
    ----------
    shape
        A shape of three dimensions.

    Returns
    -------
    Surface
        In the shape's own coordinates; what was done stands at the end of its `repairs`.

    Raises
    ------
    ShapeError
        When the shape is not of three dimensions.

    Examples
    --------
    >>> from spem.shapes.synthetic import ball
    >>> surface = boundary_surface(ball(radius=8.0, spacing=1.0))
    >>> surface.closed, surface.repairs, round(surface.area / (4 * np.pi * 64), 2)
    (True, ('surface taken from the grid',), 0.99)
    """
    require_kind(shape, Shape, "read it first: spem.read(...)")
    if shape.ndim != 3:
        msg = f"{shape.name}: a boundary surface is of shapes of 3 dimensions, this one has {shape.ndim}"
        raise ShapeError(msg)
    mesh = shape.surface
    if mesh is None:
        return _grid_surface(shape, "surface taken from the grid")
    part, why = _kept_part(shape, mesh)
    why = why or _flaw(part)
    if why:
        return _grid_surface(shape, f"remeshed from the filled volume: {why}")
    if part.closed:
        return part
    edges, loops = count_of(len(part.open_edges), "edge"), count_of(part.n_loops, "loop")
    return part.with_faces(part.faces, f"surface left open at {edges} in {loops}")


def largest_part(surface: Surface) -> Surface:
    """Return the part of a surface that encloses most, and say how many were left out.

    Examples
    --------
    >>> corners = np.array([[0.0, 0, 0], [3, 0, 0], [0, 3, 0], [0, 0, 3]])
    >>> faces = np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])
    >>> two = Surface(np.concatenate([corners, 9 + 2 * corners]), np.concatenate([faces, faces + 4]))
    >>> one = largest_part(two)
    >>> len(one.faces), one.vertices[0].tolist(), one.repairs
    (4, [9.0, 9.0, 9.0], ('left 1 of 2 parts of the surface out',))
    """
    part, volume = _parts(surface)
    return surface if volume.size == 1 else _only(surface, part, int(np.argmax(volume)), volume.size)


def _kept_part(shape: Shape, mesh: Surface) -> tuple[Surface, str]:
    """Return the part of a mesh that bounds the kept solid, and why there is not one, if so."""
    proper = (mesh.faces != np.roll(mesh.faces, 1, axis=1)).all(axis=1)
    if not proper.all():
        mesh = mesh.with_faces(mesh.faces[proper])
    part, volume = _parts(mesh)
    if volume.size == 1:
        return _compact(mesh), ""
    place = (mesh.vertices - np.asarray(shape.origin)) / np.asarray(shape.spacing)
    index = np.rint(place[mesh.faces[:, 0]]).astype(np.int64)
    last = np.asarray(shape.mask.shape) - 1
    near = ndimage.binary_dilation(shape.mask, np.ones((3, 3, 3), bool))
    beside = ((index >= 0) & (index <= last)).all(axis=1) & near[tuple(np.clip(index, 0, last).T)]
    share = np.bincount(part, beside, volume.size) / np.bincount(part, minlength=volume.size)
    solids = np.flatnonzero((share >= _BESIDE_SHARE) & (volume > 0))
    if not solids.size:
        return mesh, "no part of the mesh bounds it"
    if solids.size > 1:
        return mesh, f"{solids.size} parts of the mesh bound it"
    return _only(mesh, part, int(solids[0]), volume.size), ""


def _flaw(surface: Surface) -> str:
    """Say what keeps a mesh from being a surface with small holes; nothing where all is well."""
    crowded = int(np.count_nonzero(np.unique(_edge_keys(surface), return_counts=True)[1] > 2))
    if crowded:
        return f"{count_of(crowded, 'edge')} with more than two faces"
    share = _hole_area(surface) / surface.area
    return f"holes of {100 * share:.0f} % of its area" if share > _HOLE_SHARE else ""


def _hole_area(surface: Surface) -> float:
    """Return the area of fans that would fill the loops of open edges from their middles."""
    if surface.closed:
        return 0.0
    vertices, end = np.unique(surface.open_edges, return_inverse=True)
    one, two = end.reshape(-1, 2).T
    graph = coo_array((np.ones(one.size, bool), (one, two)), shape=(vertices.size,) * 2)
    n_loops, loop = connected_components(graph, directed=False)
    place = surface.vertices[vertices]
    sums = np.stack([np.bincount(loop, x, n_loops) for x in place.T], axis=1)
    middle = sums / np.bincount(loop, minlength=n_loops)[:, None]
    cross = np.cross(place[one] - middle[loop[one]], place[two] - middle[loop[one]])
    return float(np.linalg.norm(cross, axis=1).sum() / 2)


def _parts(surface: Surface) -> tuple[NDArray[np.int64], NDArray[Any]]:
    """Return the part of each face, parts being joined by edges, and the signed volume of each part."""
    n = len(surface.faces)
    _, edge = np.unique(_edge_keys(surface), return_inverse=True)
    links = (np.arange(3 * n) // 3, n + edge)
    graph = coo_array((np.ones(3 * n, bool), links), shape=(n + 3 * n,) * 2)
    _, label = connected_components(graph, directed=False)
    used, part = np.unique(label[:n], return_inverse=True)
    return part.astype(np.int64), np.bincount(part, surface.face_volumes, used.size)


def _edge_keys(surface: Surface) -> NDArray[np.int64]:
    """Return ``(3 n_faces,)`` a number for each edge of each face, the same for both directions."""
    start, stop = surface.faces.reshape(-1), np.roll(surface.faces, -1, axis=1).reshape(-1)
    return np.asarray(np.minimum(start, stop) * len(surface.vertices) + np.maximum(start, stop))


def _only(surface: Surface, part: NDArray[np.int64], kept: int, count: int) -> Surface:
    """Return one part of a surface, and say so."""
    phrase = f"left {count - 1} of {count} parts of the surface out"
    return _compact(surface.with_faces(surface.faces[part == kept], phrase))


def _compact(surface: Surface) -> Surface:
    """Drop vertices without a face."""
    used = np.zeros(len(surface.vertices), bool)
    used[surface.faces] = True
    if used.all():
        return surface
    return Surface(surface.vertices[used], (np.cumsum(used) - 1)[surface.faces], surface.repairs)


def _grid_surface(shape: Shape, phrase: str) -> Surface:
    """Return the outer surface of the largest part of a shape by marching cubes, and how it came about."""
    least = _LEAST * min(shape.spacing)
    level = signed_distance(shape)
    level = np.where(shape.mask, np.maximum(level, least), np.minimum(level, -least))
    index, faces, _, _ = marching_cubes(level, 0.0, gradient_direction="ascent", allow_degenerate=False)
    vertices = np.asarray(shape.origin) + index.astype(np.float64) * np.asarray(shape.spacing)
    return largest_part(Surface(vertices, faces.astype(np.int64), (phrase,)))
