"""Neighbours of the nodes of a shape, and its boundary edges."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy.sparse
from numba import njit
from numpy.typing import NDArray
from scipy.sparse.csgraph import connected_components

from spem.shapes.shape import FACE_FRACTION, Shape


@dataclass(frozen=True, eq=False)
class Domain:
    """The graph on which a field lives.

    Parameters
    ----------
    neighbours
        ``(n_nodes, 2 d)`` number of the neighbouring node in each direction (``2 * axis`` toward lower,
        ``2 * axis + 1`` toward higher indices); ``n_nodes`` where the edge is a boundary edge.
    fraction
        ``(n_boundary_edges,)`` where the surface cuts each boundary edge, in (0, 1], in the order of
        `boundary_edges`.
    """

    neighbours: NDArray[np.int32]
    fraction: NDArray[np.float64]

    @property
    def n_nodes(self) -> int:
        """Number of nodes."""
        return int(self.neighbours.shape[0])

    @cached_property
    def boundary_edges(self) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """``(n_boundary_edges,)`` node and direction of each boundary edge, by node, then by direction."""
        node, direction = np.nonzero(self.neighbours == self.n_nodes)
        return node, direction

    @cached_property
    def component(self) -> NDArray[np.int32]:
        """``(n_nodes,)`` connected component of each node, over uncut edges; by size, largest first.

        Examples
        --------
        >>> voxel_domain(Shape.from_mask([1, 0, 1, 1])).component
        array([1, 0, 0], dtype=int32)
        """
        n, upward = self.n_nodes, self.neighbours[:, 1::2]
        node, axis = np.nonzero(upward < n)
        ones = np.ones(node.size, np.int8)
        graph = scipy.sparse.coo_array((ones, (node, upward[node, axis])), shape=(n, n)).tocsr()
        count, component = connected_components(graph, directed=False)
        rank = np.empty(count, np.int32)
        rank[np.argsort(-np.bincount(component), kind="stable")] = np.arange(count, dtype=np.int32)
        return np.asarray(rank[component])


def surface_domain(shape: Shape) -> Domain:
    """Domain whose boundary lies on the surface: each boundary edge is cut where `shape.cuts` says."""
    return _domain(shape, use_cuts=True, default=FACE_FRACTION)


def voxel_domain(shape: Shape) -> Domain:
    """Domain of the paper: the boundary lies at the centres of the neighbouring outside voxels."""
    return _domain(shape, use_cuts=False, default=1.0)


def _domain(shape: Shape, *, use_cuts: bool, default: float) -> Domain:
    n = shape.n_nodes
    number = np.full(shape.mask.size, n, np.int32)
    number[shape.voxels] = np.arange(n, dtype=np.int32)
    strides = [int(np.prod(shape.mask.shape[a + 1 :])) for a in range(shape.ndim)]
    steps = np.array([sign * stride for stride in strides for sign in (-1, 1)])  # by direction
    cuts = shape.cuts
    keep = slice(None) if use_cuts else slice(0)
    # NumPy asks for large pages, compiled code does not: new pages cost more than what is written to them.
    neighbours = np.empty((n, steps.size), np.int32)
    fraction = _connect(
        neighbours,
        shape.voxels,
        number,
        steps,
        cuts.voxel[keep],
        cuts.direction[keep],
        cuts.fraction[keep],
        default,
    )
    return Domain(neighbours, fraction)


@njit(cache=True, nogil=True)
def _connect(
    neighbours: NDArray[np.int32],
    voxels: NDArray[np.int64],
    number: NDArray[np.int32],
    steps: NDArray[np.int64],
    cut_voxel: NDArray[np.int64],
    cut_direction: NDArray[np.uint8],
    cut_fraction: NDArray[np.float64],
    default: float,
) -> NDArray[np.float64]:
    """Fill the neighbour table, return the boundary fractions; nodes and cuts are in order of voxel."""
    n, width = neighbours.shape
    fraction = np.empty(cut_voxel.size + 16, np.float64)
    n_edges = 0
    cut = 0
    for i in range(n):
        voxel = voxels[i]
        while cut < cut_voxel.size and cut_voxel[cut] < voxel:
            cut += 1
        inner = cut == cut_voxel.size or cut_voxel[cut] > voxel
        for k in range(width):
            # Masks are framed, so this is in range; an unsigned index is not tested for wrapping.
            j = number[np.uint64(voxel + steps[k])]
            neighbours[i, k] = j
            inner &= j != n
        if inner:
            continue
        for k in range(width):
            theta = default
            if cut < cut_voxel.size and cut_voxel[cut] == voxel and cut_direction[cut] == k:
                theta = cut_fraction[cut]
                cut += 1
                neighbours[i, k] = n
            if neighbours[i, k] == n:
                if n_edges == fraction.size:
                    grown = np.empty(2 * n_edges, np.float64)
                    grown[:n_edges] = fraction
                    fraction = grown
                fraction[n_edges] = theta
                n_edges += 1
    return fraction[:n_edges].copy()
