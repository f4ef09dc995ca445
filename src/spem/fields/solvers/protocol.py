"""What a solver is, and what it returns."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from spem.errors import ConvergenceError
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


def relative_residual(
    system: System, values: NDArray[np.float64], rho: NDArray[np.float64]
) -> NDArray[np.float64]:
    """‖b - (A + M/ρ²) v‖ / ‖b‖ of each field, in double precision."""
    product = system.matrix() @ values + (system.mass[:, None] * values) / np.square(rho)
    residual = np.linalg.norm(system.rhs[:, None] - product, axis=0)
    return np.asarray(residual / np.linalg.norm(system.rhs))
