"""Confidence intervals of chances that were counted."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.stats import beta

from spem.errors import ParameterError

LEVEL = 0.99


@dataclass(frozen=True, eq=False)
class Estimate:
    """How many of the walks from each node arrived, and what that says of the chance to arrive.

    The intervals are those of Clopper and Pearson: they hold the true chance with at least their level, also
    where it is close to 0 or 1 and no walk or every one arrived.

    Parameters
    ----------
    nodes
        ``(n,)`` where the walks started.
    n_walks
        Number of walks from each node.
    arrivals
        ``(n,)`` number of them that arrived; ``(n, n_sources)`` of those in each source.
    steps
        ``(n,)`` mean number of steps of a walk.
    level
        Chance that an interval holds the true value, or that all of `comparisons` intervals do.
    comparisons
        How many intervals are to hold at once: each then has the level 1 - (1 - level) / comparisons, by
        Bonferroni's inequality. 1 for each by itself.

    Raises
    ------
    ParameterError
        When the level is not between 0 and 1, or the comparisons are less than one.
    """

    nodes: NDArray[np.int64]
    n_walks: int
    arrivals: NDArray[np.int64]
    steps: NDArray[np.float64]
    level: float = LEVEL
    comparisons: int = 1

    def __post_init__(self) -> None:
        if not 0 < self.level < 1:
            msg = f"level={self.level!r}: expected a chance between 0 and 1, such as 0.99"
            raise ParameterError(msg)
        if not (self.comparisons >= 1 and self._tail > 0):
            msg = f"comparisons={self.comparisons!r}: expected at least 1, and finite"
            raise ParameterError(msg)

    @property
    def mean(self) -> NDArray[np.float64]:
        """Share of the walks that arrived, in the form of `arrivals`: the estimate of v."""
        return self.arrivals / self.n_walks

    @cached_property
    def lower(self) -> NDArray[np.float64]:
        """Lower ends of the intervals, in the form of `arrivals`; 0 where none arrived."""
        count = self.arrivals
        ends = beta.ppf(self._tail, np.maximum(count, 1), self.n_walks - count + 1)
        return np.where(count > 0, ends, 0.0)

    @cached_property
    def upper(self) -> NDArray[np.float64]:
        """Upper ends of the intervals, in the form of `arrivals`; 1 where all arrived."""
        missed = self.n_walks - self.arrivals
        ends = beta.isf(self._tail, self.arrivals + 1, np.maximum(missed, 1))
        return np.where(missed > 0, ends, 1.0)

    def covers(self, values: ArrayLike) -> NDArray[np.bool_]:
        """Tell which intervals hold given values, in the form of `arrivals`.

        A value a rounding above 1 counts as 1.

        Parameters
        ----------
        values
            One value for each interval.

        Raises
        ------
        ParameterError
            When the values are of another form.

        Examples
        --------
        >>> found = Estimate(np.array([0]), 100, np.array([0]), np.ones(1))
        >>> found.upper.round(3), found.covers([0.01]), found.covers([0.1])
        (array([0.052]), array([ True]), array([False]))
        """
        given = np.asarray(values, np.float64)
        if given.shape != self.arrivals.shape:
            msg = f"an estimate of {self.arrivals.shape} has as many values to hold, not {given.shape}"
            raise ParameterError(msg)
        near = np.clip(given, 0.0, 1.0)
        return np.asarray((self.lower <= near) & (near <= self.upper))

    def alone(self) -> Estimate:
        """Return the same counts with intervals that hold each by itself."""
        return replace(self, comparisons=1)

    @property
    def _tail(self) -> float:
        """Chance to miss on either side of one interval."""
        return (1 - self.level) / (2 * self.comparisons)

    def __repr__(self) -> str:
        what = f"{self.nodes.size} nodes, {self.n_walks} walks each, level {self.level:g}"
        return f"Estimate({what} of {self.comparisons} at once)"
