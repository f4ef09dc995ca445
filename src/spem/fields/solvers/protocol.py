"""What a solver is, and what it returns."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar, Protocol

import numpy as np
from numpy.typing import NDArray

from spem.errors import ConvergenceError, ParameterError
from spem.fields.operator import System


@dataclass(frozen=True, eq=False)
class Solution:
    """Outcome of a solve, converged or not.

    Parameters
    ----------
    values
        ``(n_nodes, n_rho)`` best iterate.
    residual
        ``(n_rho,)`` size of the true residual of each field, in the norm that the solver stops on.
    converged
        Whether every residual is within the solver's tolerance.
    iterations
        Iterations spent on all fields; 0 for a direct solve.
    advice
        What to do when the solve did not converge.
    """

    values: NDArray[np.floating[Any]]
    residual: NDArray[np.float64]
    converged: bool
    iterations: int
    advice: str = ""

    def checked(self, name: str) -> Solution:
        """Return the solution if it converged, raise `ConvergenceError` otherwise."""
        if self.converged:
            return self
        msg = f"{name}: residual {self.residual.max():.1e} after {self.iterations} iterations; {self.advice}"
        raise ConvergenceError(msg, self)


class Solver(Protocol):
    """Solves (A + M/ρ²) v = b for one or more ρ."""

    def solve(self, system: System, rho: NDArray[np.float64]) -> Solution:
        """Fields ``(n_nodes, n_rho)`` of finite or infinite ρ > 0."""
        ...


class Prepared(Protocol):
    """A + M/ρ² of one ρ, made ready for any number of right-hand sides."""

    def solve(self, rhs: NDArray[np.float64]) -> NDArray[np.float64]:
        """Solutions of right-hand sides ``(n_nodes,)`` or ``(n_nodes, k)``, in the same form."""
        ...


def require_solver(solver: Any) -> None:
    """Raise a `ParameterError` unless a solver is one, or None for that which is usual.

    Examples
    --------
    >>> require_solver("multigrid")
    Traceback (most recent call last):
        ...
    spem.errors.ParameterError: solver='multigrid': expected a solver, such as spem.MultigridGradients()
    """
    if solver is not None and (isinstance(solver, type) or not callable(getattr(solver, "solve", None))):
        msg = f"solver={solver!r}: expected a solver, such as spem.MultigridGradients()"
        raise ParameterError(msg)


class SourceSolver(Solver, Protocol):
    """A solver that takes right-hand sides other than b: those of single boundary sources (2.2)."""

    #: Whether every entry of a solution is right in relative terms, however small, so that its logarithm is
    #: right too; otherwise a solution is right relative to its maximum.
    entrywise: ClassVar[bool]

    def prepare(self, system: System, shift: float) -> Prepared:
        """Make A + shift·M ready."""
        ...


def deficit_residual(system: System, u: NDArray[np.float64], rho: NDArray[np.float64]) -> NDArray[np.float64]:
    """‖s M (1 - u) - A u‖ / ‖s M·1‖, s = 1/ρ², of each deficit u = 1 - v; zero for ρ = inf.

    Because A + s M ≥ s M, it bounds the root mean square error of the field, whatever ρ is; ‖b‖ would not,
    since it is dominated by edges that are cut short.
    """
    source = system.mass[:, None] / np.square(rho)
    residual = np.linalg.norm(source * (1 - u) - system.matrix() @ u, axis=0)
    return np.asarray(
        np.divide(residual, np.linalg.norm(source, axis=0), out=np.zeros(rho.size), where=np.isfinite(rho))
    )


def relative_residual(
    system: System, values: NDArray[np.float64], rho: NDArray[np.float64]
) -> NDArray[np.float64]:
    """‖b - (A + M/ρ²) v‖ / ‖b‖ of each field."""
    product = system.matrix() @ values + (system.mass[:, None] * values) / np.square(rho)
    residual = np.linalg.norm(system.rhs[:, None] - product, axis=0)
    return np.asarray(residual / np.linalg.norm(system.rhs))
