"""Sources of one shape put in correspondence with those of another, by how they lie to one another."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse.csgraph import dijkstra

from spem.decomposition.measurements import centred_logs
from spem.decomposition.transport import Coupling, couple
from spem.fields.boundary.points import point_graph
from spem.fields.boundary.sources import Sources
from spem.fields.superposition.fields import SourceFields

# Quantiles at which the distances from one source to all others are compared.
_QUANTILES = 40
# Share of distances along the boundary in the square of all distances. Interactions alone exchange
# neighbouring fingers, and distances along the boundary alone fail where limbs touch.
_ALONG = 0.2


def source_distances(fields: SourceFields) -> NDArray[np.float64]:
    """Return how far apart sources are: root mean square, over the nodes, of the difference of their logs.

    A log-field falls with the distance walked from its source, so this grows with the distance between two
    sources inside the shape, and changes little when limbs bend.

    Parameters
    ----------
    fields
        Fields of sources at one ρ.

    Returns
    -------
    distances
        ``(n_sources, n_sources)``, symmetric. Sources that reach no common node are as far apart as the
        farthest of the others.

    Examples
    --------
    >>> from spem.fields.operator import assemble
    >>> from spem.fields.superposition.fields import solve_sources
    >>> from spem.fields.boundary.sources import point_sources
    >>> from spem.shapes.shape import Shape
    >>> sources = point_sources(assemble(Shape.from_mask(np.ones(3)), "voxel"))
    >>> source_distances(solve_sources(sources, np.inf)).round(2)
    array([[0. , 0.9],
           [0.9, 0. ]])
    """
    logs = centred_logs(fields)
    reached = np.isfinite(logs)
    logs[~reached] = 0.0
    weight = reached.astype(np.float64)
    square = logs**2 @ weight.T
    total = square + square.T - 2 * logs @ logs.T
    count = weight @ weight.T
    distances = np.sqrt(np.maximum(total, 0.0) / np.maximum(count, 1.0))
    np.fill_diagonal(distances, 0.0)
    distances[count == 0] = distances.max()
    return np.asarray(distances)


def boundary_distances(sources: Sources) -> NDArray[np.float64]:
    """Return the lengths of the shortest ways between the middles of sources along the boundary.

    Parameters
    ----------
    sources
        Sources of one shape.

    Returns
    -------
    distances
        ``(n_sources, n_sources)``, symmetric, in the unit of the spacing. Sources on separate pieces of
        boundary are as far apart as the farthest of the others.
    """
    points, position = sources.points, sources.points.position
    member = np.flatnonzero(sources.group >= 0)
    group = sources.group[member]
    order = np.lexsort((np.linalg.norm(position[member] - sources.position[group], axis=1), group))
    middle = member[order[np.unique(group[order], return_index=True)[1]]]
    graph = point_graph(sources.system, points.edge_point).tocoo()
    graph.data = np.linalg.norm(position[graph.row] - position[graph.col], axis=1)
    # points of two boundary edges may coincide, and a way of no length would be no way
    graph.data = np.maximum(graph.data, 1e-9 * min(sources.system.shape.spacing))
    distances = dijkstra(graph.tocsr(), directed=False, indices=middle)[:, middle]
    distances = (distances + distances.T) / 2
    reached = np.isfinite(distances)
    return np.asarray(np.where(reached, distances, distances[reached].max()))


@dataclass(frozen=True, eq=False)
class Relations:
    """How the sources of one shape lie to one another: what is compared between shapes.

    Parameters
    ----------
    weights
        ``(n_sources,)`` share of each source in the boundary.
    distances
        ``(n_sources, n_sources)`` distances by interactions and along the boundary together, of root mean
        square 1.
    profiles
        ``(n_sources, n_quantiles)`` quantiles of the distances from each source to the boundary, which do not
        depend on how it is divided into sources.
    """

    weights: NDArray[np.float64]
    distances: NDArray[np.float64]
    profiles: NDArray[np.float64]


def relations(fields: SourceFields) -> Relations:
    """Measure how the sources of one shape lie to one another."""
    measure = fields.sources.measure
    weights = measure / measure.sum()
    square = np.zeros((weights.size, weights.size))
    shares = ((1 - _ALONG, source_distances(fields)), (_ALONG, boundary_distances(fields.sources)))
    for share, distances in shares:
        mean = float(weights @ np.square(distances) @ weights)
        square += share * np.square(distances) / max(mean, np.finfo(float).tiny)
    distances = np.sqrt(square)
    quantiles = (np.arange(_QUANTILES) + 0.5) / _QUANTILES
    profiles = np.empty((weights.size, _QUANTILES))
    for i, order in enumerate(np.argsort(distances, axis=1)):
        share = weights[order]
        profiles[i] = np.interp(quantiles, np.cumsum(share) - share / 2, distances[i, order])
    return Relations(weights, distances, profiles)


def align(first: Relations, second: Relations) -> Coupling:
    """Put the sources of two shapes in correspondence so that the distances among them agree.

    Limbs that a symmetry of the shape exchanges may be exchanged: distances hardly tell left from right.
    """
    distances, weights = (first.distances, second.distances), (first.weights, second.weights)
    return couple(distances, weights, profile_difference(first, second))


def profile_difference(first: Relations, second: Relations) -> NDArray[np.float64]:
    """``(n, m)`` mean square difference between the profiles of the sources of two shapes."""
    a, b = first.profiles, second.profiles
    square = np.square(a).sum(axis=1)[:, None] + np.square(b).sum(axis=1) - 2 * a @ b.T
    return np.asarray(np.maximum(square, 0.0) / a.shape[1])


def most_typical(shapes: Sequence[Relations]) -> int:
    """Return the shape whose sources differ least, in their profiles, from the most alike of the others."""
    total = np.zeros(len(shapes))
    for i, a in enumerate(shapes):
        for j, b in enumerate(shapes[:i]):
            difference = profile_difference(a, b)
            total[[i, j]] += a.weights @ difference.min(axis=1) + b.weights @ difference.min(axis=0)
    return int(np.argmin(total))
