"""Plain conjugate gradients, one field at a time."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import scipy.sparse
import scipy.sparse.linalg
from numpy.typing import NDArray

from spem.errors import ConvergenceError
from spem.fields.operator import System
from spem.fields.solvers.protocol import Solution, deficit_residual


@dataclass(frozen=True)
class ConjugateGradient:
    """Conjugate gradients with the diagonal as preconditioner, for the deficit 1 - v.

    Fields of single sources are right relative to their maximum only: deep inside they may even be negative.

    Parameters
    ----------
    rtol
        Tolerance on `deficit_residual`, a bound of the root mean square error of each field; for single
        sources on ‖b - (A + M/ρ²) v‖ / ‖b‖.
    max_iterations
        Limit for each field.
    """

    entrywise: ClassVar[bool] = False

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

    def prepare(self, system: System, shift: float) -> PreparedGradients:
        """Assemble A + shift·M; the result's ``solve`` takes any number of right-hand sides as columns."""
        return PreparedGradients(system.matrix(shift).tocsr(), self, system.shape.name)


@dataclass(frozen=True, eq=False)
class PreparedGradients:
    """One matrix for conjugate gradients.

    Parameters
    ----------
    matrix
        ``(n_nodes, n_nodes)`` A + M/ρ².
    solver
        Tolerance and limit.
    name
        Name of the shape, for messages.
    """

    matrix: scipy.sparse.csr_array
    solver: ConjugateGradient
    name: str

    @property
    def nbytes(self) -> int:
        """Bytes of the matrix."""
        return int(self.matrix.data.nbytes + self.matrix.indices.nbytes + self.matrix.indptr.nbytes)

    def solve(self, rhs: NDArray[np.float64]) -> NDArray[np.float64]:
        """Iterate for each column from zero.

        Raises
        ------
        ConvergenceError
            If one misses the tolerance; it carries the outcome for all columns.
        """
        columns = rhs.reshape(self.matrix.shape[0], -1)
        values, precondition = np.zeros(columns.shape), scipy.sparse.diags_array(1 / self.matrix.diagonal())
        for j in np.flatnonzero(columns.any(axis=0)):
            values[:, j], _ = scipy.sparse.linalg.cg(
                self.matrix,
                columns[:, j],
                rtol=self.solver.rtol / 2,
                maxiter=self.solver.max_iterations,
                M=precondition,
            )
        size = np.linalg.norm(columns, axis=0)
        residual = np.linalg.norm(columns - self.matrix @ values, axis=0) / np.where(size > 0, size, 1.0)
        if np.any(residual > self.solver.rtol):
            limit = self.solver.max_iterations
            msg = (
                f"{self.name}: residual {residual.max():.1e} of a source's field after at most {limit} "
                f"iterations; raise rtol={self.solver.rtol:g} or max_iterations, or solve with Direct"
            )
            raise ConvergenceError(msg, Solution(values, residual, False, limit))
        return values.reshape(rhs.shape)
