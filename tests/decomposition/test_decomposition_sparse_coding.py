"""Tests of spem.decomposition.sparse_coding."""

from __future__ import annotations

from sklearn.utils.estimator_checks import parametrize_with_checks

from spem.decomposition.sparse_coding import NonnegativeSparseCoding


@parametrize_with_checks([NonnegativeSparseCoding(2, n_init=1, random_state=0)])
def test_scikit_learn_contract(estimator, check):
    """Sparse coding keeps the contract of scikit-learn's estimators."""
    check(estimator)
