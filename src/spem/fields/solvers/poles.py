"""Which shifts the sweep solves for: poles of a rational interpolant over a range of shifts."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from spem.fields.solvers.engine import LANES

# Poles of the first block, as fractions of the logarithmic range of the shifts: Chebyshev nodes stretched
# to the largest shift, where the fields vary fastest. Least worst error over hands, combs and balls.
_LOWEST_POLE = 0.06
# Points of the logarithmic grid that stands for a range of shifts.
_DENSE = 200

Small = NDArray[np.float64]


@dataclass(frozen=True)
class Targets:
    """The shifts to be right at.

    Parameters
    ----------
    shifts
        ``(n_shifts,)`` shifts s = 1/ρ² > 0.
    between
        Whether all shifts between the least and the largest of them count, or only they.
    """

    shifts: Small
    between: bool

    @property
    def few(self) -> Small | None:
        """The distinct shifts, if they alone count and make one block."""
        distinct = np.unique(self.shifts)
        if self.between or distinct.size > LANES:
            return None
        return np.pad(distinct, (0, LANES - distinct.size), mode="edge")

    def first(self) -> Small:
        """Eight shifts that span the range well."""
        if self.few is not None:
            return self.few
        low, high = self.shifts.min(), self.shifts.max()
        t = np.cos((2 * np.arange(LANES) + 1) / (2 * LANES) * np.pi)
        t = _LOWEST_POLE + (1 - _LOWEST_POLE) * (t / t[0] + 1) / 2
        return np.asarray(low * (high / low) ** t)

    def dense(self, lowest: float = 0.0, highest: float = np.inf) -> Small:
        """Shifts that stand for all that count, spread by `_spread` if they are a range."""
        if self.few is not None or not self.shifts.size:
            return np.unique(self.shifts)
        ends = np.array([self.shifts.min(), self.shifts.max()])
        low, high = _spread(ends, lowest, highest)
        grid = np.geomspace(low, high, _DENSE)
        return np.asarray(np.clip((grid - lowest) / (1 - grid / highest), *ends))

    def next(self, poles: Small, lowest: float, highest: float) -> Small:
        """Eight more shifts, where the rational interpolant's ∏|σ - σₚ|/(σ + σₚ) is largest in turn (Leja).

        `lowest` and `highest` bound the eigenvalues that count. After two blocks, the largest shift, where
        fields vary fastest, is among the eight: what is left of its own error shows nowhere else.
        """
        if self.few is not None:
            return self.few
        candidates = self.dense(lowest, highest)
        spread = _spread(candidates, lowest, highest)
        again = poles.size > LANES
        gap = _log_ratio(spread, _spread(poles, lowest, highest)).sum(axis=1)
        chosen = []
        for _ in range(LANES - again):
            chosen.append(int(np.argmax(gap)))
            gap = gap + _log_ratio(spread, spread[chosen[-1:]])[:, 0]
        return np.append(candidates[chosen], candidates[-1:] if again else [])


def _log_ratio(spread: Small, poles: Small) -> Small:
    """Logarithm of |σ - σₚ|/(σ + σₚ), a row for each σ and a column for each pole."""
    distance, total = np.abs(np.subtract.outer(spread, poles)), np.add.outer(spread, poles)
    return np.asarray(np.log(distance / total + np.finfo(float).tiny))


def _spread(shifts: Small, lowest: float, highest: float) -> Small:
    """σ = (s + λ₁)/(1 + s/λₙ): fields change little with shifts far below or above all eigenvalues."""
    return (shifts + lowest) / (1 + shifts / highest)
