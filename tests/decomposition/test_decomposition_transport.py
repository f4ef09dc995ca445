"""Couplings that keep distances."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.distance import cdist

from spem.decomposition.transport import couple


def _cloud(rng: np.random.Generator, n: int = 14) -> tuple[np.ndarray, np.ndarray]:
    """Return the distances among random points, of root mean square 1, and equal weights."""
    points = rng.normal(size=(n, 3)) * [3.0, 2.0, 1.0]
    distances = cdist(points, points)
    return distances / np.sqrt(np.mean(distances**2)), np.full(n, 1 / n)


def _profiles(first: np.ndarray, second: np.ndarray) -> np.ndarray:
    """Return the mean square differences between sorted distances."""
    return cdist(np.sort(first, axis=1), np.sort(second, axis=1), "sqeuclidean") / len(second)


@given(seed=st.integers(0, 10_000))
@settings(max_examples=5, deadline=None)
def test_a_set_is_coupled_with_its_own_permutation(seed: int) -> None:
    """Renumbered members find themselves, at no cost."""
    rng = np.random.default_rng(seed)
    distances, weights = _cloud(rng)
    order = rng.permutation(weights.size)
    other = distances[np.ix_(order, order)]
    found = couple((distances, other), (weights, weights), _profiles(distances, other))
    assert np.array_equal(np.argmax(found.plan, axis=0), order)
    assert found.cost < 1e-2


def test_margins_are_the_weights() -> None:
    """The plan gives each member the weight it has, whatever the sizes of the sets."""
    rng = np.random.default_rng(3)
    (first, _), (second, _) = _cloud(rng, 9), _cloud(rng, 17)
    weights = rng.dirichlet(np.full(9, 5.0)), rng.dirichlet(np.full(17, 5.0))
    plan = couple((first, second), weights, _profiles(np.sort(first)[:, :9], np.sort(second)[:, :9])).plan
    assert plan.sum(axis=0) == pytest.approx(weights[1], rel=1e-9)
    assert plan.sum(axis=1) == pytest.approx(weights[0], abs=0.05)
    assert plan.min() >= 0


def test_values_are_carried_as_means() -> None:
    """A constant stays a constant both ways, and values stay within their range."""
    rng = np.random.default_rng(4)
    (first, a), (second, b) = _cloud(rng, 9), _cloud(rng, 12)
    coupling = couple((first, second), (a, b), np.zeros((9, 12)))
    assert coupling.to_first(np.ones((12, 2))) == pytest.approx(np.ones((9, 2)))
    carried = coupling.to_second(np.arange(9.0)[:, None])
    assert carried.min() >= 0
    assert carried.max() <= 8
