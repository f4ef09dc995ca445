"""What boundary sources do to each other through the shape: the matrix of their fluxes, and its distances."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from spem.errors import ParameterError, require_kind
from spem.fields.boundary.sources import Sources
from spem.fields.superposition.fields import Progress, SourceFields, require_fields, solve_sources

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class BoundaryResponse:
    """Fluxes of the field of each source through the boundary of each other.

    F(p, q) = ∫_p |∂v^q/∂n| is what flows out at source p while q is held at 1 and the rest of the boundary
    at 0. It is symmetric, to rounding. A flux falls like exp(−d/ρ) with the length d of the way through the
    shape, and faster through what is narrow against ρ.

    Parameters
    ----------
    sources
        The sources.
    rho
        The screening length; `inf` for the Laplace equation.
    log
        ``(n_sources, n_sources)`` natural logarithm of the fluxes, in length^(d-2); -inf where no way leads
        from one source to the other. On the diagonal, where the flux has no limit as the grid is refined, it
        is that of the field at the nodes next to the source.
    """

    sources: Sources
    rho: float
    log: Array

    @cached_property
    def distances(self) -> Array:
        """``(n_sources, n_sources)`` lengths of ways: −ρ log of fluxes between like sources.

        Fluxes are divided by the measures of both sources. Half the mean of a source's logarithms is taken
        off: half of its own strength, which is left where the boundary bends, and no more, since the whole
        mean would take off how far it lies from the others too. The least length of a source to itself is
        zero. Infinite where no way leads; without screening, ρ = `inf`, they are plain −log.
        """
        measure = np.log(self.sources.measure)
        log = self.log - measure[:, None] - measure
        reached = np.isfinite(log)
        strength = np.where(reached, log, 0.0).sum(axis=1) / np.maximum(reached.sum(axis=1), 1) / 2
        length = strength[:, None] + strength - log
        unit = self.rho if np.isfinite(self.rho) else 1.0
        return np.asarray((length - length.diagonal().min()) * unit)

    def __repr__(self) -> str:
        name, n = self.sources.system.shape.name, len(self.log)
        return f"BoundaryResponse({name!r}, {n} x {n} sources, rho {self.rho:.4g})"


def boundary_response(sources: Sources, rho: float, *, progress: Progress | None = None) -> BoundaryResponse:
    """Solve for the fluxes between all pairs of sources: one factorisation, one field a source.

    Parameters
    ----------
    sources
        The sources.
    rho
        The screening length in the unit of the spacing; `inf` for the Laplace equation.
    progress
        As `spem.fields.superposition.fields.solve_sources` calls it.

    Raises
    ------
    ParameterError
        If ρ is not a positive length.
    SizeError
        If the fields do not fit in memory.

    Examples
    --------
    Between the ends of an interval of length L it is 1/(ρ sinh(L/ρ)):

    >>> import spem
    >>> sources = spem.sources(spem.synthetic.interval(1.0, 0.001))
    >>> flux = np.exp(boundary_response(sources, 0.2).log[0, 1])
    >>> print(round(float(flux * 0.2 * np.sinh(1 / 0.2)), 4))
    1.0
    """
    require_kind(sources, Sources, "make them: spem.sources(shape)")
    return response_of(solve_sources(sources, rho, progress=progress))


def response_of(fields: SourceFields) -> BoundaryResponse:
    """Read the fluxes off fields that are solved for already; see `boundary_response`.

    Raises
    ------
    ParameterError
        If they are no fields of sources, or not of every boundary that their system has a source for.

    Examples
    --------
    >>> import spem
    >>> sources = spem.sources(spem.synthetic.interval(1.0, 0.01))
    >>> response_of(solve_sources(sources, 0.2))
    BoundaryResponse('interval', 2 x 2 sources, rho 0.2)
    """
    require_fields(fields)
    sources = fields.sources
    system = sources.system
    node, direction = system.domain.boundary_edges
    source = sources.edge_source
    edge = np.argsort(source, kind="stable")[np.count_nonzero(source < 0) :]
    first = np.flatnonzero(np.diff(source[edge], prepend=-1))
    if first.size != len(fields.log):
        msg = f"{system.shape.name}: {len(fields.log)} fields of {first.size} sources; solve for all of them"
        raise ParameterError(msg)
    cell = float(np.prod(system.shape.spacing))
    weight = np.log(cell * system.weights[direction[edge] // 2] / system.domain.fraction[edge])
    terms = fields.log[:, node[edge]] + weight
    peak = np.maximum.reduceat(terms, first, axis=1)
    level = np.where(np.isfinite(peak), peak, 0.0)
    count = np.diff(first, append=edge.size)
    with np.errstate(under="ignore", divide="ignore"):
        share = np.add.reduceat(np.exp(terms - np.repeat(level, count, axis=1)), first, axis=1)
        log = level + np.log(share)
    return BoundaryResponse(sources, fields.rho, (log + log.T) / 2)
