"""Tests of spem.decomposition.coding_search."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.sparse
from numpy.random import RandomState

from spem.decomposition.coding_search import RULES, Search, row_squares, start_atoms

SEPARABLE = np.kron(np.diag([3.0, 2.0, 1.0]), np.arange(1.0, 6.0)[:, None])


@pytest.mark.parametrize("rule", RULES)
def test_atoms_are_samples_of_unit_norm(rule):
    """Every rule gives rays of samples."""
    X = np.random.default_rng(0).random((50, 6))
    rays = X / np.linalg.norm(X, axis=1, keepdims=True)
    atoms = start_atoms(X, 4, rule, RandomState(0))
    assert (np.abs(atoms[:, None] - rays).max(axis=2).min(axis=1) < 1e-15).all()


@pytest.mark.parametrize("rule", ["farthest", "k-means++"])
def test_atoms_that_use_distances_differ(rule):
    """Rules that look at distances find each of three directions once, beside those known."""
    for known in (None, np.eye(3)[1:2]):
        atoms = start_atoms(SEPARABLE, 3, rule, RandomState(1), known)
        np.testing.assert_allclose(np.sort(atoms, axis=0), np.sort(np.eye(3), axis=0), atol=1e-15)


def test_zero_samples_give_atoms():
    """Samples that are all zero are no error: the atoms are zero too."""
    assert not start_atoms(np.zeros((5, 3)), 2, "k-means++", RandomState(0)).any()


def test_row_squares_of_a_sparse_matrix():
    """Sparse and dense samples have the same norms."""
    np.testing.assert_allclose(row_squares(scipy.sparse.csr_array(SEPARABLE)), row_squares(SEPARABLE))


def test_search_on_samples_finds_the_components_of_all():
    """Parts of very different frequency are found although starts see a share of the data."""
    rng = np.random.default_rng(3)
    atoms = np.kron(np.eye(4), np.ones(5)) / np.sqrt(5)
    part = rng.choice(4, 20_000, p=[0.6, 0.3, 0.09, 0.01])
    X = rng.uniform(1, 2, 20_000)[:, None] * atoms[part]
    search = Search("farthest", 2, 100, 1e-7)
    coding = search.run(X, 4, np.empty((0, 20)), 0.1, RandomState(0))
    np.testing.assert_allclose(np.sort(coding.atoms, axis=0), np.sort(atoms, axis=0), atol=1e-9)
    assert (coding.atoms @ atoms.T)[coding.codes.argmax(axis=1), part] == pytest.approx(1)
