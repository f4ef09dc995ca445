"""Tests of the comparison of codes."""

from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from spem.index.comparison import correlation_distances, nearest
from spem.index.schema import standardised_codes
from spem.retrieval.distances import correlation_distance


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 2**32 - 1), st.integers(1, 40), st.integers(3, 12), st.integers(1, 50))
def test_nearest_is_a_sort_of_all_distances(seed: int, n: int, n_code: int, k: int) -> None:
    """Of any codes, copies and constant ones among them, the order is by distance and then by id."""
    rng = np.random.default_rng(seed)
    # drawn from few, so that there are copies; the first is constant
    some = np.vstack([np.ones(n_code), rng.standard_normal((9, n_code))])
    codes = some[rng.integers(10, size=n)]
    vectors, ids = standardised_codes(codes), np.sort(rng.permutation(n).astype("S4"))
    query = standardised_codes(some[rng.integers(1, 10, size=1)])[0]
    places, distances = nearest(vectors, ids, query, k)
    expected = correlation_distance(query[None].astype(float), vectors.astype(float))[0]
    assert len(places) == min(k, n)
    assert np.allclose(distances, expected[places], atol=1e-7)
    assert np.allclose(distances, np.sort(expected)[:k], atol=1e-7)
    order = sorted(range(n), key=lambda i: (round(expected[i], 9), ids[i]))
    assert places.tolist() == order[:k]


def test_some_places_alone() -> None:
    """Among given places, few or most, only these are answers."""
    vectors = standardised_codes(np.random.default_rng(0).standard_normal((20, 8)))
    ids = np.arange(20).astype("S2")
    for among in (np.array([3, 7]), np.arange(1, 20), np.array([], int)):
        places, _ = nearest(vectors, ids, vectors[0], 30, among)
        assert sorted(places.tolist()) == among.tolist()


def test_distances_are_right_near_zero() -> None:
    """Codes a millionth apart have the distance that float64 gives, which a product in float32 loses."""
    rng = np.random.default_rng(0)
    vector = standardised_codes(rng.standard_normal((1, 64)))
    other = vector + np.float32(1e-5) * rng.standard_normal((1, 64)).astype(np.float32)
    expected = correlation_distance(vector.astype(float), other.astype(float))[0, 0]
    unit = other - other.mean()
    found = correlation_distances(unit / np.linalg.norm(unit), np.array([0]), vector[0])[0]
    assert 1e-10 < expected < 1e-7
    assert abs(found - expected) < 0.01 * expected


def test_constant_codes_are_at_one() -> None:
    """A constant code, kept as zeros, correlates with nothing, itself included."""
    vectors = np.array([[0, 0], [1, 0]], np.float32)
    assert correlation_distances(vectors, np.arange(2), vectors[0]).tolist() == [1, 1]
    assert correlation_distances(vectors, np.arange(2), vectors[1]).tolist() == [1, 0]
