"""The rounds of a sweep, for a batch of systems on any engine: measure what the bases miss, solve for it.

Eight shifts of each system are solved at once as the lanes of one array, in single precision; their span
predicts all other ρ; the true residual of the prediction at eight further shifts, taken in double precision,
measures its error and is what the next eight are solved for, until it is below the tolerance everywhere.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg.lapack import dsterf

from spem.fields.solvers.engine import LANES, Engine, Small
from spem.fields.solvers.poles import Targets
from spem.fields.solvers.reduced import ReducedBases

# A block is solved to this fraction of the tolerance, or of its own start: single precision ends there.
_MARGIN, _SINGLE_LIMIT = 0.1, 3e-7
# The estimate stands for the shifts between its own too, so it has to be this much below the tolerance.
_ACCEPTED = 0.6
# Rounding, not the operator, gives lower eigenvalues than this.
_LOWEST_TRUSTED = 1e-3
# Systems that are done are left out once no more than this share of a block goes on.
_NARROWED = 0.5

Flags = NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class Outcome:
    """What the rounds came to.

    Parameters
    ----------
    bases
        Reduced bases of the systems.
    error
        ``(n_systems,)`` estimate of the largest error of any field.
    iterations
        ``(n_systems,)`` iterations for all shifts together.
    converged
        ``(n_systems,)`` whether the error is within the tolerance.
    """

    bases: ReducedBases
    error: Small
    iterations: NDArray[np.int64]
    converged: Flags


class Rounds:
    """Sweep the systems of an engine.

    Parameters
    ----------
    engine
        The engine.
    targets
        The shifts of each system that count, in units of the engine.
    highest
        ``(n_systems,)`` upper bound of the eigenvalues of each operator, in units of the engine.
    rtol
        Largest error of any field at any node.
    max_blocks, max_iterations
        Limits on the blocks of each system, and on the iterations for each.
    """

    def __init__(
        self,
        engine: Engine,
        targets: Sequence[Targets],
        highest: Small,
        rtol: float,
        max_blocks: int,
        max_iterations: int,
    ) -> None:
        self.engine, self.targets, self.highest = engine, targets, highest
        self.rtol, self.max_blocks, self.max_iterations = rtol, max_blocks, max_iterations
        self.bases = ReducedBases(engine)
        count = len(targets)
        self.poles: list[Small] = [np.zeros(0)] * count
        self.error, self.iterations = np.zeros(count), np.zeros(count, np.int64)
        # Lowest eigenvalue seen of the preconditioned operator: a cycle finds this part of any error.
        self.found = np.ones(count)
        # The first block is solved to single precision only: its shifts are measured again in the end.
        often = rtol < _SINGLE_LIMIT
        self.unchecked = np.array([often and target.few is None for target in targets])
        self.checking = np.zeros(count, bool)

    def run(self) -> Outcome:
        """Go on until all systems are within the tolerance, or at the limit of blocks."""
        converged = np.array([target.shifts.size == 0 for target in self.targets])
        active = ~converged
        while active.any():
            shifts = self._shifts(active)
            product, peak = self.engine.measure(self.bases.solve(shifts), shifts, active)
            errors = peak / self.found[:, None]
            worst = errors.max(axis=1)
            self.error = np.where(active, np.maximum(worst, self.checking * self.error), self.error)
            blocks = np.array([poles.size // LANES for poles in self.poles])
            within = active & (blocks > 0) & (worst <= _ACCEPTED * self.rtol)
            done = within & ~self.unchecked
            converged |= done
            self.checking = within & ~done
            self.unchecked &= ~within
            unsolved = active & ~within & (blocks < self.max_blocks)
            active = unsolved | self.checking
            if unsolved.any():
                self._solve(unsolved, product, errors)
                self.bases.extend(unsolved)
                for b in np.flatnonzero(unsolved).tolist():
                    self.poles[b] = np.append(self.poles[b], shifts[b])
        return Outcome(self.bases, self.error, self.iterations, converged)

    def _shifts(self, active: Flags) -> Small:
        """Next eight shifts of each active system, or those of its first block; ones for the others."""
        shifts = np.ones((len(self.targets), LANES))
        lowest = self.bases.lowest() if self.bases.source.size else np.zeros(active.size)
        for b in np.flatnonzero(active).tolist():
            target, poles = self.targets[b], self.poles[b]
            if self.checking[b]:
                shifts[b] = poles[:LANES]
            else:
                shifts[b] = target.next(poles, lowest[b], self.highest[b]) if poles.size else target.first()
        return shifts

    def _solve(self, active: Flags, product: Small, errors: Small) -> None:
        """Solve (A + s M) x = r, lane by lane, for the residuals that were measured."""
        goal = np.maximum(_MARGIN * self.rtol, _SINGLE_LIMIT * errors) * np.sqrt(product)
        going, selected, rz, beta = active, active, product, None
        steps, turns = [], []
        self.engine.select(active)
        for _ in range(self.max_iterations):
            alpha = _ratio(rz, self.engine.search(beta)) * going[:, None]
            new = self.engine.improve(alpha)
            beta = _ratio(new, rz)
            steps.append(alpha)
            turns.append(beta)
            self.iterations += going
            rz = new
            going = going & ~np.all(np.sqrt(new) * errors <= goal, axis=1)
            if not going.any():
                break
            if going.sum() <= _NARROWED * selected.sum():
                self.engine.select(going)
                selected = going
        self.engine.select(active)
        for b in np.flatnonzero(active).tolist():
            lowest = _lowest_ritz(
                np.array([each[b] for each in steps]), np.array([each[b] for each in turns])
            )
            self.found[b] = min(self.found[b], lowest)


def _ratio(numerator: Small, denominator: Small) -> Small:
    """Quotient in single precision, zero for a lane that has nothing left to solve."""
    quotient = np.divide(numerator, denominator, out=np.zeros_like(numerator), where=denominator > 0)
    return quotient.astype(np.float32).astype(np.float64)


def _lowest_ritz(steps: Small, turns: Small) -> float:
    """Lowest eigenvalue of the preconditioned operator that conjugate gradients have seen in any lane.

    Step lengths and directions of conjugate gradients are the entries of the Lanczos matrix of each lane.
    """
    lowest = 1.0
    for alpha, beta in zip(steps.T, turns.T, strict=True):
        count = int(np.argmin(np.append(alpha > 0, False)))
        if count == 0:
            continue
        a, b = alpha[:count], beta[: count - 1]
        diagonal = 1 / a + np.append(0.0, b / a[:-1])
        values = dsterf(diagonal, np.sqrt(b) / a[:-1])[0] if count > 1 else diagonal  # ascending
        lowest = min(lowest, values[0])
    return max(float(lowest), _LOWEST_TRUSTED)
