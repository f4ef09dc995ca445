"""Labels of nodes carried to the vertices of a mesh, or to any other points on or near a shape."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import dijkstra
from scipy.spatial import KDTree

from spem.errors import ParameterError
from spem.shapes.shape import Shape
from spem.shapes.surface import Surface, mend

# Vertices are moved inward by this fraction of a voxel, so that across a narrow gap or a thin wall the
# nodes on their own side are nearest.
STEP = 0.5
# A moved vertex farther from all nodes than this many voxels lies in a part too thin for the grid.
FAR = 1.25
# Distances that differ by less than this fraction are equal.
TIE = 1e-6


def vertex_labels(
    shape: Shape, node_labels: ArrayLike, vertices: ArrayLike, faces: ArrayLike | None = None
) -> NDArray[np.int32]:
    """Label points by the nearest node; of several at one distance, by the most frequent label.

    With faces, the vertices of a mesh look inward: what lies beyond a gap does not count. Vertices of
    tips too thin to hold nodes take the label of the nearest vertex along the edges that has some.

    Parameters
    ----------
    shape
        The shape that the nodes belong to.
    node_labels
        ``(n_nodes,)`` whole numbers; any number, -1 too, is a label like others.
    vertices
        ``(n_vertices, d)`` points in the shape's own coordinates: those of the file, for a mesh.
    faces
        ``(n_faces, 3)`` vertex numbers of a triangle mesh, of either orientation; None for bare points.

    Returns
    -------
    labels
        ``(n_vertices,)`` label of each vertex.

    Raises
    ------
    ParameterError
        If labels, vertices or faces do not fit the shape or one another.

    Examples
    --------
    >>> shape = Shape.from_mask([1, 1, 1, 1])
    >>> vertex_labels(shape, [0, 0, 1, 1], [[-0.5], [1.4], [3.5]])
    array([0, 0, 1], dtype=int32)
    """
    labels, points = _node_labels(shape, node_labels), _points(shape, vertices)
    if points.shape[0] == 0:
        return np.zeros(0, np.int32)
    if faces is None:
        return _nearest(shape, labels, points)
    _, place, samples = sample_points(shape, points, faces)
    return _nearest(shape, labels, samples)[place]


def sample_points(
    shape: Shape, vertices: ArrayLike, faces: ArrayLike
) -> tuple[Surface, NDArray[np.int64], NDArray[np.float64]]:
    """Find where inside a shape the values for the vertices of its mesh are to be read.

    Half a voxel below each vertex; where that is far from all nodes, as in a thin tip, at the place for
    the nearest vertex along the edges where it is not.

    Parameters
    ----------
    shape
        A three-dimensional shape.
    vertices
        ``(n_vertices, 3)`` coordinates.
    faces
        ``(n_faces, 3)`` vertex numbers of triangles, of either orientation.

    Returns
    -------
    surface
        The mesh with vertices at one place merged and faces turned outward.
    place
        ``(n_vertices,)`` vertex of `surface` that each vertex is.
    samples
        ``(n_merged, 3)`` place to read the values of each vertex of `surface`.

    Raises
    ------
    ParameterError
        If vertices or faces do not fit the shape or one another.

    Examples
    --------
    >>> cube = Shape.from_mask(np.ones((2, 2, 2)))
    >>> corners = np.array([[-0.5, 0, 0], [-0.5, 1, 0], [-0.5, 0, 1]])
    >>> sample_points(cube, corners, [[0, 1, 2]])[2][:, 0].tolist()
    [-1.0, -1.0, -1.0]
    """
    points = _points(shape, vertices)
    distinct, place = np.unique(points, axis=0, return_inverse=True)
    place = place.reshape(-1)
    surface = mend(Surface(distinct, place[_faces(shape, faces, len(points))]))
    samples = distinct - STEP * min(shape.spacing) * _normals(surface)
    near = KDTree(shape.points).query(samples)[0] <= FAR * max(shape.spacing)
    if near.any() and not near.all():
        samples = samples[_along_edges(surface, near)]
    return surface, place, samples


def _nearest(shape: Shape, labels: NDArray[np.int32], points: NDArray[np.float64]) -> NDArray[np.int32]:
    """Most frequent label of the nearest nodes of each point, the least of equals."""
    count = min(2**shape.ndim, shape.n_nodes)
    distance, node = KDTree(shape.points).query(points, k=np.arange(1, count + 1))
    first = distance[:, :1]
    tied = distance <= first + TIE * (first + min(shape.spacing))
    values, number = np.unique(labels, return_inverse=True)
    vote = np.argmax(tied, axis=1)  # the nearest, where it is alone
    best = number.reshape(-1)[node[np.arange(len(points)), vote]]
    several = np.flatnonzero(tied.sum(axis=1) > 1)
    row, column = np.nonzero(tied[several])
    votes = np.zeros((several.size, values.size), np.int32)
    np.add.at(votes, (row, number.reshape(-1)[node[several[row], column]]), 1)
    best[several] = votes.argmax(axis=1)
    return np.asarray(values[best].astype(np.int32))


def _along_edges(surface: Surface, near: NDArray[np.bool_]) -> NDArray[np.int64]:
    """Return for each vertex the nearest one along the edges that is near, itself where none is reached."""
    start, stop = surface.faces.reshape(-1), np.roll(surface.faces, -1, axis=1).reshape(-1)
    pairs = np.unique(np.stack([np.minimum(start, stop), np.maximum(start, stop)], axis=1), axis=0)
    pairs = pairs[pairs[:, 0] != pairs[:, 1]]
    length = np.linalg.norm(surface.vertices[pairs[:, 0]] - surface.vertices[pairs[:, 1]], axis=1)
    n = len(surface.vertices)
    graph = coo_array((length, pairs.T), shape=(n, n)).tocsr()
    away, _, origin = dijkstra(
        graph, directed=False, indices=np.flatnonzero(near), min_only=True, return_predecessors=True
    )
    return np.where(np.isfinite(away), origin, np.arange(n))


def _normals(surface: Surface) -> NDArray[np.float64]:
    """Return unit outward normals of the vertices, weighted by area; zero at vertices of no face."""
    corner = surface.vertices[surface.faces]  # (n_faces, 3, 3)
    area = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    n = len(surface.vertices)
    flat = surface.faces.reshape(-1)
    total = np.stack([np.bincount(flat, np.repeat(area[:, a], 3), n) for a in range(3)], axis=1).astype(float)
    length = np.linalg.norm(total, axis=1, keepdims=True)
    return np.asarray(np.divide(total, length, out=np.zeros_like(total), where=length > 0))


def _node_labels(shape: Shape, node_labels: ArrayLike) -> NDArray[np.int32]:
    """Labels as whole numbers, one a node."""
    labels = np.asarray(node_labels)
    if labels.shape != (shape.n_nodes,) or labels.dtype.kind not in "iu":
        msg = f"{shape.name}: node_labels must be ({shape.n_nodes},) whole numbers, one a node,"
        msg += f" not {labels.shape} of {labels.dtype}"
        raise ParameterError(msg)
    return labels.astype(np.int32)


def _points(shape: Shape, vertices: ArrayLike) -> NDArray[np.float64]:
    """Vertices as finite coordinates of the shape's dimension."""
    points = np.asarray(vertices, np.float64)
    if points.ndim != 2 or points.shape[1] != shape.ndim or not np.isfinite(points).all():
        msg = f"{shape.name}: vertices must be finite (n, {shape.ndim}) coordinates, not {points.shape}"
        if points.ndim == 2 and points.shape[1] == shape.ndim:
            msg = f"{shape.name}: vertices must be finite, some are NaN or inf"
        raise ParameterError(msg)
    return points


def _faces(shape: Shape, faces: ArrayLike, n_vertices: int) -> NDArray[np.int64]:
    """Faces as vertex numbers of triangles in space."""
    triangles = np.asarray(faces)
    if shape.ndim != 3 or triangles.ndim != 2 or triangles.shape[1] != 3 or triangles.dtype.kind not in "iu":
        msg = f"{shape.name}: faces must be (n, 3) vertex numbers of a mesh in space, not {triangles.shape}"
        msg += f" of a shape of {shape.ndim} dimensions"
        raise ParameterError(msg)
    if triangles.size and not 0 <= triangles.min() <= triangles.max() < n_vertices:
        msg = f"{shape.name}: faces must name some of the {n_vertices} vertices"
        raise ParameterError(msg)
    return triangles.astype(np.int64)
