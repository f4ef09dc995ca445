"""The paper's explicit iteration (5.1), kept as the reference: v ← v + τ (b - (A + M/ρ²) v)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from spem.fields.operator import System
from spem.fields.solvers.protocol import Solution, relative_residual


@dataclass(frozen=True)
class ExplicitIteration:
    """Gradient descent with the largest time step that is stable on every node.

    Parameters
    ----------
    rtol
        Tolerance on ‖b - (A + M/ρ²) v‖ / ‖b‖.
    max_iterations
        Limit for each field; the count grows like the square of the shape's width in voxels.
    """

    rtol: float = 1e-8
    max_iterations: int = 200_000

    def solve(self, system: System, rho: NDArray[np.float64]) -> Solution:
        """Iterate for each ρ from v = 0."""
        fields, spent = [], 0
        for r in rho:
            v, steps = self._descend(system, 1.0 / r**2)
            fields.append(v)
            spent += steps
        values = np.stack(fields, axis=1)
        residual = relative_residual(system, values, rho)
        converged = bool(np.all(residual <= self.rtol))
        return Solution(values, residual, converged, spent, f"raise rtol={self.rtol:g} or max_iterations")

    def _descend(self, system: System, shift: float) -> tuple[NDArray[np.float64], int]:
        matrix = system.matrix(shift).tocsr()
        # Gershgorin: no eigenvalue exceeds the largest absolute row sum.
        step = 2.0 / (np.abs(matrix).sum(axis=1).max() + shift * system.mass.max())
        target = self.rtol * float(np.linalg.norm(system.rhs))
        v = np.zeros(system.n_nodes)
        for iteration in range(self.max_iterations):
            residual = system.rhs - matrix @ v
            if np.linalg.norm(residual) <= target:
                return v, iteration
            v += step * residual
        return v, self.max_iterations
