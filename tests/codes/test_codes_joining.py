"""Joined codes: their correlation distance, and weights that see no label."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from spem.codes.joining import fusion_weights, join_codes
from spem.errors import ParameterError
from spem.retrieval.distances import correlation_distance


@given(
    seed=st.integers(0, 2**32 - 1),
    lengths=st.lists(st.integers(2, 30), min_size=1, max_size=4),
    scale=st.floats(1e-6, 1e6),
)
@settings(max_examples=30, deadline=None)
def test_distances_of_joined_codes_are_weighted_sums(seed, lengths, scale):
    """Whatever the length, mean and size of the codes of each kind."""
    rng = np.random.default_rng(seed)
    codes = [scale * rng.normal(rng.normal(), 1, (5, n)) for n in lengths]
    weights = rng.uniform(0.1, 1, len(lengths))
    joined = join_codes(codes, weights)
    parts = [correlation_distance(each, each) for each in codes]
    expected = np.tensordot(weights / weights.sum(), parts, 1)
    np.testing.assert_allclose(correlation_distance(joined, joined), expected, atol=1e-12)
    np.testing.assert_allclose(np.linalg.norm(joined, axis=1), 1)
    np.testing.assert_allclose(join_codes([each[2] for each in codes], weights), joined[2], atol=1e-15)


def test_weight_of_nothing_leaves_a_kind_out():
    """A kind of weight zero has no say; equal weights are the mean."""
    rng = np.random.default_rng(0)
    one, two = rng.random((4, 6)), rng.random((4, 9))
    alone = correlation_distance(one, one)
    joined = join_codes([one, two], [1, 0])
    np.testing.assert_allclose(correlation_distance(joined, joined), alone, atol=1e-12)
    both = join_codes([one, two])
    np.testing.assert_allclose(
        correlation_distance(both, both), (alone + correlation_distance(two, two)) / 2, atol=1e-12
    )


def test_constant_code_of_a_kind_has_no_say():
    """It correlates with nothing: zeros stand in its place."""
    codes = [np.array([[1.0, 2.0, 4.0], [3.0, 1.0, 0.0]]), np.array([[1.0, 1.0], [0.0, 1.0]])]
    joined = join_codes(codes)
    np.testing.assert_array_equal(joined[0, 3:], 0)
    assert np.isfinite(joined).all()


def test_weights_even_out_the_spreads():
    """Ratios of weights are those of the inverse spreads for many shapes, their roots for twenty."""
    rng = np.random.default_rng(1)
    for n, power in ((20, 0.5), (400, 400 / 420)):
        tight = 5 + rng.random((n, 40)) + 3 * rng.random(40)
        wide = rng.normal(size=(n, 3))
        weights = fusion_weights([tight, wide])
        upper = np.triu_indices(n, 1)
        spreads = [correlation_distance(kind, kind)[upper].std() for kind in (tight, wide)]
        np.testing.assert_allclose(weights[0] / weights[1], (spreads[1] / spreads[0]) ** power)
        assert weights.sum() == pytest.approx(1)
        assert weights[0] > weights[1]


@pytest.mark.parametrize("codes", [[[[1.0, 2.0]], [[3.0, 1.0, 2.0]]], [np.eye(3) * 0 + [1, 2, 3], np.eye(3)]])
def test_weights_are_equal_where_distances_do_not_differ(codes):
    """One shape alone, or the same shape thrice, tells nothing."""
    np.testing.assert_array_equal(fusion_weights(codes), [0.5, 0.5])


@pytest.mark.parametrize(
    ("codes", "weights", "message"),
    [
        ([], None, "codes to join have shapes none; give"),
        ([np.ones((3, 2)), np.ones((4, 2))], None, r"codes to join have shapes \(3, 2\), \(4, 2\); give"),
        ([np.ones((3, 2)), np.ones(2)], None, "codes to join have shapes"),
        ([1.0], None, "codes to join have shapes"),
        ([np.ones(2), np.ones(2)], [1.0], r"weights=\[1.0\]: expected 2 numbers of at least 0"),
        ([np.ones(2), np.ones(2)], [1.0, -1.0], "expected 2 numbers of at least 0"),
        ([np.ones(2), np.ones(2)], [0.0, 0.0], "not all 0"),
        ([np.ones(2), np.ones(2)], [np.nan, 1.0], "expected 2 numbers"),
        ([np.arange(2.0), [np.nan, 1.0]], None, "codes of kind 1 contain NaN or inf"),
    ],
)
def test_codes_that_do_not_go_together_are_refused(codes, weights, message):
    """One clear line each."""
    with pytest.raises(ParameterError, match=message):
        join_codes(codes, weights)


@pytest.mark.parametrize(
    ("codes", "message"),
    [
        ([], "no codes to weigh; give those of each kind"),
        ([np.eye(3), np.eye(2)], r"codes to weigh have shapes \(3, 3\), \(2, 2\); give \(n_shapes, n_code\)"),
        ([np.ones(3), np.ones(3)], r"codes to weigh have shapes \(3,\), \(3,\); give"),
        ([np.full((3, 3), np.inf), np.eye(3)], "codes of kind 0 contain NaN or inf"),
    ],
)
def test_codes_that_cannot_be_weighed_are_refused(codes, message):
    """One clear line each."""
    with pytest.raises(ParameterError, match=message):
        fusion_weights(codes)
