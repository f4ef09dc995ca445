"""Couplings of two weighted sets that keep distances within each: entropic fused Gromov-Wasserstein."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

# Entropy, in units of the cost: from so much that every pairing is open to so little that few are left.
_ENTROPY = (0.1, 0.0003)
_STEPS = 40
_SCALINGS = 20
# Share of the features in the cost, the rest being distances.
FEATURE_SHARE = 0.25


@dataclass(frozen=True, eq=False)
class Coupling:
    """How two weighted sets correspond.

    Parameters
    ----------
    plan
        ``(n, m)`` mass that each member of the first set shares with each of the second; sums to 1.
    cost
        Mean square difference of distances between corresponding pairs, and of features, as weighted.
    """

    plan: Array
    cost: float

    def to_first(self, values: Array) -> Array:
        """Carry ``(m, ...)`` values of the second set to the first: means over what corresponds."""
        return np.asarray(self.plan @ values / self.plan.sum(axis=1)[:, None])

    def to_second(self, values: Array) -> Array:
        """Carry ``(n, ...)`` values of the first set to the second: means over what corresponds."""
        return np.asarray(self.plan.T @ values / self.plan.sum(axis=0)[:, None])


def couple(
    distances: tuple[Array, Array],
    weights: tuple[Array, Array],
    difference: Array,
    *,
    start: Array | None = None,
) -> Coupling:
    """Find the coupling under which distances and features of two sets agree best.

    Minimises Σ T_ik T_jl (D_ij − D'_kl)² and Σ T_ik F_ik together over plans T with given margins, by
    linearisation at plans of falling entropy, each brought to its margins by Sinkhorn's scaling. The minimum
    is a local one: sets that are symmetric in themselves have several, and small differences decide.

    Parameters
    ----------
    distances
        ``(n, n)`` and ``(m, m)`` symmetric distances within each set, of one scale, about 1.
    weights
        ``(n,)`` and ``(m,)`` positive weights of the members; each sums to 1.
    difference
        ``(n, m)`` F, square differences of features between members.
    start
        ``(n, m)`` first plan; by default all members correspond alike.

    Examples
    --------
    >>> line = np.abs(np.subtract.outer(np.array([0.0, 1.0, 3.0]), np.array([0.0, 1.0, 3.0])))
    >>> half = np.full(3, 1 / 3)
    >>> (3 * couple((line, line[::-1, ::-1]), (half, half), np.zeros((3, 3))).plan).round(2)
    array([[0., 0., 1.],
           [0., 1., 0.],
           [1., 0., 0.]])
    """
    first, second = weights
    plan = np.outer(first, second) if start is None else start
    potential = np.zeros(second.size)
    for entropy in np.geomspace(*_ENTROPY, _STEPS):
        plan, potential = _project(_cost(distances, plan, difference), weights, potential, float(entropy))
    return Coupling(plan, float(np.vdot(_cost(distances, plan, difference), plan)))


def _cost(distances: tuple[Array, Array], plan: Array, difference: Array) -> Array:
    """Cost of each pair when all others correspond as planned."""
    a, b = distances
    square = (a**2 @ plan.sum(axis=1))[:, None] + b**2 @ plan.sum(axis=0)
    return np.asarray((1 - FEATURE_SHARE) * (square - 2 * a @ plan @ b) + FEATURE_SHARE * difference)


def _project(
    cost: Array, weights: tuple[Array, Array], potential: Array, entropy: float
) -> tuple[Array, Array]:
    """Plan of least cost less entropy with these margins, and the potential of its columns."""
    first, second = weights
    # One exact update of each potential, so that the exponentials below have no empty row or column.
    rows = entropy * np.log(first) - _soft_maximum(potential - cost, entropy)
    columns = entropy * np.log(second) - _soft_maximum(rows[None, :] - cost.T, entropy)
    kernel = np.exp((rows[:, None] + columns - cost) / entropy)
    right = np.ones_like(second)
    for _ in range(_SCALINGS):
        left = first / (kernel @ right)
        right = second / (left @ kernel)
    return left[:, None] * kernel * right, columns + entropy * np.log(right)


def _soft_maximum(values: Array, entropy: float) -> Array:
    """Entropy times the logarithm of the sum over each row of exp(values / entropy)."""
    top = values.max(axis=1, keepdims=True)
    return np.asarray(top[:, 0] + entropy * np.log(np.exp((values - top) / entropy).sum(axis=1)))
