"""Points of a system that carry its boundary values: where, in which order, and what each stands for."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse
from numpy.typing import NDArray
from scipy.sparse.csgraph import connected_components

from spem.fields.boundary.contours import face_areas, face_neighbours, trace_contours
from spem.fields.operator import System


@dataclass(frozen=True, eq=False)
class BoundaryPoints:
    """Where the boundary condition sits.

    Parameters
    ----------
    position
        ``(n_points, d)`` coordinates, in the shape's own coordinates.
    edge_point
        ``(n_boundary_edges,)`` point at the end of each boundary edge, in the order of
        `Domain.boundary_edges`.
    contour
        ``(n_points,)`` number of the contour of each point in 2-D, of its connected piece of boundary in
        other dimensions.
    measure
        ``(n_points,)`` length (2-D), area (3-D) ... of the boundary that each point stands for, in units of
        spacing^(d-1); 1 in 1-D.
    """

    position: NDArray[np.float64]
    edge_point: NDArray[np.int32]
    contour: NDArray[np.int32]
    measure: NDArray[np.float64]

    @property
    def n_points(self) -> int:
        """Number of points."""
        return int(self.position.shape[0])

    @property
    def n_contours(self) -> int:
        """Number of contours, or of connected pieces of boundary."""
        return int(self.contour.max()) + 1

    def __repr__(self) -> str:
        kind = f"{self.position.shape[1]}-D, {self.n_points} points, {self.n_contours} contours"
        return f"BoundaryPoints({kind}, measure {self.measure.sum():.4g})"


def boundary_points(system: System) -> BoundaryPoints:
    """Find the boundary points of a system.

    In the ``voxel`` model they are the outside voxels next to the shape, each at the end of one edge or
    several; in the ``surface`` model the places where the surface cuts an edge, one for each boundary edge.

    In 2-D they are numbered along the contours with the shape on the left (axis 0 to the right, axis 1 up,
    or row 0 on top): outer contours first, by length, then holes. An outside voxel that a contour meets
    twice, in a slit one voxel wide, or that two contours meet, has its number from the first meeting; a
    contour whose every voxel was met before has no number. In other dimensions points are in C order, of
    their edges or their voxels, and connected pieces of boundary are numbered by area. Pieces that share an
    outside voxel are one.

    Examples
    --------
    >>> import numpy as np
    >>> from spem.fields.operator import assemble
    >>> from spem.shapes.shape import Shape
    >>> boundary_points(assemble(Shape.from_mask(np.ones((1, 2))), "voxel")).position.tolist()
    [[-1.0, 0.0], [0.0, -1.0], [1.0, 0.0], [1.0, 1.0], [0.0, 2.0], [-1.0, 1.0]]
    """
    area = face_areas(system.domain, system.shape.spacing)
    order, contour = np.arange(area.size), None
    if system.shape.ndim == 2:
        order, contour = trace_contours(system.domain, area)
    index, voxel = _ends(system)
    place = voxel if system.boundary == "voxel" else np.arange(area.size)
    _, met, inverse = np.unique(place[order], return_index=True, return_inverse=True)
    sequence = np.arange(met.size) if contour is None else np.argsort(met)
    first = order[met[sequence]]
    edge_point = np.empty(area.size, np.int32)
    edge_point[order] = np.argsort(sequence)[inverse]
    measure = np.bincount(edge_point, area).astype(np.float64)
    if contour is None:
        piece = _pieces(point_graph(system, edge_point), measure)
    else:
        piece = np.unique(contour[first], return_inverse=True)[1].astype(np.int32)
    position = np.asarray(system.shape.origin) + index[first] * np.asarray(system.shape.spacing)
    return BoundaryPoints(position, edge_point, piece, measure)


def point_graph(system: System, edge_point: NDArray[np.int32]) -> scipy.sparse.csr_array:
    """Return which points are next to each other along the boundary, never through space.

    Parameters
    ----------
    system
        The system.
    edge_point
        ``(n_boundary_edges,)`` point at the end of each boundary edge.

    Returns
    -------
    graph
        ``(n_points, n_points)`` symmetric, positive where two different points end edges whose faces meet at
        a ridge.
    """
    neighbours = face_neighbours(system.domain)
    start = np.repeat(edge_point, neighbours.shape[1])
    end = edge_point[neighbours.ravel()]
    apart = start != end
    n = int(edge_point.max()) + 1
    ones = np.ones(np.count_nonzero(apart), np.int32)
    return scipy.sparse.coo_array((ones, (start[apart], end[apart])), shape=(n, n)).tocsr()


def _ends(system: System) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Grid coordinates of the end of each boundary edge, and the voxel at the whole edge's end."""
    shape, domain = system.shape, system.domain
    node, direction = domain.boundary_edges
    index = np.stack(np.unravel_index(shape.voxels[node], shape.mask.shape), axis=1).astype(np.float64)
    index[np.arange(node.size), direction // 2] += np.where(direction % 2, 1, -1) * domain.fraction
    strides = np.array([int(np.prod(shape.mask.shape[a + 1 :])) for a in range(shape.ndim)])
    return index, shape.voxels[node] + np.where(direction % 2, 1, -1) * strides[direction // 2]


def _pieces(graph: scipy.sparse.csr_array, measure: NDArray[np.float64]) -> NDArray[np.int32]:
    """Return the connected piece of each point, numbered by measure, largest first."""
    count, piece = connected_components(graph, directed=False)
    rank = np.empty(count, np.int32)
    rank[np.argsort(-np.bincount(piece, measure), kind="stable")] = np.arange(count, dtype=np.int32)
    return np.asarray(rank[piece])
