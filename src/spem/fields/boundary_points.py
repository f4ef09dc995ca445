"""Points of a system that carry its boundary values, and which boundary edges lead to each."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

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
        ``np.argwhere(neighbours == n_nodes)``.
    """

    position: NDArray[np.float64]
    edge_point: NDArray[np.int32]

    @property
    def n_points(self) -> int:
        """Number of points."""
        return int(self.position.shape[0])


def boundary_points(system: System) -> BoundaryPoints:
    """Find the boundary points of a system.

    In the ``voxel`` model they are the outside voxels next to the shape, each at the end of one edge or
    several; in the ``surface`` model the places where the surface cuts an edge, one for each boundary edge.
    """
    shape, domain = system.shape, system.domain
    node, direction = np.nonzero(domain.neighbours == domain.n_nodes)
    axis, sign = direction // 2, 2.0 * (direction % 2) - 1
    index = np.stack(np.unravel_index(shape.voxels[node], shape.mask.shape), axis=1).astype(np.float64)
    index[np.arange(node.size), axis] += sign * domain.fraction
    if system.boundary == "voxel":
        voxel = np.ravel_multi_index(tuple(index.astype(np.int64).T), shape.mask.shape)
        _, first, edge_point = np.unique(voxel, return_index=True, return_inverse=True)
        index = index[first]
    else:
        edge_point = np.arange(node.size)
    position = np.asarray(shape.origin) + index * np.asarray(shape.spacing)
    return BoundaryPoints(position, edge_point.astype(np.int32))
