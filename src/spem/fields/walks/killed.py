"""The random walk whose chance to reach the boundary is the field (3.1)."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy.sparse
from numpy.typing import NDArray

from spem.errors import ParameterError, require_kind
from spem.fields.boundary.sources import Sources
from spem.fields.operator import Boundary, System, assemble
from spem.fields.rho import single_rho
from spem.shapes.shape import Shape

# Below this share of the spacing every walk is killed at its first step, and 1/ρ² may overflow.
_LEAST_RHO = 1e-6


@dataclass(frozen=True, eq=False)
class Walk:
    """A random walk on the nodes of a shape that ends on the boundary, or is killed on its way.

    From a node it steps along one of the 2d edges, with a chance in proportion to the conductance of the
    edge: 1/h², or 1/(θ h²) of a boundary edge, which ends it there. With the chance (M/ρ²)/(A + M/ρ²) of
    the diagonals it is killed instead. A positive function h on nodes and boundary turns the conductances
    into c̃_xy = h(x) h(y) c_xy, Doob's transform (3.3); h = 1 is the walk itself.

    Parameters
    ----------
    system
        The operator whose edges are walked on.
    rho
        The screening length; a walk of ρ = `inf` is never killed.
    log_h
        ``(n_nodes,)`` natural logarithm of h at the nodes; -inf where no walk can be.
    log_boundary
        ``(n_boundary_edges,)`` that of h at the end of each boundary edge; -inf where no walk may end.

    Raises
    ------
    ParameterError
        When h has not one value for each node and each boundary edge, is infinite or NaN, or grows by more
        than a float64 holds along one edge.
    """

    system: System
    rho: float
    log_h: NDArray[np.float64]
    log_boundary: NDArray[np.float64]

    def __post_init__(self) -> None:
        system, name = self.system, self.system.shape.name
        wanted = (system.n_nodes,), system.domain.fraction.shape
        if (self.log_h.shape, self.log_boundary.shape) != wanted:
            got = f"{self.log_h.shape} and {self.log_boundary.shape}"
            msg = f"{name}: log h must be {wanted[0]} on nodes, {wanted[1]} on boundary edges, not {got}"
            raise ParameterError(msg)
        if not all((log < np.inf).all() for log in (self.log_h, self.log_boundary)):
            msg = f"{name}: log h must be below infinity and not NaN; take the logarithm of a positive h"
            raise ParameterError(msg)
        with np.errstate(over="ignore"):
            if not np.isfinite(np.exp(self._rise)).all():
                msg = f"{name}: h grows by more than 1e308 along one edge; use a smoother h"
                raise ParameterError(msg)

    @property
    def n_nodes(self) -> int:
        """Number of nodes."""
        return self.system.n_nodes

    @property
    def plain(self) -> bool:
        """Whether h = 1, as `killed_walk` makes it."""
        return not self.log_h.any() and not self.log_boundary.any()

    @property
    def shift(self) -> float:
        """1/ρ², zero for ρ = `inf`."""
        return float((1 / np.float64(self.rho)) ** 2)

    @cached_property
    def rate(self) -> NDArray[np.float64]:
        """``(n_nodes,)`` diagonal of A + M/ρ²: conductances of all edges of a node, and its killing rate."""
        return np.asarray(self.system.diagonal + self.system.mass * self.shift)

    @cached_property
    def probability(self) -> NDArray[np.float64]:
        """``(n_nodes, 2 d)`` chance to step along each edge; that of a boundary edge is to end there.

        All zero at nodes where h is.
        """
        return np.asarray(self._plain * np.exp(self._rise))

    @cached_property
    def killing(self) -> NDArray[np.float64]:
        """``(n_nodes,)`` chance to be killed instead of making a step: 1 less the chances of all edges.

        It is zero, and the walk conservative, exactly where h solves (A + M/ρ²) h = b with its own boundary
        values; negative where h is no upper solution, so that there is no such walk. It is 1 where h is zero.
        """
        screening = self.system.mass * self.shift / self.rate
        killing = screening - (self._plain * np.expm1(self._rise)).sum(axis=1)
        return np.asarray(np.where(self.log_h == -np.inf, 1.0, killing))

    @cached_property
    def transition(self) -> scipy.sparse.csr_array:
        """``(n_nodes, n_nodes)`` chance of a step from the node of the row to that of the column."""
        n = self.n_nodes
        node, direction = np.nonzero(self.system.domain.neighbours < n)
        column = self.system.domain.neighbours[node, direction]
        return scipy.sparse.coo_array(
            (self.probability[node, direction], (node, column)), shape=(n, n)
        ).tocsr()

    @cached_property
    def edge_arrival(self) -> NDArray[np.float64]:
        """``(n_boundary_edges,)`` chance that the next step from its node goes over each boundary edge."""
        return self.probability[self.system.domain.boundary_edges]

    @cached_property
    def arrival(self) -> NDArray[np.float64]:
        """``(n_nodes,)`` chance that the next step ends on the boundary."""
        node, _ = self.system.domain.boundary_edges
        return np.bincount(node, self.edge_arrival, self.n_nodes).astype(np.float64)

    @cached_property
    def _plain(self) -> NDArray[np.float64]:
        """Chances of the edges where h = 1."""
        domain = self.system.domain
        conductance = np.repeat(self.system.weights, 2)[None, :].repeat(self.n_nodes, axis=0)
        conductance[domain.boundary_edges] /= domain.fraction
        return np.asarray(conductance / self.rate[:, None])

    @cached_property
    def _rise(self) -> NDArray[np.float64]:
        """``(n_nodes, 2 d)`` log h at the end of each edge less that at its node; -inf where h is 0."""
        domain = self.system.domain
        ends = np.append(self.log_h, -np.inf)[domain.neighbours]
        ends[domain.boundary_edges] = self.log_boundary
        start = np.where(self.log_h == -np.inf, 0.0, self.log_h)[:, None]
        return np.where(self.log_h[:, None] == -np.inf, -np.inf, ends - start)

    def __repr__(self) -> str:
        kind = "as it is" if self.plain else "transformed"
        return f"Walk({self.system.shape.name!r}, {self.n_nodes} nodes, rho {self.rho:.4g}, {kind})"


def killed_walk(place: Shape | System, rho: float, *, boundary: Boundary = "surface") -> Walk:
    """Return the random walk behind (A + M/ρ²) v = b: v(x) is its chance to reach the boundary from x (3.1).

    Divided by the diagonal the equation reads v(x) = Σ p_xy v(y) + p_x∂ with what is left, of each row, the
    chance to be killed. As well: a walk that is never killed, whose arrival counts by the product of the
    chances 1 - `killing` along its way; v(x) is the mean of that discounted arrival.

    Parameters
    ----------
    place
        A shape, or a system made of one.
    rho
        Screening length in the unit of the spacing; `inf` for a walk that is never killed.
    boundary
        ``"surface"`` or ``"voxel"``; that of a system is its own.

    Raises
    ------
    ParameterError
        When ρ is not one positive number or far below the spacing, or there is no shape.

    Examples
    --------
    >>> from spem.shapes.shape import Shape
    >>> walk = killed_walk(Shape.from_mask(np.ones(3)), 1.0, boundary="voxel")
    >>> walk.transition.toarray().round(2), walk.arrival.round(2), walk.killing.round(2)
    (array([[0.  , 0.33, 0.  ],
           [0.33, 0.  , 0.33],
           [0.  , 0.33, 0.  ]]), array([0.33, 0.  , 0.33]), array([0.33, 0.33, 0.33]))
    """
    if isinstance(place, System):
        system = place
    else:
        require_kind(place, Shape, "read it first: spem.read(...)")
        system = assemble(place, boundary)
    length, unit = single_rho(rho), min(system.shape.spacing)
    if length < _LEAST_RHO * unit:
        msg = (
            f"{system.shape.name}: rho={length:g} is below {_LEAST_RHO:g} of the spacing {unit:g}, where "
            "every walk is killed at once; use a larger rho or a finer spacing"
        )
        raise ParameterError(msg)
    return Walk(system, length, np.zeros(system.n_nodes), np.zeros(system.domain.fraction.size))


def require_walk(walk: object) -> None:
    """Refuse anything but a walk."""
    require_kind(walk, Walk, "make it: spem.killed_walk(shape, rho)")


def require_nodes(walk: Walk, nodes: object) -> NDArray[np.int64]:
    """Return node numbers as an array; each must be that of a node.

    Raises
    ------
    ParameterError
        When one is no whole number or there is no such node, or none is given.

    Examples
    --------
    >>> require_nodes(killed_walk(Shape.from_mask(np.ones(3)), 1.0), 2)
    array([2])
    """
    require_walk(walk)
    numbers = np.atleast_1d(np.asarray(nodes))
    whole = numbers.ndim == 1 and numbers.size and numbers.dtype.kind in "iu"
    if not whole or numbers.min() < 0 or numbers.max() >= walk.n_nodes:
        msg = f"{walk.system.shape.name}: nodes are whole numbers from 0 to {walk.n_nodes - 1}, got {nodes!r}"
        raise ParameterError(msg)
    return numbers.astype(np.int64)


def require_node(walk: Walk, node: object) -> int:
    """Return the number of one node, as `require_nodes` does."""
    numbers = require_nodes(walk, node)
    if numbers.size != 1:
        msg = f"{walk.system.shape.name}: expected one node, got {node!r}"
        raise ParameterError(msg)
    return int(numbers[0])


def require_plain(walk: Walk) -> None:
    """Refuse a walk that was transformed."""
    require_walk(walk)
    if not walk.plain:
        msg = f"{walk.system.shape.name}: this walk is transformed already; give it as killed_walk makes it"
        raise ParameterError(msg)


def require_count(name: str, value: object) -> None:
    """Refuse a number that is no positive whole number."""
    if not isinstance(value, (int, np.integer)) or isinstance(value, bool) or value < 1:
        msg = f"{name}={value!r}: expected a whole number of at least 1"
        raise ParameterError(msg)


def require_same_edges(walk: Walk, sources: Sources) -> None:
    """Refuse sources on the boundary of another system."""
    require_kind(sources, Sources, "make them: spem.sources(shape)")
    require_walk(walk)
    mine = walk.system
    if sources.system.shape is not mine.shape or sources.system.boundary != mine.boundary:
        what = f"{sources.system.shape.name!r}, {sources.system.boundary}"
        msg = (
            f"the sources are of {what}, the walk is on {mine.shape.name!r}, {mine.boundary}; "
            "make both of one system"
        )
        raise ParameterError(msg)
