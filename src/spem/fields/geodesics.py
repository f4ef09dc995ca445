"""Inner geodesic distances of a shape, its distance to the boundary, and directions along both (3.2)."""

from __future__ import annotations

from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from spem.errors import ParameterError, require_kind
from spem.fields.domain import surface_domain
from spem.fields.marching import march, see
from spem.shapes.shape import Shape


def inner_distances(shape: Shape, sources: ArrayLike, *, order: Literal[1, 2] = 2) -> NDArray[np.float64]:
    """Return the lengths of the shortest ways from nodes to all nodes that stay inside the shape.

    Straight-line distances where the way is free, exact; round corners by fast marching on the graph of the
    nodes. Edges that the surface cuts are not crossed: parts which touch only through the grid stay apart.

    Parameters
    ----------
    shape
        Any shape.
    sources
        ``(n_sources,)`` numbers of nodes.
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
    if order not in (1, 2):
        msg = f"order={order!r}: expected 1 or 2"
        raise ParameterError(msg)
    domain = surface_domain(shape)
    index = _places(shape)
    spacing = np.asarray(shape.spacing, np.float64)
    centre = np.zeros(shape.ndim)
    distance = np.full((nodes.size, shape.n_nodes), np.inf)
    for row, node in zip(distance, nodes, strict=True):
        see(index, domain.neighbours, spacing, node, centre, row)
        march(domain.neighbours, spacing, order, row)
    return distance


def _places(shape: Shape) -> NDArray[np.int32]:
    """``(n_nodes, d)`` place of each node in the grid."""
    return np.stack(np.unravel_index(shape.voxels, shape.mask.shape), axis=1).astype(np.int32)


def _node_numbers(nodes: ArrayLike, shape: Shape) -> NDArray[np.int64]:
    """Return node numbers as such."""
    numbers = np.asarray(nodes)
    if numbers.ndim != 1 or numbers.size == 0 or numbers.dtype.kind not in "iu":
        msg = f"{shape.name}: sources={nodes!r}: expected (n_sources,) numbers of nodes"
        raise ParameterError(msg)
    if numbers.min() < 0 or numbers.max() >= shape.n_nodes:
        stray = numbers.min() if numbers.min() < 0 else numbers.max()
        msg = f"{shape.name}: there is no node {stray}, expected 0 to {shape.n_nodes - 1}"
        raise ParameterError(msg)
    return numbers.astype(np.int64)
