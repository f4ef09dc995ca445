"""Sparse direct solution: right in every entry, however small, at the price of a factorisation."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.sparse.linalg
from numpy.typing import NDArray

from spem.fields.operator import System
from spem.fields.solvers.protocol import Solution, relative_residual


@dataclass(frozen=True)
class Direct:
    """Sparse LU without pivoting, which an M-matrix does not need.

    With a non-negative right-hand side neither elimination nor substitution ever subtracts, so each entry of
    the field is accurate in relative terms. Fill-in limits it to some 10^6 nodes in 2-D and 10^5 in 3-D.

    Parameters
    ----------
    rtol
        Tolerance on ‖b - (A + M/ρ²) v‖ / ‖b‖, which only rounding keeps from zero.

    Examples
    --------
    >>> import numpy as np
    >>> from spem.fields.operator import assemble
    >>> from spem.shapes.shape import Shape
    >>> system = assemble(Shape.from_mask(np.ones(3)), "voxel")
    >>> Direct().solve(system, np.array([1.0, np.inf])).values.round(3)
    array([[0.429, 1.   ],
           [0.286, 1.   ],
           [0.429, 1.   ]])
    """

    rtol: float = 1e-10

    def prepare(self, system: System, shift: float) -> Any:
        """Factor A + shift·M; the result's ``solve`` takes any number of right-hand sides as columns."""
        return scipy.sparse.linalg.splu(
            system.matrix(shift).tocsc(),
            permc_spec="MMD_AT_PLUS_A",
            diag_pivot_thresh=0.0,
            options={"SymmetricMode": True},
        )

    def solve(self, system: System, rho: NDArray[np.float64]) -> Solution:
        """Factor and solve for each ρ; the residual is ‖b - (A + M/ρ²) v‖ / ‖b‖."""
        columns = [self.prepare(system, 1.0 / r**2).solve(system.rhs) for r in rho]
        values = np.stack(columns, axis=1)
        residual = relative_residual(system, values, rho)
        converged = bool(np.all(residual <= self.rtol))
        return Solution(values, residual, converged, 0, "the system is too ill-conditioned to factor")
