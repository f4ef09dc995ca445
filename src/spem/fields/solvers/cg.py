"""Plain conjugate gradients, one field at a time."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse
import scipy.sparse.linalg
from numpy.typing import NDArray

from spem.fields.operator import System
from spem.fields.solvers.protocol import Solution, relative_residual


@dataclass(frozen=True)
class ConjugateGradient:
    """Conjugate gradients with the diagonal as preconditioner.

    Parameters
    ----------
    rtol
        Tolerance on ‖b - (A + M/ρ²) v‖ / ‖b‖.
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

        columns = []
        for r in rho:
            shift = 1.0 / r**2
            matrix = system.matrix(shift).tocsr()
            jacobi = scipy.sparse.diags_array(1.0 / matrix.diagonal())
            v, _ = scipy.sparse.linalg.cg(
                matrix,
                system.rhs,
                x0=np.ones(system.n_nodes),
                rtol=self.rtol / 2,
                maxiter=self.max_iterations,
                M=jacobi,
                callback=count,
            )
            columns.append(v)
        values = np.stack(columns, axis=1)
        residual = relative_residual(system, values, rho)
        converged = bool(np.all(residual <= self.rtol))
        return Solution(values, residual, converged, spent, f"raise rtol={self.rtol:g} or max_iterations")
