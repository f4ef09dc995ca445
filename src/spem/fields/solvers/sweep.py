"""All ρ for about the price of one: block multigrid CG at a few poles, and a Galerkin basis.

With the boundary eliminated every ρ has the same right-hand side, and the matrices differ by a multiple of
one diagonal. The deficits u = 1 - v of all ρ lie, to any useful accuracy, in a space of some ten dimensions.
So eight shifts are solved at once as the lanes of one array, in single precision; their span predicts all
other ρ; the true residual of the prediction at eight further shifts, taken in double precision, measures its
error and is what the next eight are solved for, until the error is below the tolerance everywhere.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.linalg
from numpy.typing import NDArray

from spem.errors import ParameterError
from spem.fields.hyperfield import Hyperfield
from spem.fields.operator import System
from spem.fields.solvers import kernels
from spem.fields.solvers.lanes import LANES
from spem.fields.solvers.multigrid import Cycle, Hierarchy, rows
from spem.fields.solvers.poles import Targets
from spem.fields.solvers.protocol import Solution
from spem.fields.solvers.reduced import ReducedBasis
from spem.fields.solvers.team import Team

# A block is solved to this fraction of the tolerance, or of its own start: single precision ends there.
_MARGIN, _SINGLE_LIMIT = 0.1, 3e-7
# The estimate stands for the shifts between its own too, so it has to be this much below the tolerance.
_ACCEPTED = 0.6
# Basis columns kept in single precision err by about 1e-7 of the field.
_SINGLE_STORAGE = 3e-7
# What storing the columns adds to the error of a field, in units of their rounding.
_STORAGE_ROUNDINGS = 3.0
# Basis directions that contribute less than this fraction of the tolerance are dropped at the end.
_DROPPED = 1e-2

# In units of the spacing; single precision holds the square of its inverse.
_LEAST_RHO = 1e-6
# Of the lowest eigenvalue: the deficit at such a shift is far below the tolerance everywhere.
_NEGLIGIBLE = 1e-3
# Rounding, not the operator, gives lower eigenvalues than this.
_LOWEST_TRUSTED = 1e-3
Small = NDArray[np.float64]


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

    def __post_init__(self) -> None:
        if self.threads is not None and self.threads < 1:
            msg = f"threads={self.threads}: expected at least one thread"
            raise ParameterError(msg)
        if not 0 < self.rtol < 1:
            msg = f"rtol={self.rtol:g}: expected a tolerance between 0 and 1"
            raise ParameterError(msg)

    def solve(self, system: System, rho: NDArray[np.float64]) -> Solution:
        """Solve for each ρ; the residual is an estimate, from the true residual, of the largest error."""
        field, residual, spent, converged = self._run(system, rho, between=False)
        return Solution(field.fields(), np.full(rho.size, residual), converged, spent, self._advice)

    def hyperfield(self, system: System, rho: NDArray[np.float64]) -> Hyperfield:
        """Low-rank hyperfield over the range of `rho`; raises `ConvergenceError` if it misses `rtol`."""
        field, residual, spent, converged = self._run(system, rho, between=True)
        if not converged:
            best = Solution(field.at(rho[:1]), np.array([residual]), False, spent, self._advice)
            best.checked(system.shape.name)
        return field

    @property
    def _advice(self) -> str:
        return f"raise rtol={self.rtol:g}, or solve directly"

    def _run(
        self, system: System, rho: NDArray[np.float64], *, between: bool
    ) -> tuple[Hyperfield, float, int, bool]:
        """Sweep for the given ρ, or for all `between` the smallest and the largest of them."""
        unit = min(system.shape.spacing)
        if rho.min() < _LEAST_RHO * unit:
            msg = (
                f"{system.shape.name}: rho={rho.min():g} is below {_LEAST_RHO:g} of the spacing {unit:g}, "
                "where fields vanish on every node; use a larger rho or a finer spacing"
            )
            raise ParameterError(msg)
        with Team(self.threads) as team:
            return self._sweep(system, rho, team, between=between)

    def _sweep(
        self, system: System, rho: NDArray[np.float64], team: Team, *, between: bool
    ) -> tuple[Hyperfield, float, int, bool]:
        hierarchy = Hierarchy.of(system)
        dtype = np.float32 if self.rtol > _SINGLE_STORAGE else np.float64
        basis = ReducedBasis(system, hierarchy.unit, dtype, hierarchy.levels[0].slabs, team)
        shifts = np.square(hierarchy.unit / rho[np.isfinite(rho)])
        # Below this shift fields are one to within the tolerance; their deficits are proportional to it.
        targets = Targets(np.maximum(shifts, _NEGLIGIBLE * self.rtol * _box_eigenvalue(system)), between)
        block = _Block(hierarchy, basis, self)
        highest = float(4 * system.weights.sum() * hierarchy.unit**2)  # of an uncut grid
        poles: list[float] = []
        worst, converged = 0.0, targets.shifts.size == 0
        while not converged and len(poles) < self.max_blocks * LANES:
            shifts = targets.next(np.array(poles), basis.lowest(), highest) if poles else targets.first()
            worst = block.measure(shifts)
            converged = bool(poles) and worst <= _ACCEPTED * self.rtol
            if not converged:
                basis.extend(block.solve())
                poles.extend(shifts)
        if not converged and poles:
            worst = block.measure(targets.next(np.array(poles), basis.lowest(), highest))
            converged = worst <= _ACCEPTED * self.rtol
        iterations = block.iterations
        del block
        return (
            _hyperfield(system, rho, basis, targets.dense(), self.rtol, worst),
            worst,
            iterations,
            converged,
        )


class _Block:
    """Work space for `LANES` shifts: measures what the basis misses at them, then solves for it."""

    def __init__(self, hierarchy: Hierarchy, basis: ReducedBasis, options: Sweep) -> None:
        n = basis.n_nodes
        self.hierarchy, self.basis, self.options = hierarchy, basis, options
        self.team, self.slabs = basis.team, basis.slabs
        self.partial = np.zeros((self.slabs.size - 1, LANES))
        self.x, self.r, self.z = rows(n), rows(n), rows(n)
        # The prediction and the search directions are never needed at the same time.
        self.u = np.zeros((n + 1, LANES))
        self.p, self.q = (
            half.reshape(n + 1, LANES) for half in self.u.reshape(-1).view(np.float32).reshape(2, -1)
        )
        self.iterations = 0
        # Lowest eigenvalue seen of the preconditioned operator: a cycle finds this part of any error.
        self.found = 1.0

    def measure(self, shifts: Small) -> float:
        """Estimate the largest error of the basis at these shifts, from its preconditioned true residual."""
        self.u[-1] = 0
        self.basis.combine(self.basis.solve(shifts), self.u)
        self.basis.residual(self.u, self.r, shifts)
        self.cycle = Cycle(self.hierarchy, shifts, self.z, self.team)
        self.product = self.cycle.apply(self.r)
        self.team.all(kernels.peak, self.slabs, self.z, self.partial)
        self.error = self.partial.max(axis=0) / self.found
        return float(self.error.max())

    def solve(self) -> NDArray[np.float32]:
        """Solve (A + s M) x = r, lane by lane, for the residual that was measured."""
        x, r, z, p, q = self.x, self.r, self.z, self.p, self.q
        graph, shift = self.hierarchy.levels[0].graph, self.cycle.shift
        x[:] = 0
        p[:] = z
        start = rz = self.product
        goal = np.maximum(_MARGIN * self.options.rtol, _SINGLE_LIMIT * self.error)
        steps, turns = [], []
        for _ in range(self.options.max_iterations):
            self.team.all(kernels.multiply, self.slabs, p, q, self.partial, graph, shift)
            alpha = _ratio(rz, self.partial.sum(axis=0, keepdims=True))
            self.team.all(kernels.advance, self.slabs, x, r, p, q, alpha)
            new = self.cycle.apply(r)
            self.iterations += 1
            steps.append(alpha[0])
            turns.append(_ratio(new, rz)[0])
            if np.all(np.sqrt(new[0]) * self.error <= goal * np.sqrt(start[0])):
                break
            self.team.all(kernels.turn, self.slabs, z, p, turns[-1][None])
            rz = new
        self.found = min(self.found, _lowest_ritz(np.array(steps), np.array(turns)))
        return x


def _hyperfield(
    system: System, rho: NDArray[np.float64], basis: ReducedBasis, shifts: Small, rtol: float, error: float
) -> Hyperfield:
    """Compress the basis for the range of shifts and put the operator back in the unit of the spacing."""
    reduced = basis.compress(shifts, _DROPPED * rtol)
    error += _STORAGE_ROUNDINGS * float(np.finfo(reduced.columns.dtype).eps)
    return Hyperfield(
        system.shape,
        rho,
        reduced.columns,
        reduced.gram,
        reduced.mass,
        reduced.stiffness / min(system.shape.spacing) ** 2,
        reduced.source,
        system.boundary,
        error,
    )


def _ratio(numerator: Small, denominator: Small) -> NDArray[np.float32]:
    """Quotient by lane, zero for a lane that has nothing left to solve."""
    quotient = np.divide(numerator, denominator, out=np.zeros_like(numerator), where=denominator > 0)
    return quotient.astype(np.float32)


def _box_eigenvalue(system: System) -> float:
    """Lowest eigenvalue of A on the whole grid, a lower bound of that on the shape, in squared units."""
    counts = np.array(system.shape.mask.shape)
    weights = system.weights * min(system.shape.spacing) ** 2
    return float(np.sum(4 * weights * np.sin(np.pi / (2 * counts)) ** 2))


def _lowest_ritz(steps: NDArray[np.float32], turns: NDArray[np.float32]) -> float:
    """Lowest eigenvalue of the preconditioned operator that conjugate gradients have seen in any lane.

    Step lengths and directions of conjugate gradients are the entries of the Lanczos matrix of each lane.
    """
    lowest = 1.0
    for alpha, beta in zip(steps.T.astype(float), turns.T.astype(float), strict=True):
        count = int(np.argmin(np.append(alpha > 0, False)))
        if count == 0:
            continue
        a, b = alpha[:count], beta[: count - 1]
        diagonal = 1 / a + np.append(0.0, b / a[:-1])
        lowest = min(lowest, scipy.linalg.eigvalsh_tridiagonal(diagonal, np.sqrt(b) / a[:-1])[0])
    return max(float(lowest), _LOWEST_TRUSTED)
