"""Tapered capsules and their level function."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from spem.shapes.capsules import Capsules


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 2**32 - 1), st.integers(2, 3), st.integers(1, 5))
def test_level_is_that_of_all_balls_between_the_ends(seed, d, n):
    """The depth of a point is its largest depth in any of the balls that a capsule is made of."""
    rng = np.random.default_rng(seed)
    body = Capsules(rng.normal(size=(n, d)), rng.normal(size=(n, d)), rng.uniform(0.05, 0.4, (n, 2)))
    points = 2 * rng.normal(size=(40, d))
    centre, radius = body.spheres(4001)
    brute = (radius[:, None] - np.linalg.norm(centre[:, None] - points, axis=2)).max(axis=0)
    np.testing.assert_allclose(body.level(points, reach=20.0), brute, atol=1e-3)


def test_level_is_exact_up_to_its_reach_and_ends_there():
    """Far outside the level is minus the reach, nearer it does not depend on it."""
    body = Capsules(np.zeros((1, 2)), np.array([[1.0, 0.0]]), np.array([[0.2, 0.1]]))
    points = np.array([[0.5, 0.3], [5.0, 0.0], [0.5, 0.0]])
    short, long = body.level(points, 0.5), body.level(points, 50.0)
    np.testing.assert_allclose(short, np.maximum(long, -0.5), atol=1e-15)
    assert long[1] == pytest.approx(-3.9)
    assert body.level(np.empty((0, 2)), 1.0).shape == (0,)


def test_a_capsule_of_no_length_is_its_larger_ball():
    """Two balls about one centre, or one inside the other, are the larger one."""
    for end in (0.0, 0.01):
        body = Capsules(np.zeros((1, 3)), np.array([[end, 0.0, 0.0]]), np.array([[0.5, 0.2]]))
        levels = body.level(np.array([[0.4, 0.0, 0.0], [0.0, 0.7, 0.0]]), 9.0)
        np.testing.assert_allclose(levels, [0.1, -0.2], atol=1e-6)


def test_bounds_touch_the_union():
    """The box holds every ball and is no larger."""
    body = Capsules(
        np.array([[0.0, 0.0], [1.0, 1.0]]), np.array([[2.0, 0.0], [1.0, 3.0]]), np.full((2, 2), 0.25)
    )
    low, high = body.bounds()
    np.testing.assert_allclose([low, high], [[-0.25, -0.25], [2.25, 3.25]])
