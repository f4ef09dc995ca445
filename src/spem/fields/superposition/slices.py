"""One slice of the hyperfield: boundary sources at one ρ, factored once, their fields in blocks."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spem.errors import ParameterError
from spem.fields.boundary.sources import Sources
from spem.fields.rho import single_rho
from spem.fields.solvers.direct import Direct
from spem.fields.solvers.protocol import Prepared, SourceSolver, require_solver
from spem.fields.superposition.tails import logs, scaled, solve_tails

# In units of the spacing: below it a field falls by more than 1e4 from node to node, and means nothing there,
# while its tails would be solved again every few dozen nodes.
_LEAST_RHO = 1e-2


@dataclass(frozen=True, eq=False)
class SourceSlice:
    """Sources at one ρ with their matrix factored; made by `prepare_slice`.

    Parameters
    ----------
    sources
        The sources.
    rho
        The screening length, or `inf`.
    solver
        What the matrix was prepared by.
    prepared
        A + M/ρ², ready to solve.
    """

    sources: Sources
    rho: float
    solver: SourceSolver
    prepared: Prepared

    def values(self, start: int, stop: int) -> NDArray[np.float64]:
        """Fields ``(stop - start, n_nodes)`` of consecutive sources."""
        if self.solver.entrywise:
            return np.asarray(np.exp(self.log(start, stop)))
        return np.ascontiguousarray(self.prepared.solve(self.sources.rhs[:, start:stop].toarray()).T)

    def log(self, start: int, stop: int) -> NDArray[np.float64]:
        """Logarithms of the fields, ``(stop - start, n_nodes)``; -inf in components that a source misses."""
        require_entrywise(self.solver)
        rhs, touched = self.sources.rhs[:, start:stop], self.sources.reach[start:stop].toarray()
        dense, exponent = scaled(rhs.toarray())
        log, low = logs(self.prepared.solve(dense), exponent)
        if not touched.all():
            apart = ~touched[:, self.sources.system.domain.component]
            log[apart] = -np.inf
            low &= ~apart
        if low.any():
            solve_tails(self.sources.system, self._shift, self.solver, rhs, log, low)
        return log

    @property
    def _shift(self) -> float:
        return float(self.rho**-2.0)


def prepare_slice(sources: Sources, rho: float, solver: SourceSolver | None = None) -> SourceSlice:
    """Factor A + M/ρ² for the sources of its system.

    Parameters
    ----------
    sources
        The sources.
    rho
        The screening length in the unit of the spacing; `inf` for the Laplace equation.
    solver
        `Direct` by default.

    Raises
    ------
    ParameterError
        If ρ is not one positive number, or the solver takes no right-hand sides but b.

    Examples
    --------
    >>> import numpy as np
    >>> from spem.fields.operator import assemble
    >>> from spem.fields.boundary.sources import point_sources
    >>> from spem.shapes.shape import Shape
    >>> sources = point_sources(assemble(Shape.from_mask(np.ones(3)), "voxel"))
    >>> prepare_slice(sources, np.inf).values(0, 2)
    array([[0.75, 0.5 , 0.25],
           [0.25, 0.5 , 0.75]])
    """
    length, least = single_rho(rho), _LEAST_RHO * min(sources.system.shape.spacing)
    if length < least:
        msg = f"rho={length:g}: expected at least {least:g}, a hundredth of the spacing, or inf"
        raise ParameterError(msg)
    chosen = source_solver(solver)
    return SourceSlice(sources, length, chosen, chosen.prepare(sources.system, length**-2.0))


def source_solver(solver: Any = None) -> SourceSolver:
    """Return the solver, `Direct` for None.

    Raises
    ------
    ParameterError
        If it is no solver, or takes no right-hand sides but b.
    """
    require_solver(solver)
    if solver is None:
        return Direct()
    if not hasattr(solver, "prepare"):
        msg = (
            f"solver={type(solver).__name__}: solves for the whole boundary only; for single sources use "
            "Direct, or MultigridGradients or ConjugateGradient for plain values"
        )
        raise ParameterError(msg)
    return solver  # type: ignore[no-any-return]


def require_entrywise(solver: SourceSolver) -> None:
    """Refuse logarithms of fields that are right only relative to their maximum.

    Raises
    ------
    ParameterError
        If the solver does not promise every entry.
    """
    if not solver.entrywise:
        msg = (
            f"solver={type(solver).__name__}: right only relative to each field's maximum, so logarithms of "
            "its fields would be wrong deep inside; use Direct"
        )
        raise ParameterError(msg)
