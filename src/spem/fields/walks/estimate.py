"""The field by chance: walks counted where they end, with confidence intervals (3.1)."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from spem.errors import ParameterError
from spem.fields.boundary.sources import Sources
from spem.fields.walks.intervals import LEVEL, Estimate
from spem.fields.walks.killed import (
    Walk,
    killed_walk,
    require_count,
    require_nodes,
    require_plain,
    require_same_edges,
)
from spem.fields.walks.steps import count_ends, discount, step_table, streams


def estimate_field(
    place: Any,
    rho: float | None = None,
    *,
    nodes: ArrayLike,
    n_walks: int,
    rng: np.random.Generator,
    level: float = LEVEL,
    comparisons: int = 1,
) -> Estimate:
    """Estimate v at some nodes as the share of random walks that reach the boundary (3.1).

    Walks are bounded by nothing but their ends: a walk takes `expected_steps` steps on average, up to the
    square of the shape's width in voxels, at some 7 ns each. Each node has a stream of random numbers of its
    own, so its walks do not depend on which other nodes come after it.

    Parameters
    ----------
    place
        A shape or a system, with `rho`; or a `Walk`, which has its own.
    rho
        Screening length in the unit of the spacing; `inf` is allowed.
    nodes
        ``(n,)`` node numbers.
    n_walks
        Number of walks from each node; the standard error is √(v (1 - v) / n_walks).
    rng
        Randomness.
    level, comparisons
        As `Estimate` has them.

    Raises
    ------
    ParameterError
        When a node does not exist, there is no walk, or an argument is out of its range.

    Examples
    --------
    >>> from spem.shapes.shape import Shape
    >>> line, rng = Shape.from_mask(np.ones(3)), np.random.default_rng(0)
    >>> found = estimate_field(line, 1.0, nodes=[0, 1], n_walks=10_000, rng=rng)
    >>> import spem
    >>> found.covers(spem.field(line, 1.0)[[0, 1]])
    array([ True,  True])
    """
    walk = _walk(place, rho)
    everywhere = np.zeros(walk.log_boundary.size, np.int64)
    starts, counts, steps = _count(walk, everywhere, nodes, n_walks, rng)
    return Estimate(starts, n_walks, counts[:, 0], steps, level, comparisons)


def estimate_sources(
    walk: Walk,
    sources: Sources,
    *,
    nodes: ArrayLike,
    n_walks: int,
    rng: np.random.Generator,
    level: float = LEVEL,
    comparisons: int = 1,
) -> Estimate:
    """Estimate v^{p_i} of every source at some nodes: the share of walks that end in it (2.2, 3.1).

    Parameters
    ----------
    walk
        A killed walk.
    sources
        Sources on the boundary of the same system.
    nodes, n_walks, rng, level, comparisons
        As for `estimate_field`.

    Raises
    ------
    ParameterError
        When the sources are of another system, a node does not exist or an argument is out of its range.

    Examples
    --------
    >>> from spem.fields.boundary.sources import point_sources
    >>> from spem.shapes.shape import Shape
    >>> walk = killed_walk(Shape.from_mask(np.ones(3)), np.inf, boundary="voxel")
    >>> sources, rng = point_sources(walk.system), np.random.default_rng(0)
    >>> found = estimate_sources(walk, sources, nodes=[0], n_walks=10_000, rng=rng)
    >>> found.covers([[0.75, 0.25]])
    array([[ True,  True]])
    """
    require_same_edges(walk, sources)
    group = np.where(sources.edge_source >= 0, sources.edge_source, sources.n_sources)
    starts, counts, steps = _count(walk, group.astype(np.int64), nodes, n_walks, rng)
    return Estimate(starts, n_walks, counts[:, : sources.n_sources], steps, level, comparisons)


def sample_discounts(
    walk: Walk, *, nodes: ArrayLike, n_walks: int, rng: np.random.Generator
) -> NDArray[np.float64]:
    """Let walks that are never killed reach the boundary, and return what each arrival counts (3.1).

    An arrival counts by the product of the chances to survive along its way. The mean is v, as that of walks
    which are killed, with a smaller variance, for longer walks.

    Parameters
    ----------
    walk
        A walk as `killed_walk` makes it.
    nodes, n_walks, rng
        As for `estimate_field`.

    Returns
    -------
    discounts
        ``(n, n_walks)``, in [0, 1].

    Raises
    ------
    ParameterError
        When a node does not exist, an argument is out of its range, or the walk is transformed.

    Examples
    --------
    >>> from spem.shapes.shape import Shape
    >>> walk = killed_walk(Shape.from_mask(np.ones(1)), 1.0, boundary="voxel")
    >>> sample_discounts(walk, nodes=[0], n_walks=3, rng=np.random.default_rng(0)).round(3)
    array([[0.667, 0.667, 0.667]])
    """
    require_plain(walk)
    starts, free = require_nodes(walk, nodes), killed_walk(walk.system, np.inf)
    require_count("n_walks", n_walks)
    target = targets(walk, np.zeros(walk.log_boundary.size, np.int64))
    table, survival = step_table(free), 1 - walk.killing
    states, result = streams(starts.size, rng), np.empty((starts.size, n_walks))
    for i, node in enumerate(starts):
        discount(int(node), states[i], table, target, survival, result[i])
    return result


def targets(walk: Walk, group: NDArray[np.int64]) -> NDArray[np.int32]:
    """Return where each edge leads, ``(n_nodes, 2 d)``: a node, or -1 - g for group g of the boundary."""
    domain = walk.system.domain
    target = domain.neighbours.copy()
    target[domain.boundary_edges] = -1 - group
    return target


def _walk(place: Any, rho: float | None) -> Walk:
    """Return the walk on a shape or a system, or the one given."""
    if isinstance(place, Walk):
        if rho is not None:
            msg = f"rho={rho!r}: a walk has its own; leave it out, or give the shape"
            raise ParameterError(msg)
        return place
    if rho is None:
        msg = "rho is missing: give the screening length of the walk, or inf"
        raise ParameterError(msg)
    return killed_walk(place, rho)


def _count(
    walk: Walk, group: NDArray[np.int64], nodes: ArrayLike, n_walks: int, rng: np.random.Generator
) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.float64]]:
    """Nodes, ``(n, n_groups)`` number of walks that end in each group, and mean number of steps."""
    starts = require_nodes(walk, nodes)
    require_count("n_walks", n_walks)
    table, target, states = step_table(walk), targets(walk, group), streams(starts.size, rng)
    counts = np.zeros((starts.size, int(group.max(initial=0)) + 1), np.int64)
    steps = [
        count_ends(int(node), n_walks, states[i], table, target, counts[i]) for i, node in enumerate(starts)
    ]
    return starts, counts, np.asarray(steps) / n_walks
