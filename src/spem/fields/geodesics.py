"""Inner geodesic distances of a shape: from nodes, and from boundary sources (3.2)."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial import cKDTree

from spem.errors import ParameterError, require_kind
from spem.fields.boundary.sources import Sources
from spem.fields.domain import Domain, surface_domain
from spem.fields.marching import march
from spem.fields.sight import see
from spem.shapes.shape import Shape


def inner_distances(shape: Shape, sources: ArrayLike, *, order: Literal[1, 2] = 2) -> NDArray[np.float64]:
    """Return the lengths of the shortest ways from nodes to all nodes that stay inside the shape.

    Inner geodesic distances: straight-line ones where the way is free, exact; round corners by fast marching
    on the graph of the nodes. Edges that the surface cuts are not crossed: parts which touch only through the
    grid stay apart.

    Parameters
    ----------
    shape
        Any shape.
    sources
        ``(n_sources,)`` numbers of nodes, or one.
    order
        Highest order of the upwind differences.

    Returns
    -------
    distance
        ``(n_sources, n_nodes)``, in the unit of the spacing; infinite in other connected components.

    Raises
    ------
    ParameterError
        If there is no `Shape`, a source is not the number of a node, or the order is neither 1 nor 2.

    Examples
    --------
    >>> inner_distances(Shape.from_mask([[1, 1, 1], [1, 0, 1], [1, 0, 1]]), [5])
    array([[2., 3., 4., 1., 5., 0., 6.]])
    """
    require_kind(shape, Shape, "read it first: spem.read(...)")
    nodes = _node_numbers(sources, shape)
    centre = np.zeros((1, shape.ndim))
    seeds = [(node[None], centre) for node in nodes]
    return _distances(shape, surface_domain(shape), seeds, order)


def source_distances(
    sources: Sources, numbers: ArrayLike | None = None, *, order: Literal[1, 2] = 2
) -> NDArray[np.float64]:
    """Return the lengths of the shortest ways from boundary sources to all nodes, inside the shape.

    As `inner_distances`, from the ends of a source's boundary edges, the nearest of them.

    Parameters
    ----------
    sources
        Boundary sources, whose system has the edges that may be crossed.
    numbers
        ``(k,)`` numbers of sources; all of them by default.
    order
        Highest order of the upwind differences.

    Returns
    -------
    distance
        ``(k, n_nodes)``, in the unit of the spacing; infinite where a source does not reach.

    Raises
    ------
    ParameterError
        If there are no `Sources`, there is no source of a number, or the order is neither 1 nor 2.

    Examples
    --------
    >>> import spem
    >>> ends = spem.sources(spem.Shape.from_mask(np.ones(4)))
    >>> source_distances(ends, [1])
    array([[3.5, 2.5, 1.5, 0.5]])
    """
    require_kind(sources, Sources, "make them: spem.sources(shape)")
    chosen = sources if numbers is None else sources.select(numbers)
    shape, domain = sources.system.shape, sources.system.domain
    node, direction = domain.boundary_edges
    end = np.zeros((node.size, shape.ndim))
    axis = direction // 2
    end[np.arange(node.size), axis] = (
        (2 * (direction % 2) - 1) * domain.fraction * np.take(shape.spacing, axis)
    )
    edges = [np.flatnonzero(chosen.edge_source == source) for source in range(chosen.n_sources)]
    return _distances(shape, domain, [(node[edge], end[edge]) for edge in edges], order)


def _distances(
    shape: Shape,
    domain: Domain,
    seeds: Sequence[tuple[NDArray[np.int64], NDArray[np.float64]]],
    order: int,
) -> NDArray[np.float64]:
    """Distances from groups of seeds: nodes, and the offset of the origin of distances from each."""
    if order not in (1, 2):
        msg = f"order={order!r}: expected 1 or 2"
        raise ParameterError(msg)
    index = np.stack(np.unravel_index(shape.voxels, shape.mask.shape), axis=1).astype(np.int32)
    spacing = np.asarray(shape.spacing, np.float64)
    distance = np.full((len(seeds), shape.n_nodes), np.inf)
    for row, (nodes, offsets) in zip(distance, seeds, strict=True):
        for node, offset in zip(nodes, offsets, strict=True):
            see(index, domain.neighbours, spacing, node, offset, row)
        march(domain.neighbours, spacing, order, row)
        # Second-order differences undershoot here and there; no way is shorter than the straight line.
        origins = shape.points[nodes] + offsets
        np.maximum(row, cKDTree(origins).query(shape.points)[0], out=row)
    return distance


def _node_numbers(nodes: ArrayLike, shape: Shape) -> NDArray[np.int64]:
    """Return node numbers as such."""
    numbers = np.atleast_1d(np.asarray(nodes))
    if numbers.ndim != 1 or numbers.size == 0 or numbers.dtype.kind not in "iu":
        msg = f"{shape.name}: sources={nodes!r}: expected numbers of nodes, one or (n_sources,)"
        raise ParameterError(msg)
    if numbers.min() < 0 or numbers.max() >= shape.n_nodes:
        stray = numbers.min() if numbers.min() < 0 else numbers.max()
        msg = f"{shape.name}: there is no node {stray}, expected 0 to {shape.n_nodes - 1}"
        raise ParameterError(msg)
    return numbers.astype(np.int64)
