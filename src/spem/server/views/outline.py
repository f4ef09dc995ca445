"""What bounds a shape in a picture: contours in 2-D, a triangle mesh in 3-D, tied to nodes and patches."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import KDTree

from spem.api.parts import part_sources
from spem.decomposition.transfer import sample_points
from spem.fields.boundary.sources import Sources
from spem.plots.refinement import refine
from spem.server.views.shape_key import ShapeKey
from spem.shapes.boundary_surface import boundary_surface
from spem.shapes.remeshing import decimate
from spem.shapes.shape import Shape

# A browser turns so many faces without effort; beyond them the mesh is decimated, to that many vertices.
_MOST_FACES = 30_000
_DECIMATED = 12_000
# Longest edges, in voxels, at which colours that vertices carry still show what the nodes have.
_LONGEST = 2.0
# Halved edges leave faces of about a fifth of the square of the longest: this keeps them below the most.
_EDGES_PER_AREA = 5_000
PATCHES = 200


@dataclass(frozen=True, eq=False)
class Contours:
    """The contours of a silhouette.

    Parameters
    ----------
    position
        ``(m, 2)`` points along the contours, in units of the grid; outer contours first.
    start
        ``(n_contours + 1,)`` first point of each closed contour, and m.
    node
        ``(m,)`` node inside each point.
    """

    position: NDArray[np.float64]
    start: NDArray[np.int32]
    node: NDArray[np.int32]


@dataclass(frozen=True, eq=False)
class Mesh:
    """The surface of a solid.

    Parameters
    ----------
    position
        ``(v, 3)`` vertices, in units of the grid.
    faces
        ``(f, 3)`` vertex numbers, counter-clockwise seen from outside.
    node
        ``(v,)`` nearest node below each vertex.
    repairs
        What was done to the mesh of the shape.
    """

    position: NDArray[np.float64]
    faces: NDArray[np.int64]
    node: NDArray[np.int32]
    repairs: tuple[str, ...] = ()


def shown_sources(shape: Shape) -> Sources:
    """Return the patches of the boundary that can be pointed at, where the fields take their boundary.

    Those of the last shapes are kept.

    Examples
    --------
    >>> shown_sources(Shape.from_mask(np.ones((5, 5)))).n_sources
    20
    """
    return _sources(ShapeKey.of(shape))


@lru_cache(maxsize=2)
def _sources(key: ShapeKey) -> Sources:
    """Divide the boundary of a shape."""
    return part_sources(key.shape, PATCHES, boundary="surface")


def grid_units(shape: Shape, positions: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return coordinates of a shape as indices of its grid, which need not be whole.

    Examples
    --------
    >>> shape = Shape.from_mask(np.ones((2, 2)), spacing=0.5)
    >>> grid_units(shape, shape.points)[0].tolist()
    [1.0, 1.0]
    """
    return np.asarray((positions - np.asarray(shape.origin)) / np.asarray(shape.spacing))


def contours_of(shape: Shape, sources: Sources) -> Contours:
    """Return the contours through the boundary points of a silhouette.

    Parameters
    ----------
    shape
        A shape of two dimensions.
    sources
        Sources of it on the ``"surface"``, where each boundary point ends one edge.

    Examples
    --------
    >>> square = Shape.from_mask(np.ones((2, 2)))
    >>> contours_of(square, shown_sources(square)).start.tolist()
    [0, 8]
    """
    points = sources.points
    node = np.empty(points.n_points, np.int32)
    node[points.edge_point] = sources.system.domain.boundary_edges[0]
    start = np.searchsorted(points.contour, np.arange(points.n_contours + 1))
    return Contours(grid_units(shape, points.position), start.astype(np.int32), node)


def mesh_of(shape: Shape) -> Mesh:
    """Return the surface of a solid, neither too fine for a browser nor too coarse for colours.

    Parameters
    ----------
    shape
        A shape of three dimensions.

    Examples
    --------
    >>> cube = mesh_of(Shape.from_mask(np.ones((3, 3, 3))))
    >>> cube.faces.shape[1], int(cube.node.max())
    (3, 26)
    """
    surface = boundary_surface(shape)
    if len(surface.faces) > _MOST_FACES:
        surface = decimate(surface, _DECIMATED)
    longest = max(_LONGEST * max(shape.spacing), float(np.sqrt(surface.area / _EDGES_PER_AREA)))
    vertices, faces = refine(surface.vertices, surface.faces, longest)
    _, place, samples = sample_points(shape, vertices, faces)
    node = KDTree(shape.points).query(samples)[1][place]
    return Mesh(grid_units(shape, vertices), faces, node.astype(np.int32), surface.repairs)


def vertex_patches(shape: Shape, mesh: Mesh, sources: Sources) -> NDArray[np.int32]:
    """Return the source whose boundary is nearest to each vertex.

    Examples
    --------
    >>> cube = Shape.from_mask(np.ones((3, 3, 3)))
    >>> len(set(vertex_patches(cube, mesh_of(cube), shown_sources(cube)).tolist())) > 6
    True
    """
    nearest = KDTree(grid_units(shape, sources.points.position)).query(mesh.position)[1]
    return np.asarray(sources.group[nearest])
