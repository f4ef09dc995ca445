"""Which shifts the sweep solves for: poles of a rational interpolant over a range of shifts."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from spem.fields.solvers.lanes import LANES

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

    def dense(self, floor: float = 0.0) -> Small:
        """Shifts that stand for all that count, geometric in s + `floor` if they are a range."""
        if self.few is not None or not self.shifts.size:
            return np.unique(self.shifts)
        low, high = self.shifts.min(), self.shifts.max()
        return np.clip(np.geomspace(low + floor, high + floor, _DENSE) - floor, low, high)

    def next(self, poles: Small, floor: float) -> Small:
        """Eight more shifts s, where the interpolant's ∏|s - p|/(s + p + 2λ) is largest in turn (Leja).

        λ, the `floor`, is the lowest eigenvalue of the operator: fields change little with shifts far below
        it. The largest shift, where fields vary fastest, is always among the eight: what single precision
        left of its error shows nowhere else.
        """
        if self.few is not None:
            return self.few
        candidates, chosen = self.dense(floor), list(poles)
        for _ in range(LANES - 1):
            distance = np.abs(np.subtract.outer(candidates, chosen))
            ratio = distance / (np.add.outer(candidates, chosen) + 2 * floor) + np.finfo(float).tiny
            chosen.append(candidates[int(np.argmax(np.log(ratio).sum(axis=1)))])
        return np.array([*chosen[1 - LANES :], candidates[-1]])
