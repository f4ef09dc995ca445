"""Sparse direct solution: right in every entry, however small, at the price of a factorisation."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from spem.fields.operator import System
from spem.fields.solvers.multifrontal import Factor, factorize
from spem.fields.solvers.protocol import Solution, relative_residual


@dataclass(frozen=True)
class Direct:
    """Cholesky factorisation without pivoting, which an M-matrix does not need.

    With a non-negative right-hand side neither elimination nor substitution ever subtracts, so each entry of
    the field is accurate in relative terms. Fill-in limits it: 60,000 nodes of a horse take 0.1 GB and about
    a second, 250,000 take 0.7 GB and five, and both grow faster on bulkier shapes.

    Parameters
    ----------
    rtol
        Tolerance on ‖b - (A + M/ρ²) v‖ / ‖b‖, which only rounding keeps from zero.
    memory_limit
        Most bytes that a factorisation may take; SPEM_MEMORY_LIMIT or 2 GiB by default.

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

    entrywise: ClassVar[bool] = True

    rtol: float = 1e-10
    memory_limit: int | None = None

    def prepare(self, system: System, shift: float) -> Factor:
        """Factor A + shift·M; the result's ``solve`` takes any number of right-hand sides as columns.

        Raises
        ------
        SizeError
            When the factorisation would take more memory than the limit.
        """
        return factorize(system, shift, memory_limit=self.memory_limit)

    def solve(self, system: System, rho: NDArray[np.float64]) -> Solution:
        """Factor and solve for each ρ; the residual is ‖b - (A + M/ρ²) v‖ / ‖b‖."""
        columns = [self.prepare(system, 1.0 / r**2).solve(system.rhs) for r in rho]
        values = np.stack(columns, axis=1)
        residual = relative_residual(system, values, rho)
        converged = bool(np.all(residual <= self.rtol))
        return Solution(values, residual, converged, 0, "the system is too ill-conditioned to factor")
