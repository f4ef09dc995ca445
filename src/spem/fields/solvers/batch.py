"""A batch of shapes swept together: their reduced bases, with the columns where the engine has them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from spem.fields.hyperfield import Hyperfield
from spem.fields.operator import System
from spem.fields.solvers.engine import SourceEngine
from spem.fields.solvers.protocol import Solution
from spem.fields.solvers.reduced import Reduced
from spem.fields.solvers.rounds import Outcome

# What storing the columns adds to the error of a field, in units of their rounding.
_STORAGE_ROUNDINGS = 3.0


class Batch:
    """Hyperfields of several systems, their columns still in the engine; made by `Sweep.batch`.

    Close it, or use it in a ``with`` block: on a device it holds memory.

    Parameters
    ----------
    engine
        The engine.
    systems
        Its systems.
    rho
        For each ``(n_rho,)`` the sampled ρ.
    reduced
        For each what is left of its basis.
    outcome
        Errors, iterations, and which converged.
    advice
        What to do about a sweep that did not converge.
    """

    def __init__(
        self,
        engine: SourceEngine,
        systems: Sequence[System],
        rho: Sequence[NDArray[np.float64]],
        reduced: Sequence[Reduced],
        outcome: Outcome,
        advice: str = "",
    ) -> None:
        self.engine, self.systems, self.rho, self.reduced = engine, systems, rho, reduced
        self.outcome, self.advice = outcome, advice

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.engine.close()

    def __len__(self) -> int:
        return len(self.systems)

    def require(self, index: int) -> None:
        """Raise `ConvergenceError` if the sweep of a system missed its tolerance."""
        if self.outcome.converged[index]:
            return
        turns = [each.turn if b == index else each.turn[:, :0] for b, each in enumerate(self.reduced)]
        field = self._hyperfield(index, self.engine.columns(turns)[index])
        best = Solution(
            field.at(self.rho[index][:1]),
            self.outcome.error[index : index + 1],
            False,
            int(self.outcome.iterations[index]),
            self.advice,
        )
        best.checked(self.systems[index].shape.name)

    def hyperfields(self) -> list[Hyperfield]:
        """Return the hyperfields, whether they converged or not, in one transfer."""
        columns = self.engine.columns([reduced.turn for reduced in self.reduced])
        return [self._hyperfield(b, values) for b, values in enumerate(columns)]

    def coefficients(self, index: int, rho: NDArray[np.float64] | None = None) -> NDArray[np.float64]:
        """Coefficients ``(rank + 1, n_rho)`` of one system's fields, as `Hyperfield.coefficients`."""
        return self._hyperfield(index, np.empty((0, self.reduced[index].gram.shape[0] - 1))).coefficients(rho)

    def _hyperfield(self, index: int, columns: NDArray[np.floating[Any]]) -> Hyperfield:
        """Put columns and small matrices together, the operator in the unit of the spacing."""
        system, reduced = self.systems[index], self.reduced[index]
        rounding = _STORAGE_ROUNDINGS * float(np.finfo(self.engine.dtype).eps)
        return Hyperfield(
            system.shape,
            self.rho[index],
            columns,
            reduced.gram,
            reduced.mass,
            reduced.stiffness / float(self.engine.units[index]) ** 2,
            reduced.source,
            system.boundary,
            float(self.outcome.error[index]) + rounding,
        )
