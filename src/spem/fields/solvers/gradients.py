"""Conjugate gradients for many sources, eight at a time, with multigrid as preconditioner."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from spem.errors import ConvergenceError, ParameterError, SizeError
from spem.fields.operator import System
from spem.fields.solvers.engine import LANES, Backend, require_backend, require_rho
from spem.fields.solvers.host import Host
from spem.fields.solvers.protocol import Solution
from spem.fields.solvers.refinement import Refined, refine

# On a device groups are solved together up to so many nodes: about where passes over vectors outlast the
# launches of their kernels. Estimated from bandwidth and launch times, not measured.
_BATCH_NODES = 1_000_000


@dataclass(frozen=True)
class MultigridGradients:
    """Conjugate gradients with the V-cycle of the sweep as preconditioner, eight right-hand sides at a time.

    Iterations run in single precision; their sum is refined in double until the true residual is below the
    tolerance. It takes a few vectors of memory, and time in proportion to the nodes, so it is for sources of
    shapes that are too large to factor, for few sources, and for devices. Fields of single sources are right
    relative to their maximum only: logarithms, which parts are made of, are refused; take `Direct`.

    Parameters
    ----------
    rtol
        Tolerance on ‖b - (A + M/ρ²) v‖ of each single source, relative to that of v = b/diagonal, which is
        at most ‖b‖ and is not dominated by edges that are cut short; on `deficit_residual` of each field of
        the whole boundary.
    max_iterations
        Limit for each right-hand side. Ten to twenty are usual; voxels that are a hundred times as long as
        wide take hundreds.
    threads
        Threads for large shapes on the host; as many as the process may use when None. Results do not depend
        on it.
    device
        Where to run; the host when None. A device takes several groups of eight at once, as many as fit.

    Examples
    --------
    >>> import numpy as np
    >>> from spem.fields.operator import assemble
    >>> from spem.shapes.shape import Shape
    >>> system = assemble(Shape.from_mask(np.ones(3)), "voxel")
    >>> MultigridGradients().solve(system, np.array([1.0, np.inf])).values.round(3)
    array([[0.429, 1.   ],
           [0.286, 1.   ],
           [0.429, 1.   ]])
    """

    entrywise: ClassVar[bool] = False

    rtol: float = 1e-8
    max_iterations: int = 1000
    threads: int | None = None
    device: Backend | None = None

    def __post_init__(self) -> None:
        require_backend(self.device)
        if not 0 < self.rtol < 1:
            msg = f"rtol={self.rtol:g}: expected a tolerance between 0 and 1"
            raise ParameterError(msg)
        if self.max_iterations < 1:
            msg = f"max_iterations={self.max_iterations}: expected at least one"
            raise ParameterError(msg)
        if self.threads is not None and self.threads < 1:
            msg = f"threads={self.threads}: expected at least one thread"
            raise ParameterError(msg)

    def solve(self, system: System, rho: NDArray[np.float64]) -> Solution:
        """Iterate for the deficits 1 - v, eight ρ at a time, from v = 1, the solution for ρ = inf.

        Raises
        ------
        ParameterError
            If a ρ is below a millionth of the spacing.
        SizeError
            If the system does not fit into the memory of the device.
        """
        finite = np.isfinite(rho)
        require_rho(system, rho)
        shifts = rho[finite] ** -2.0
        outcome = _solve(self, system, system.mass[:, None] * shifts, shifts)
        values, residual = np.ones((system.n_nodes, rho.size)), np.zeros(rho.size)
        values[:, finite] -= outcome.values
        residual[finite] = outcome.residual
        converged, spent = bool(np.all(residual <= self.rtol)), int(outcome.spent.sum())
        return Solution(
            values, residual, converged, spent, f"raise rtol={self.rtol:g} or max_iterations, or use Direct"
        )

    def prepare(self, system: System, shift: float) -> PreparedMultigrid:
        """Take A + shift·M; the result's ``solve`` takes any number of right-hand sides as columns.

        Raises
        ------
        ParameterError
            If 1/√shift is below a millionth of the spacing.
        """
        require_rho(system, np.array([shift]) ** -0.5 if shift > 0 else np.array([np.inf]))
        return PreparedMultigrid(system, shift, self)


@dataclass(frozen=True, eq=False)
class PreparedMultigrid:
    """One matrix for conjugate gradients with multigrid; safe to use from several threads.

    Parameters
    ----------
    system
        The system.
    shift
        1/ρ², 0 for ρ = inf.
    solver
        Tolerance, limits and device.
    """

    system: System
    shift: float
    solver: MultigridGradients

    @property
    def nbytes(self) -> int:
        """Bytes held between solves: none, because the hierarchy costs about one iteration to make."""
        return 0

    def solve(self, rhs: NDArray[np.float64]) -> NDArray[np.float64]:
        """Iterate for each column from b/diagonal, which takes edges that are cut short out of the residual.

        Raises
        ------
        ConvergenceError
            If one misses the tolerance; it carries the outcome for all columns.
        SizeError
            If eight columns do not fit into the memory of the device.
        """
        columns = rhs.reshape(self.system.n_nodes, -1)
        nodes = np.flatnonzero(columns.any(axis=1))
        guess = columns[nodes] / (self.system.diagonal + self.shift * self.system.mass)[nodes, None]
        rest = _spread(self.system, nodes, guess)
        values, residual, spent = _solve(
            self.solver, self.system, rest, np.full(columns.shape[1], self.shift)
        )
        values[nodes] += guess
        if not np.all(residual <= self.solver.rtol):
            worst, limit = residual.max(initial=0.0), spent.max(initial=0)
            msg = (
                f"{self.system.shape.name}: residual {worst:.1e} of a source's field after {limit} "
                f"iterations; raise rtol={self.solver.rtol:g} or max_iterations, or solve with Direct"
            )
            raise ConvergenceError(msg, Solution(values, residual, False, int(spent.sum())))
        return values.reshape(rhs.shape)


def _spread(system: System, nodes: NDArray[np.int64], guess: NDArray[np.float64]) -> NDArray[np.float64]:
    """Residual of b/diagonal, ``(n_nodes, k)``: what its values at `nodes` send to their neighbours."""
    rest = np.zeros((system.n_nodes, guess.shape[1]))
    for direction, weight in enumerate(np.repeat(system.weights, 2)):
        ends = system.domain.neighbours[nodes, direction]
        inner = ends < system.n_nodes
        rest[ends[inner]] += weight * guess[inner]
    return rest


def _solve(
    solver: MultigridGradients, system: System, rhs: NDArray[np.float64], shifts: NDArray[np.float64]
) -> Refined:
    """Solve (A + shift M) v = rhs, a shift a column, in batches of groups of `LANES`."""
    backend: Backend = Host(solver.threads) if solver.device is None else solver.device
    count = rhs.shape[1]
    # Column by column, as they are found and as fields of sources are kept.
    found = Refined(np.zeros(rhs.shape, order="F"), np.zeros(count), np.zeros(count, np.int64))
    most = 1 if solver.device is None else max(_BATCH_NODES // system.n_nodes, 1)
    copies, start, engine = min(most, -(-count // LANES)), 0, None
    try:
        while start < count:
            part = slice(start, min(start + copies * LANES, count))
            try:
                engine = engine or backend.open([system] * copies, np.float32)
                outcome = refine(
                    engine, rhs[:, part], shifts[part], rtol=solver.rtol, limit=solver.max_iterations
                )
            except SizeError:
                if copies == 1:
                    raise
                copies //= 2
                if engine is not None:
                    engine.close()
                engine = None
                continue
            for whole, piece in zip(found, outcome, strict=True):
                whole[..., part] = piece
            start = part.stop
    finally:
        if engine is not None:
            engine.close()
    return found
