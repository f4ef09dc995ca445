"""Nearest centres, residual moments and the vocabulary estimator."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from sklearn.utils.estimator_checks import parametrize_with_checks

from spem.codes.vocabulary import Vocabulary, nearest_centers, sum_residuals
from spem.errors import ParameterError


@settings(deadline=None)  # the first call may compile
@given(
    st.integers(0, 10_000),
    st.integers(1, 60),
    st.integers(1, 9),
    st.integers(1, 40),
    st.sampled_from([np.float32, np.float64]),
)
def test_kernels_agree_with_the_definition(seed, n_nodes, n_features, n_centers, dtype):
    """Assignment and sums are those of (5.1) and (5.2) written out."""
    rng = np.random.default_rng(seed)
    nodes = rng.normal(size=(n_nodes, n_features)).astype(dtype)
    centers = rng.normal(size=(n_centers, n_features)).astype(dtype)
    squares = ((nodes[:, None].astype(float) - centers) ** 2).sum(-1)
    labels = nearest_centers(nodes, centers)
    np.testing.assert_allclose(squares[np.arange(n_nodes), labels], squares.min(1), rtol=1e-5)
    sums, squares = np.zeros((2, n_centers, n_features))
    np.add.at(sums, labels, nodes.astype(float) - centers[labels])
    np.add.at(squares, labels, (nodes.astype(float) - centers[labels]) ** 2)
    found = sum_residuals(nodes, centers)
    assert found.counts.tolist() == np.bincount(labels, minlength=n_centers).tolist()
    np.testing.assert_allclose(found.sums, sums, atol=1e-11)
    np.testing.assert_allclose(found.squares, squares, atol=1e-11)


def test_squares_of_the_training_nodes_exceed_nothing():
    """Against their own mean squares nodes have no excess, and a centre without a node has none."""
    rng = np.random.default_rng(0)
    nodes, centers = rng.normal(size=(60, 2)), np.array([[0.0, 0.0], [1.0, 1.0], [99.0, 99.0]])
    found = sum_residuals(nodes, centers)
    np.testing.assert_allclose(found.excess(found.spreads), 0, atol=1e-12)
    np.testing.assert_allclose(sum_residuals(np.tile(nodes, (3, 1)), centers).spreads, found.spreads)


def test_ties_go_to_the_first_centre():
    """Of equally near centres the first one gets the node."""
    assert nearest_centers(np.array([[0.0], [2.0]]), np.array([[1.0], [-1.0], [1.0]])).tolist() == [0, 0]


def test_kernels_take_any_memory_layout():
    """Transposed and strided arrays give what contiguous ones give."""
    rng = np.random.default_rng(3)
    nodes, centers = np.asfortranarray(rng.normal(size=(50, 4))), rng.normal(size=(14, 4))[::2]
    expected = sum_residuals(nodes.copy("C"), centers.copy())
    found = sum_residuals(nodes, centers)
    np.testing.assert_array_equal(found.sums, expected.sums)
    np.testing.assert_array_equal(found.squares, expected.squares)


def test_vocabulary_finds_separate_clusters():
    """Clusters that are far apart get one centre each, at their mean."""
    rng = np.random.default_rng(0)
    middles = np.array([[0.0, 0.0], [10.0, 0.0], [0.0, 10.0]])
    nodes = (middles[:, None] + rng.normal(0, 0.1, (3, 40, 2))).reshape(-1, 2)
    words = Vocabulary(3, random_state=0).fit(nodes)
    order = np.argsort(words.cluster_centers_ @ [1, 2])
    np.testing.assert_allclose(words.cluster_centers_[order], middles, atol=0.1)
    assert words.inertia_ == pytest.approx((words.transform(nodes) ** 2).sum())
    assert np.bincount(words.predict(nodes)).tolist() == [40, 40, 40]


def test_too_few_nodes_are_refused():
    """A vocabulary cannot have more centres than there are nodes."""
    with pytest.raises(ParameterError, match="fewer than n_centers=32"):
        Vocabulary().fit(np.ones((5, 2)))


@parametrize_with_checks([Vocabulary(n_centers=3)])
def test_scikit_learn_contract(estimator, check):
    """The vocabulary keeps the contract of scikit-learn's estimators."""
    check(estimator)
