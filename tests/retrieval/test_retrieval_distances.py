"""Distances between codes, and their fusion."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from spem.errors import ParameterError
from spem.retrieval.distances import correlation_distance, fuse, min_max


def test_agrees_with_numpy_correlation():
    """The distance is one minus numpy's correlation coefficient."""
    rng = np.random.default_rng(0)
    queries, codes = rng.normal(size=(4, 30)), rng.normal(size=(7, 30))
    exact = 1 - np.corrcoef(queries, codes)[:4, 4:]
    np.testing.assert_allclose(correlation_distance(queries, codes), exact, atol=1e-14)


def test_same_object_gives_a_symmetric_matrix_with_zero_diagonal():
    """Codes against themselves are exactly symmetric, with an exactly zero diagonal."""
    codes = np.random.default_rng(1).normal(size=(50, 333))
    distance = correlation_distance(codes, codes)
    np.testing.assert_array_equal(distance, distance.T)
    np.testing.assert_array_equal(np.diag(distance), 0)


def test_constant_vectors_are_at_distance_one():
    """A constant vector, zero or not, is at distance 1 from all but itself."""
    codes = np.array([[0.1, 0.1, 0.1], [0.0, 0.0, 0.0], [1.0, 2.0, 4.0]])
    np.testing.assert_array_equal(correlation_distance(codes, codes), 1 - np.eye(3))


@settings(max_examples=40, deadline=None)
@given(
    arrays(float, (3, 6), elements=st.floats(-1e3, 1e3, width=32)),
    st.floats(1e-2, 1e2),
    st.floats(-100, 100),
)
def test_a_positive_affine_map_of_a_code_changes_nothing(codes, scale, shift):
    """Correlation is blind to scale and offset, bounded by 2, and never negative."""
    spread = codes.std(axis=1) > 1e-2 * (1 + np.abs(codes).max(axis=1))
    codes = codes[spread]
    distance = correlation_distance(codes, codes)
    assert ((distance >= 0) & (distance <= 2)).all()
    np.testing.assert_allclose(correlation_distance(scale * codes + shift, codes), distance, atol=1e-8)


def test_inputs_are_left_alone():
    """No argument is modified."""
    codes = np.random.default_rng(2).normal(size=(3, 4))
    before = codes.copy()
    fuse(correlation_distance(codes, codes), correlation_distance(codes, codes))
    np.testing.assert_array_equal(codes, before)


def test_extreme_magnitudes_do_not_overflow():
    """Codes near the limits of floating point are compared like any others."""
    codes = np.array([[1.0, 2.0, 4.0]])
    np.testing.assert_allclose(correlation_distance(codes * 1e300, codes * 1e-300), 0, atol=1e-12)


def test_fusion_is_the_sum_of_normalised_matrices():
    """Each matrix is brought to [0, 1] as a whole, then added."""
    a, b = np.array([[0.0, 1.0], [3.0, 4.0]]), np.array([[10.0, 30.0], [20.0, 10.0]])
    np.testing.assert_allclose(fuse(a, b), [[0, 1.25], [1.25, 1.0]])
    np.testing.assert_array_equal(min_max(np.full((2, 2), 3.0)), np.zeros((2, 2)))


def test_bad_vectors_are_refused():
    """Vectors of different length, values that are not finite and mixed shapes are refused."""
    with pytest.raises(ParameterError, match="3 entries and codes 2"):
        correlation_distance(np.ones((1, 3)), np.ones((1, 2)))
    with pytest.raises(ParameterError, match="codes: row 1 holds values"):
        correlation_distance(np.ones((1, 2)), [[0.0, 1.0], [np.nan, 1.0]])
    with pytest.raises(ParameterError, match=r"queries must be an array of shape \(n, m\)"):
        correlation_distance(np.ones(3), np.ones((1, 3)))
    with pytest.raises(ParameterError, match="one shape, not"):
        fuse(np.ones((2, 2)), np.ones((3, 3)))
    with pytest.raises(ParameterError, match=r"not \(2, 3, 3\); give each by itself"):
        fuse([np.ones((3, 3)), np.ones((3, 3))])
    with pytest.raises(ParameterError, match="must be finite"):
        min_max([np.inf, 1.0])
