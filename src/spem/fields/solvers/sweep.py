"""All ρ for about the price of one: block multigrid CG at a few poles, and a Galerkin basis.

With the boundary eliminated every ρ has the same right-hand side, and the matrices differ by a multiple of
one diagonal. The deficits u = 1 - v of all ρ lie, to any useful accuracy, in a space of some ten dimensions.
`spem.fields.solvers.rounds` finds a basis of it, on the processor or on a device, for one shape or for many.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from spem.errors import ParameterError, SizeError
from spem.fields.hyperfield import Hyperfield
from spem.fields.operator import System
from spem.fields.solvers.batch import Batch
from spem.fields.solvers.engine import Backend, Small, require_backend, require_rho
from spem.fields.solvers.host import Host
from spem.fields.solvers.poles import Targets
from spem.fields.solvers.protocol import Solution
from spem.fields.solvers.rounds import Rounds

# Columns kept in single precision add 3.6e-7 to errors that are accepted up to 0.6 of the tolerance.
_SINGLE_STORAGE = 9e-7
# Basis directions that contribute less than this fraction of the tolerance are dropped at the end.
_DROPPED = 1e-2

# Of the lowest eigenvalue: the deficit at such a shift is far below the tolerance everywhere.
_NEGLIGIBLE = 1e-3


@dataclass(frozen=True)
class Sweep:
    """The fast sweep over ρ.

    Parameters
    ----------
    rtol
        Largest error of any field at any node, relative to the field's maximum (1, on the boundary).
    max_blocks
        Limit on the blocks of eight poles.
    max_iterations
        Limit on the iterations for each block.
    threads
        Threads for large shapes; as many as the process may use when None. Results do not depend on it.
    device
        Where to run, such as ``spem.Cuda()``; the processor when None.

    Examples
    --------
    >>> import numpy as np
    >>> from spem.fields.operator import assemble
    >>> from spem.shapes.shape import Shape
    >>> system = assemble(Shape.from_mask(np.ones(3)), "voxel")
    >>> Sweep(rtol=1e-12).solve(system, np.array([1.0, np.inf])).values.round(3)
    array([[0.429, 1.   ],
           [0.286, 1.   ],
           [0.429, 1.   ]])
    """

    rtol: float = 1e-6
    max_blocks: int = 12
    max_iterations: int = 100
    threads: int | None = None
    device: Backend | None = None

    def __post_init__(self) -> None:
        require_backend(self.device)
        if self.threads is not None and self.threads < 1:
            msg = f"threads={self.threads}: expected at least one thread"
            raise ParameterError(msg)
        if not 0 < self.rtol < 1:
            msg = f"rtol={self.rtol:g}: expected a tolerance between 0 and 1"
            raise ParameterError(msg)

    def solve(self, system: System, rho: NDArray[np.float64]) -> Solution:
        """Solve for each ρ; the residual is an estimate, from the true residual, of the largest error."""
        with self.batch([system], [rho], between=False) as batch:
            [field] = batch.hyperfields()
            converged, spent = bool(batch.outcome.converged[0]), int(batch.outcome.iterations[0])
            residual = np.full(rho.size, batch.outcome.error[0])
        return Solution(field.fields(), residual, converged, spent, self._advice)

    def hyperfield(self, system: System, rho: NDArray[np.float64]) -> Hyperfield:
        """Low-rank hyperfield over the range of `rho`; raises `ConvergenceError` if it misses `rtol`."""
        return self.hyperfields([system], [rho])[0]

    def hyperfields(self, systems: Sequence[System], rho: Sequence[NDArray[np.float64]]) -> list[Hyperfield]:
        """Low-rank hyperfields of several systems, each the same as alone.

        On a device they are swept together; if its memory does not hold them all, half of them at a time.

        Parameters
        ----------
        systems
            Systems of one dimension.
        rho
            For each the ρ to sample.

        Raises
        ------
        ConvergenceError
            If one misses `rtol`.
        SizeError
            When a single system does not fit into the memory of the device.
        """
        if self.device is None and len(systems) > 1:
            return [self.hyperfield(system, each) for system, each in zip(systems, rho, strict=True)]
        try:
            with self.batch(systems, rho) as batch:
                for index in range(len(batch)):
                    batch.require(index)
                return batch.hyperfields()
        except SizeError:
            half = len(systems) // 2
            if half == 0:
                raise
        return self.hyperfields(systems[:half], rho[:half]) + self.hyperfields(systems[half:], rho[half:])

    def batch(
        self, systems: Sequence[System], rho: Sequence[NDArray[np.float64]], *, between: bool = True
    ) -> Batch:
        """Sweep several systems of one dimension together, and leave what was found in the engine.

        Parameters
        ----------
        systems
            The systems.
        rho
            For each the ρ to sample.
        between
            Whether all ρ between the least and the largest sample of each count, or the samples alone.

        Raises
        ------
        ParameterError
            When a ρ is below a millionth of the spacing.
        SizeError
            When they do not fit into the memory of the device together.
        """
        for system, each in zip(systems, rho, strict=True):
            require_rho(system, each)
        backend = self.device if self.device is not None else Host(self.threads)
        engine = backend.open(systems, np.float32 if self.rtol > _SINGLE_STORAGE else np.float64)
        try:
            targets = [self._targets(*each, between) for each in zip(systems, rho, engine.units, strict=True)]
            highest = np.array([_highest(system) for system in systems]) * np.square(engine.units)
            outcome = Rounds(engine, targets, highest, self.rtol, self.max_blocks, self.max_iterations).run()
            reduced = [
                outcome.bases.compress(index, target.dense(), _DROPPED * self.rtol)
                for index, target in enumerate(targets)
            ]
        except BaseException:
            engine.close()
            raise
        return Batch(engine, systems, rho, reduced, outcome, self._advice)

    @property
    def _advice(self) -> str:
        return f"raise rtol={self.rtol:g}, or solve directly"

    def _targets(self, system: System, rho: Small, unit: float, between: bool) -> Targets:
        """Shifts that count, in squared units.

        Below the lowest kept shift fields are one to within the tolerance; their deficits are proportional
        to it.
        """
        shifts = np.square(unit / rho[np.isfinite(rho)])
        return Targets(np.maximum(shifts, _NEGLIGIBLE * self.rtol * _box_eigenvalue(system)), between)


def _highest(system: System) -> float:
    """Upper bound of the eigenvalues of M⁻¹A, by Gershgorin's circles; edges that are cut short raise it."""
    return float(2 * np.max(system.diagonal / system.mass))


def _box_eigenvalue(system: System) -> float:
    """Lowest eigenvalue of A on the whole grid, a lower bound of that on the shape, in squared units."""
    counts = np.array(system.shape.mask.shape)
    weights = system.weights * min(system.shape.spacing) ** 2
    return float(np.sum(4 * weights * np.sin(np.pi / (2 * counts)) ** 2))
