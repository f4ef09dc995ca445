"""Doob's h-transform: the walk conditioned on where it ends, as a walk with other conductances (3.3)."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import scipy.sparse
from numpy.typing import ArrayLike, NDArray

from spem.errors import ParameterError
from spem.fields.boundary.points import boundary_points
from spem.fields.boundary.sources import Sources, check_source
from spem.fields.superposition.fields import SourceFields, require_fields, solve_sources
from spem.fields.walks.killed import Walk, killed_walk, require_plain, require_walk

# Dense kernels: eigenvectors of more nodes than this take minutes.
_MOST_NODES = 4000


def transform_walk(walk: Walk, log_h: ArrayLike, log_boundary: ArrayLike = 0.0) -> Walk:
    """Return the walk with conductances c̃_xy = h(x) h(y) c_xy (3.3).

    If h solves (A + M/ρ²) h = b with its own boundary values, the new walk is never killed: it is the old one
    conditioned to end on the boundary, at each place in proportion to h there. For any other h its
    `killing` tells by how much h fails to be a solution.

    Parameters
    ----------
    walk
        A killed walk, or one transformed before.
    log_h
        ``(n_nodes,)`` natural logarithm of h.
    log_boundary
        That on the boundary: one number, or ``(n_boundary_edges,)``.

    Raises
    ------
    ParameterError
        When h has not one value for each node, is infinite or NaN, or rises too steeply.

    Examples
    --------
    >>> import spem
    >>> line = spem.Shape.from_mask(np.ones(3))
    >>> walk = killed_walk(line, 1.0)
    >>> bool(np.allclose(transform_walk(walk, np.log(spem.field(line, 1.0))).killing, 0, atol=1e-12))
    True
    """
    require_walk(walk)
    name, n_edges = walk.system.shape.name, walk.log_boundary.size
    nodes, edges = np.asarray(log_h, np.float64), np.asarray(log_boundary, np.float64)
    if nodes.shape != walk.log_h.shape:
        msg = f"{name}: log h must be ({walk.n_nodes},), one a node, not {nodes.shape}"
        raise ParameterError(msg)
    if edges.shape not in ((), (n_edges,)):
        msg = f"{name}: log h on the boundary must be one number or ({n_edges},), not {edges.shape}"
        raise ParameterError(msg)
    return replace(walk, log_h=walk.log_h + nodes, log_boundary=walk.log_boundary + edges)


def arriving_walk(walk: Walk) -> Walk:
    """Return a killed walk conditioned on reaching the boundary: h = v.

    Parameters
    ----------
    walk
        A walk as `killed_walk` makes it.

    Raises
    ------
    ParameterError
        When it is transformed already, or ρ is below a hundredth of the spacing.

    Examples
    --------
    >>> from spem.shapes.shape import Shape
    >>> arriving_walk(killed_walk(Shape.from_mask(np.ones(3)), 1.0, boundary="voxel")).probability
    array([[0.77777778, 0.22222222],
           [0.5       , 0.5       ],
           [0.22222222, 0.77777778]])
    """
    require_plain(walk)
    points = boundary_points(walk.system)
    whole = Sources(walk.system, points, np.zeros(points.n_points, np.int32))
    return transform_walk(walk, solve_sources(whole, walk.rho).log[0])


def source_walk(fields: SourceFields, source: int) -> Walk:
    """Return the walk conditioned on ending in one source before it is killed: h = v^{p_i}.

    Parameters
    ----------
    fields
        Fields of boundary sources.
    source
        Number of the source.

    Raises
    ------
    ParameterError
        When there is no such source.

    Examples
    --------
    >>> import spem
    >>> sources = spem.sources(spem.Shape.from_mask(np.ones(3)), boundary="voxel")
    >>> source_walk(spem.source_fields(sources, np.inf), 0).probability.round(3)
    array([[0.667, 0.333],
           [0.75 , 0.25 ],
           [1.   , 0.   ]])
    """
    require_fields(fields)
    check_source(fields.sources, source)
    with np.errstate(divide="ignore"):
        ends = np.log((fields.sources.edge_source == source).astype(np.float64))
    return transform_walk(killed_walk(fields.sources.system, fields.rho), fields.log[source], ends)


def conductances(walk: Walk) -> tuple[scipy.sparse.csr_array, NDArray[np.float64]]:
    """Return the conductances c̃_xy = h(x) h(y) c_xy of a walk's network (3.3).

    Parameters
    ----------
    walk
        A walk; values of h whose products a float64 does not hold become 0.

    Returns
    -------
    interior
        ``(n_nodes, n_nodes)`` symmetric, of the edges between nodes, in 1 over the square of the unit of the
        spacing, times h².
    boundary
        ``(n_boundary_edges,)`` of the boundary edges, in the order of `Domain.boundary_edges`.

    Examples
    --------
    >>> from spem.shapes.shape import Shape
    >>> walk = killed_walk(Shape.from_mask(np.ones(2)), 1.0, boundary="voxel")
    >>> interior, boundary = conductances(transform_walk(walk, np.log([2.0, 3.0])))
    >>> interior.toarray(), boundary
    (array([[0., 6.],
           [6., 0.]]), array([2., 3.]))
    """
    system, domain = walk.system, walk.system.domain
    n = walk.n_nodes
    node, direction = np.nonzero(domain.neighbours < n)
    column = domain.neighbours[node, direction]
    value = system.weights[direction // 2] * np.exp(walk.log_h[node] + walk.log_h[column])
    interior = scipy.sparse.coo_array((value, (node, column)), shape=(n, n)).tocsr()
    start, way = domain.boundary_edges
    ends = system.weights[way // 2] / domain.fraction * np.exp(walk.log_h[start] + walk.log_boundary)
    return interior, ends


def network_laplacian(walk: Walk) -> scipy.sparse.csr_array:
    """Return the generator of a walk's network: its conductances over the measure h²M (3.3).

    Minus it is the discrete Δ_μ̃ of the paper. If h is a solution it equals 1/h ∘ M⁻¹(A + M/ρ²) ∘ h, which is
    minus the right-hand side of (3.3).

    Parameters
    ----------
    walk
        A walk with h > 0 at every node.

    Returns
    -------
    laplacian
        ``(n_nodes, n_nodes)``: row x has Σ c̃_xy over all its edges on the diagonal and -c̃_xy off it, divided
        by h(x)² M_x.

    Examples
    --------
    >>> from spem.shapes.shape import Shape
    >>> network_laplacian(killed_walk(Shape.from_mask(np.ones(2)), np.inf, boundary="voxel")).toarray()
    array([[ 2., -1.],
           [-1.,  2.]])
    """
    interior, ends = conductances(walk)
    node, _ = walk.system.domain.boundary_edges
    total = interior.sum(axis=1) + np.bincount(node, ends, walk.n_nodes)
    measure = np.exp(2 * walk.log_h) * walk.system.mass
    network = scipy.sparse.diags_array(total) - interior
    return (scipy.sparse.diags_array(1 / measure) @ network).tocsr()


def drift(walk: Walk) -> NDArray[np.float64]:
    """Return the mean velocity of a walk at each node, which is 2 ∇(log h) of a conditioned one (3.3).

    In time of the diffusion ∂u/∂t = Δu the walk waits M/D at a node and then steps; away from the surface the
    velocity is twice the difference that `spem.fields.gradients.log_gradient` takes, to rounding.

    Parameters
    ----------
    walk
        Any walk.

    Returns
    -------
    velocity
        ``(n_nodes, d)``, in 1 over the unit of the spacing.

    Examples
    --------
    >>> from spem.shapes.shape import Shape
    >>> walk = killed_walk(Shape.from_mask(np.ones(3)), np.inf, boundary="voxel")
    >>> drift(transform_walk(walk, np.log([1.0, 2.0, 3.0]), np.log([0.5, 4.0]))).ravel()
    array([1.5       , 1.        , 0.66666667])
    """
    system, domain = walk.system, walk.system.domain
    length = np.ones_like(walk.probability)
    length[domain.boundary_edges] = domain.fraction
    moved = walk.probability * length
    along = (moved[:, 1::2] - moved[:, ::2]) * np.asarray(system.shape.spacing)
    return np.asarray(along * (walk.rate / system.mass)[:, None])


def transition_density(walk: Walk, time: float) -> NDArray[np.float64]:
    """Return the kernel p̃_t(x, y) of a walk's network with respect to its measure h²dμ (3.1, 3.4).

    With h = 1 and ρ = `inf` it is the heat kernel of the shape, absorbed by its boundary; h(x) p̃_t(x, y) h(y)
    is that of the walk killed at the rate 1/ρ².

    Parameters
    ----------
    walk
        A walk that is never killed, as a conditioned one is, with h > 0 at every node.
    time
        Time in units of length², at least 0.

    Returns
    -------
    density
        ``(n_nodes, n_nodes)`` symmetric, in 1 over the unit of the volume and of h².

    Raises
    ------
    ParameterError
        When the time is negative or the shape has too many nodes for dense matrices.

    Examples
    --------
    >>> from spem.shapes.synthetic import interval
    >>> walk = killed_walk(interval(length=20.0, spacing=0.25), np.inf)
    >>> density = transition_density(walk, 0.5)
    >>> round(float(density[40, 40]), 3), round(float((4 * np.pi * 0.5) ** -0.5), 3)  # (3.2)
    (0.402, 0.399)
    """
    name = walk.system.shape.name
    if walk.n_nodes > _MOST_NODES:
        msg = f"{name}: a dense kernel takes {_MOST_NODES} nodes at most, not {walk.n_nodes}; coarsen it"
        raise ParameterError(msg)
    if not 0 <= time < np.inf:
        msg = f"time={time!r}: expected a time of at least 0, in units of length²"
        raise ParameterError(msg)
    root = np.exp(walk.log_h) * np.sqrt(walk.system.mass)
    # similar to a symmetric matrix: multiplied by the root of the measure on the left, divided on the right
    symmetric = root[:, None] * network_laplacian(walk).toarray() / root
    values, vectors = np.linalg.eigh((symmetric + symmetric.T) / 2)
    kernel = (vectors * np.exp(-time * values)) @ vectors.T
    return np.asarray(kernel / (root[:, None] * root * np.prod(walk.system.shape.spacing)))
