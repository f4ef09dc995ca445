"""What becomes of a walk on average: how long it lasts, where and when it arrives (3.1)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from spem.errors import ParameterError
from spem.fields.boundary.sources import Sources
from spem.fields.solvers.direct import Direct
from spem.fields.walks.killed import Walk, require_count, require_node, require_same_edges, require_walk

# Natural logarithms that a float64 still holds, with room for what they are multiplied by.
_DEEPEST = 600.0


def expected_steps(walk: Walk) -> NDArray[np.float64]:
    """Return the mean number of steps until a walk from each node ends, on the boundary or killed.

    That is (1/h) (A + M/ρ²)⁻¹ (D h) with D the diagonal. It grows with the square of the width of the shape
    in voxels, up to about 1 + 2 d ρ²/h² on a grid of spacing h.

    Parameters
    ----------
    walk
        A killed walk, or one conditioned on a solution h.

    Returns
    -------
    steps
        ``(n_nodes,)``; NaN where h is zero.

    Raises
    ------
    ParameterError
        When h falls by more than a float64 holds.

    Examples
    --------
    >>> from spem.fields.walks.killed import killed_walk
    >>> from spem.shapes.shape import Shape
    >>> expected_steps(killed_walk(Shape.from_mask(np.ones(3)), np.inf, boundary="voxel")).round(6)
    array([3., 4., 3.])
    """
    require_walk(walk)
    return _lifetime(walk, walk.rate)


def expected_time(walk: Walk) -> NDArray[np.float64]:
    """Return the mean time until a walk from each node ends, in units of length².

    Between two steps it waits M/D on average, as the diffusion ∂u/∂t = Δu does. Conditioned on h = v this is
    -∂(log v)/∂(1/ρ²).

    Parameters
    ----------
    walk
        A killed walk, or one conditioned on a solution h.

    Returns
    -------
    time
        ``(n_nodes,)``; NaN where h is zero.

    Raises
    ------
    ParameterError
        When h falls by more than a float64 holds.

    Examples
    --------
    >>> from spem.fields.walks.killed import killed_walk
    >>> from spem.shapes.synthetic import interval
    >>> time = expected_time(killed_walk(interval(length=8.0, spacing=0.1), np.inf))
    >>> round(float(time.max()), 2)  # (length / 2)² / 2
    8.0
    """
    require_walk(walk)
    return _lifetime(walk, walk.system.mass)


def arrival_probabilities(walk: Walk, sources: Sources) -> NDArray[np.float64]:
    """Return the chance that a killed walk from each node ends in each source: v^{p_i} (2.2, 3.1).

    Parameters
    ----------
    walk
        A walk as `killed_walk` makes it, or conditioned on a solution h.
    sources
        Sources on the boundary of the same system.

    Returns
    -------
    probability
        ``(n_sources, n_nodes)``; their sum over sources that hold the whole boundary is v.

    Raises
    ------
    ParameterError
        When the sources are of another system, or h falls by more than a float64 holds.

    Examples
    --------
    >>> from spem.fields.boundary.sources import point_sources
    >>> from spem.fields.walks.killed import killed_walk
    >>> from spem.shapes.shape import Shape
    >>> walk = killed_walk(Shape.from_mask(np.ones(3)), np.inf, boundary="voxel")
    >>> arrival_probabilities(walk, point_sources(walk.system))
    array([[0.75, 0.5 , 0.25],
           [0.25, 0.5 , 0.75]])
    """
    require_same_edges(walk, sources)
    node, _ = walk.system.domain.boundary_edges
    _, h = _scaled(walk)
    rhs = np.zeros((walk.n_nodes, sources.n_sources))
    used = sources.edge_source >= 0
    np.add.at(rhs, (node[used], sources.edge_source[used]), (walk.edge_arrival * (walk.rate * h)[node])[used])
    solution = Direct().prepare(walk.system, walk.shift).solve(rhs)
    with np.errstate(invalid="ignore", divide="ignore"):
        return np.asarray((solution / h[:, None]).T)


def arrival_by_step(walk: Walk, node: int, n_steps: int) -> NDArray[np.float64]:
    """Return the chance that a walk from a node reaches the boundary at each of its first steps.

    For the walk that is never killed it is the discounted arrival: the chance of the step times the mean
    product of survivals along the way.

    Parameters
    ----------
    walk
        Any walk.
    node
        Where it starts.
    n_steps
        How many steps to look at.

    Returns
    -------
    probability
        ``(n_steps,)``; the sum over all steps is v at the node.

    Raises
    ------
    ParameterError
        When there is no such node, or the number is no whole one.

    Examples
    --------
    >>> from spem.fields.walks.killed import killed_walk
    >>> from spem.shapes.shape import Shape
    >>> walk = killed_walk(Shape.from_mask(np.ones(3)), np.inf, boundary="voxel")
    >>> arrival_by_step(walk, 1, 4)
    array([0. , 0.5 , 0. , 0.25])
    """
    start = require_node(walk, node)
    require_count("n_steps", n_steps)
    place = np.zeros(walk.n_nodes)
    place[start] = 1.0
    backward = walk.transition.T.tocsr()
    result = np.empty(n_steps)
    for step in range(n_steps):
        result[step] = place @ walk.arrival
        place = backward @ place
    return result


def _lifetime(walk: Walk, each: NDArray[np.float64]) -> NDArray[np.float64]:
    """Sum of what each visit to a node counts, over a walk from each node: (1/h) (A + M/ρ²)⁻¹ (each · h)."""
    factor, (reached, h) = Direct().prepare(walk.system, walk.shift), _scaled(walk)
    total = factor.solve(each * h)
    return np.asarray(np.divide(total, h, out=np.full(walk.n_nodes, np.nan), where=reached))


def _scaled(walk: Walk) -> tuple[NDArray[np.bool_], NDArray[np.float64]]:
    """Where h is positive, and h in units of its largest value."""
    reached = walk.log_h > -np.inf
    if not reached.any():
        msg = f"{walk.system.shape.name}: h is zero everywhere, so there is no walk"
        raise ParameterError(msg)
    log = walk.log_h - walk.log_h[reached].max()
    if log[reached].min() < -_DEEPEST:
        msg = (
            f"{walk.system.shape.name}: h falls by e^{log[reached].min():.0f}, more than a float64 holds; "
            "use a larger rho or a nearer source"
        )
        raise ParameterError(msg)
    return reached, np.exp(log)
