"""Gradients of node fields, with what the boundary edges know; of logarithms without underflow."""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import ArrayLike, NDArray

from spem.errors import ParameterError
from spem.fields.boundary.sources import check_source
from spem.fields.domain import Domain
from spem.fields.operator import System
from spem.fields.superposition.fields import SourceFields, require_fields

# Ratios between neighbours beyond e^600 are taken for that, so that their squares are finite.
_MAX_LOG = 600.0


def gradient(system: System, values: ArrayLike, *, boundary: ArrayLike | None = None) -> NDArray[np.float64]:
    """Return the gradient of a node field.

    Along each axis the derivative of the parabola through a node and the two ends of its edges; where an
    edge is cut, its end lies on the boundary. Second order where the boundary values are known.

    Parameters
    ----------
    system
        The system whose nodes carry the field.
    values
        ``(n_nodes,)`` the field.
    boundary
        Its value on the boundary: one number, or ``(n_boundary_edges,)`` in the order of
        `Domain.boundary_edges`; NaN or None where it is not known. There the difference to the
        other side is taken, first order; with none, zero.

    Returns
    -------
    gradient
        ``(n_nodes, d)``, in units of the values over those of the spacing.

    Raises
    ------
    ParameterError
        If there is not one finite value for each node, or not one for each boundary edge.

    Examples
    --------
    >>> from spem.fields.operator import assemble
    >>> from spem.shapes.shape import Shape
    >>> gradient(assemble(Shape.from_mask(np.ones(3))), [0.5, 1.5, 2.5], boundary=[0.0, 3.0]).ravel()
    array([1., 1., 1.])
    """
    nodal = _node_field(system, values)
    if not np.isfinite(nodal).all():
        msg = f"{system.shape.name}: a gradient needs finite values; of logs with -inf take log_gradient"
        raise ParameterError(msg)
    ends = _edge_values(system, np.nan if boundary is None else boundary)
    return np.asarray(_differences(nodal, ends, *_tables(system), False))


def log_gradient(
    system: System, log: ArrayLike, *, log_boundary: ArrayLike | None = None
) -> NDArray[np.float64]:
    """Return ∇(log v) = ∇v/v of a positive field given by its logarithm.

    The differences are those of v, in units of the value at each node, so they are right however small v is.

    Parameters
    ----------
    system
        The system whose nodes carry the field.
    log
        ``(n_nodes,)`` natural logarithm of the field, -inf where it is zero.
    log_boundary
        The logarithm on the boundary, as `boundary` of `gradient`: 0 where v = 1, -inf where v = 0, NaN or
        None where it is not known.

    Returns
    -------
    gradient
        ``(n_nodes, d)``, in 1 over the unit of the spacing; zero where the field is zero.

    Raises
    ------
    ParameterError
        If there is not one value below infinity for each node, or not one for each boundary edge.

    Examples
    --------
    >>> from spem.fields.operator import assemble
    >>> from spem.shapes.shape import Shape
    >>> system = assemble(Shape.from_mask(np.ones(3)), "voxel")
    >>> log_gradient(system, np.log([1.0, 2.0, 3.0]) - 900, log_boundary=[-np.inf, np.log(4) - 900]).ravel()
    array([1.        , 0.5       , 0.33333333])
    """
    nodal = _node_field(system, log)
    if not (nodal < np.inf).all():
        msg = f"{system.shape.name}: logarithms of a field must be below infinity and not NaN"
        raise ParameterError(msg)
    ends = _edge_values(system, np.nan if log_boundary is None else log_boundary)
    return np.asarray(_differences(nodal, ends, *_tables(system), True))


def source_gradient(fields: SourceFields, source: int) -> NDArray[np.float64]:
    """Return ∇(log v^{p_i}) of the field of one source: its direction is that of ∇v^{p_i} (Fig. 5).

    Parameters
    ----------
    fields
        Fields of boundary sources.
    source
        Number of the source.

    Returns
    -------
    gradient
        ``(n_nodes, d)``; zero in components that the source does not touch.

    Raises
    ------
    ParameterError
        If there is no such source.

    Examples
    --------
    >>> import spem
    >>> sources = spem.sources(spem.Shape.from_mask(np.ones(3)), boundary="voxel")
    >>> source_gradient(spem.source_fields(sources, np.inf), 0).round(2).ravel()
    array([-0.33, -0.5 , -1.  ])
    """
    require_fields(fields)
    check_source(fields.sources, source)
    with np.errstate(divide="ignore"):
        ends = np.log((fields.sources.edge_source == source).astype(np.float64))
    return log_gradient(fields.sources.system, fields.log[source], log_boundary=ends)


def unit_vectors(vectors: ArrayLike) -> NDArray[np.float64]:
    """Return vectors divided by their length, ∇v/|∇v| of gradients; those of length zero stay zero.

    Parameters
    ----------
    vectors
        ``(..., d)`` vectors.

    Examples
    --------
    >>> unit_vectors([[3e-200, 4e-200], [0.0, 0.0]])
    array([[0.6, 0.8],
           [0. , 0. ]])
    """
    array = np.asarray(vectors, np.float64)
    largest = np.abs(array).max(axis=-1, keepdims=True)  # squares of the lengths could underflow
    scaled = np.divide(array, largest, out=np.zeros_like(array), where=largest > 0)
    length = np.linalg.norm(scaled, axis=-1, keepdims=True)
    return np.asarray(np.divide(scaled, length, out=scaled, where=length > 0))


def _node_field(system: System, values: ArrayLike) -> NDArray[np.float64]:
    """Return values as an array, one a node."""
    nodal = np.ascontiguousarray(values, np.float64)
    if nodal.shape != (system.n_nodes,):
        msg = f"{system.shape.name}: a field must be ({system.n_nodes},), one a node, not {nodal.shape}"
        raise ParameterError(msg)
    return nodal


def _edge_values(system: System, values: ArrayLike) -> NDArray[np.float64]:
    """Return boundary values as an array, one a boundary edge."""
    given, n_edges = np.asarray(values, np.float64), system.domain.fraction.size
    if given.shape not in ((), (n_edges,)):
        msg = (
            f"{system.shape.name}: boundary values must be one number or ({n_edges},), one a boundary edge, "
            f"not {given.shape}"
        )
        raise ParameterError(msg)
    return np.ascontiguousarray(np.broadcast_to(given, (n_edges,)))


def _tables(system: System) -> tuple[NDArray[np.int32], NDArray[np.float64], NDArray[np.float64]]:
    """Neighbours, cut fractions and spacing."""
    domain: Domain = system.domain
    return domain.neighbours, domain.fraction, np.asarray(system.shape.spacing, np.float64)


@njit(cache=True, nogil=True)
def _differences(
    values: NDArray[np.float64],
    boundary: NDArray[np.float64],
    neighbours: NDArray[np.int32],
    fraction: NDArray[np.float64],
    spacing: NDArray[np.float64],
    logarithmic: bool,
) -> NDArray[np.float64]:
    """Differentiate along each axis, of logarithms their exponentials in units of that at the node."""
    n, d = neighbours.shape[0], spacing.size
    result = np.zeros((n, d))
    edge = 0
    for i in range(n):
        for k in range(2 * d):
            j = neighbours[i, k]
            far, length = (values[j], 1.0) if j < n else (boundary[edge], fraction[edge])
            edge += j == n
            rise = far - values[i]
            if logarithmic and values[i] == -np.inf:
                rise = np.nan
            elif logarithmic:
                rise = np.expm1(min(rise, _MAX_LOG))
            slope = rise / length if k % 2 else -rise / length
            if k % 2 == 0:
                lower, below = slope, length
            elif np.isnan(lower) or np.isnan(slope):
                known = slope if np.isnan(lower) else lower
                result[i, k // 2] = 0.0 if np.isnan(known) else known / spacing[k // 2]
            else:  # the slope of the parabola: that of each side counts by the length of the other
                mean = (lower * length + slope * below) / (below + length)
                result[i, k // 2] = mean / spacing[k // 2]
    return result
