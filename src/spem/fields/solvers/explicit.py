"""The paper's explicit iteration (5.1), kept as the reference: v ← v + τ (b - (A + M/ρ²) v)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from spem.fields.operator import System
from spem.fields.solvers.protocol import Solution, deficit_residual


@dataclass(frozen=True)
class ExplicitIteration:
    """Gradient descent with the largest time step that is stable on every node.

    Parameters
    ----------
    rtol
        Tolerance on `deficit_residual`, a bound of the root mean square error of each field.
    max_iterations
        Limit for each field; the count grows like the square of the shape's width in voxels.
    """

    rtol: float = 1e-8
    max_iterations: int = 200_000

    def solve(self, system: System, rho: NDArray[np.float64]) -> Solution:
        """Iterate for each ρ from v = 1, in terms of the deficit 1 - v."""
        deficits, spent = np.zeros((system.n_nodes, rho.size)), 0
        for j in np.flatnonzero(np.isfinite(rho)):
            deficits[:, j], steps = self._descend(system, rho[j] ** -2.0)
            spent += steps
        residual = deficit_residual(system, deficits, rho)
        converged = bool(np.all(residual <= self.rtol))
        return Solution(
            1.0 - deficits, residual, converged, spent, f"raise rtol={self.rtol:g} or max_iterations"
        )

    def _descend(self, system: System, shift: float) -> tuple[NDArray[np.float64], int]:
        matrix, source = system.matrix(shift).tocsr(), shift * system.mass
        # Gershgorin: no eigenvalue exceeds the largest absolute row sum.
        step = 1.9 / np.abs(matrix).sum(axis=1).max()
        target = self.rtol / 2 * float(np.linalg.norm(source))
        u = np.zeros(system.n_nodes)
        for iteration in range(self.max_iterations):
            residual = source - matrix @ u
            if np.linalg.norm(residual) <= target:
                return u, iteration
            u += step * residual
        return u, self.max_iterations
