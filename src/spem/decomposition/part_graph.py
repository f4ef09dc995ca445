"""The parts of a shape as a graph: what each is, and how far each is from every other inside the shape."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse
from numpy.typing import NDArray
from scipy.sparse.csgraph import dijkstra

from spem.decomposition.parts import Parts
from spem.fields.operator import System

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class PartGraph:
    """What the parts of one shape are, whatever their numbers.

    Parameters
    ----------
    traits
        ``(k, n_traits)`` square root of the share in the nodes, and the mean features.
    distances
        ``(k, k)`` mean distances inside the shape from the nodes of one part to the other part, in units of
        the shape's size; on the diagonal, from the nodes of a part to the rest of the shape.
    """

    traits: Array
    distances: Array


def part_graph(parts: Parts, features: Array | None = None) -> PartGraph:
    """Measure the parts of one shape and how they lie to one another.

    Parameters
    ----------
    parts
        The parts.
    features
        ``(n_nodes, n_features)`` values whose means over each part describe it.

    Examples
    --------
    >>> import spem
    >>> bar = spem.Shape.from_mask(np.ones((4, 40)))
    >>> part_graph(spem.parts(bar, 2)).traits.round(2).tolist()
    [[0.71], [0.71]]
    """
    k, labels = parts.n_parts, parts.node_labels
    member = (labels == np.arange(k)[:, None]).astype(np.float64)
    count = np.maximum(member.sum(axis=1), 1.0)
    values = np.empty((labels.size, 0)) if features is None else np.asarray(features, np.float64)
    traits = np.column_stack([np.sqrt(parts.sizes), member @ values / count[:, None]])
    graph = _node_graph(parts.sources.system)
    reach = np.stack([_distance_to(graph, labels == j) for j in range(k)])
    distances = np.asarray(reach @ member.T) / count
    outside = np.stack([_distance_to(graph, labels != j) for j in range(k)])
    distances[np.diag_indices(k)] = np.sum(outside * member, axis=1) / count
    return PartGraph(traits, (distances + distances.T) / (2 * parts.shape.size))


def _node_graph(system: System) -> scipy.sparse.csr_array:
    """Inside nodes joined to their neighbours, at their distance."""
    neighbours, n = system.domain.neighbours, system.n_nodes
    node, direction = np.nonzero(neighbours < n)
    length = np.asarray(system.shape.spacing)[direction // 2]
    return scipy.sparse.csr_array((length, (node, neighbours[node, direction])), shape=(n, n))


def _distance_to(graph: scipy.sparse.csr_array, members: NDArray[np.bool_]) -> Array:
    """Distance from every node to the nearest of some; where there is no way, the largest distance."""
    if not members.any():
        return np.zeros(members.size)
    distance = dijkstra(graph, indices=np.flatnonzero(members), min_only=True)
    reached = np.isfinite(distance)
    return np.asarray(np.where(reached, distance, distance[reached].max()))
