"""Plain conjugate gradients, one field at a time."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse
import scipy.sparse.linalg
from numpy.typing import NDArray

from spem.fields.operator import System
from spem.fields.solvers.protocol import Solution, deficit_residual


@dataclass(frozen=True)
class ConjugateGradient:
    """Conjugate gradients with the diagonal as preconditioner, for the deficit 1 - v.

    Parameters
    ----------
    rtol
        Tolerance on `deficit_residual`, a bound of the root mean square error of each field.
    max_iterations
        Limit for each field.
    """

    rtol: float = 1e-10
    max_iterations: int = 10_000

    def solve(self, system: System, rho: NDArray[np.float64]) -> Solution:
        """Iterate for each ρ from v = 1, the solution for ρ = inf."""
        spent = 0

        def count(_: object) -> None:
            nonlocal spent
            spent += 1

        deficits = np.zeros((system.n_nodes, rho.size))
        for j in np.flatnonzero(np.isfinite(rho)):
            shift = rho[j] ** -2.0
            matrix = system.matrix(shift).tocsr()
            deficits[:, j], _ = scipy.sparse.linalg.cg(
                matrix,
                shift * system.mass,
                rtol=self.rtol / 2,
                maxiter=self.max_iterations,
                M=scipy.sparse.diags_array(1.0 / matrix.diagonal()),
                callback=count,
            )
        residual = deficit_residual(system, deficits, rho)
        converged = bool(np.all(residual <= self.rtol))
        return Solution(
            1.0 - deficits, residual, converged, spent, f"raise rtol={self.rtol:g} or max_iterations"
        )
