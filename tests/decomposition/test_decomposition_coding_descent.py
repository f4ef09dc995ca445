"""Tests of spem.decomposition.coding_descent and its kernels."""

from __future__ import annotations

import numpy as np
import scipy.sparse
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import nnls

from spem.decomposition.coding_descent import descend, encode, objective


def mixture(n: int, p: int, k: int, seed: int, noise: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
    """Return samples of k hidden unit atoms, and the atoms."""
    rng = np.random.default_rng(seed)
    atoms = rng.random((k, p)) * (rng.random((k, p)) < 0.4) + 0.01
    atoms /= np.linalg.norm(atoms, axis=1, keepdims=True)
    codes = rng.random((n, k)) * (rng.random((n, k)) < 0.5)
    return codes @ atoms + noise * rng.random((n, p)), atoms


@given(st.integers(0, 10_000), st.integers(1, 9), st.floats(0, 0.5))
@settings(max_examples=25, deadline=None)
def test_codes_meet_the_optimality_conditions(seed, k, sparsity):
    """The derivative is zero where a code is positive and not negative where it is zero."""
    X, atoms = mixture(30, 12, k, seed, noise=0.3)
    codes = encode(X, atoms, sparsity)
    slope = codes @ (atoms @ atoms.T) - X @ atoms.T + sparsity
    scale = np.abs(X).max()
    assert (codes >= 0).all()
    assert slope.min() >= -1e-12 * scale
    assert np.abs(slope[codes > 0]).max(initial=0) <= 1e-12 * scale


def test_codes_are_nonnegative_least_squares_without_sparsity():
    """With λ = 0 the codes are those of an independent solver of non-negative least squares."""
    X, atoms = mixture(40, 10, 5, 0, noise=0.2)
    expected = np.array([nnls(atoms.T, x)[0] for x in X])
    np.testing.assert_allclose(encode(X, atoms, 0.0), expected, atol=1e-12)


def test_codes_of_orthonormal_atoms_are_soft_thresholds():
    """On the unit vectors a code is the entry less λ, or zero."""
    X = np.random.default_rng(0).random((20, 6))
    np.testing.assert_allclose(encode(X, np.eye(6), 0.4), np.maximum(X - 0.4, 0), atol=1e-15)


def test_codes_on_equal_atoms_end():
    """Atoms that are the same, or zero, leave the codes finite and their sum right."""
    atoms = np.array([[0.6, 0.8], [0.6, 0.8], [0.0, 0.0]])
    codes = encode(np.array([[3.0, 4.0]]), atoms, 1.0)
    np.testing.assert_allclose([codes[0, :2].sum(), codes[0, 2]], [4.0, 0.0], atol=1e-12)


@given(st.integers(0, 10_000), st.integers(1, 5), st.floats(0, 0.3), st.sampled_from([0.0, 0.2]))
@settings(max_examples=25, deadline=None)
def test_objective_never_rises_and_is_the_one_stated(seed, k, sparsity, noise):
    """The path falls, and its last value is (4.3) of the atoms and codes, which keep the constraints."""
    X, _ = mixture(60, 15, k + 1, seed, noise)
    start = np.random.default_rng(seed).random((k, 15))
    start /= np.linalg.norm(start, axis=1, keepdims=True)
    coding = descend(X, start, sparsity, 40, 1e-7)
    rest = X - coding.codes @ coding.atoms
    assert (np.diff(coding.path) <= 0).all()
    assert coding.path[0] <= objective(X, start, encode(X, start, sparsity), sparsity)
    np.testing.assert_allclose(coding.path[-1], 0.5 * (rest**2).sum() + sparsity * coding.codes.sum())
    assert coding.atoms.min() >= 0
    assert coding.codes.min() >= 0
    np.testing.assert_allclose(np.linalg.norm(coding.atoms, axis=1), 1)


def test_path_is_exact_where_the_residual_is_tiny():
    """Down to residuals of 1e-11 of the data each value is that of its atoms and codes, never cancelled."""
    X, atoms = mixture(200, 20, 3, 1)
    start = atoms + 0.05 * np.random.default_rng(0).random(atoms.shape)
    start /= np.linalg.norm(start, axis=1, keepdims=True)
    for iterations in (5, 15, 30, 1000):
        coding = descend(X, start, 0.0, iterations, 0.0)
        rest = X - coding.codes @ coding.atoms
        np.testing.assert_allclose(coding.path[-1], 0.5 * (rest**2).sum(), rtol=1e-9)
        assert (np.diff(coding.path) <= 0).all()
        assert (coding.path > 0).all()
    assert coding.path[-1] < 1e-22 * 0.5 * (X**2).sum()


def test_sparse_samples_give_the_same():
    """Samples in a CSR matrix lead to the same atoms and codes as in an array."""
    X, start = mixture(80, 15, 4, 2, noise=0.1)
    X[X < 0.15] = 0
    dense, sparse = (descend(Y, start, 0.05, 30, 1e-6) for Y in (X, scipy.sparse.csr_array(X)))
    np.testing.assert_allclose(sparse.atoms, dense.atoms, atol=1e-9)
    np.testing.assert_allclose(sparse.codes, dense.codes, atol=1e-9)


def test_an_unused_component_is_put_where_it_helps():
    """A component that no sample uses takes over a direction that none explains."""
    X = np.kron(np.diag([3.0, 2.0, 1.0]), np.ones((4, 1)))
    coding = descend(X, np.eye(3)[[0, 0, 1]], 0.1, 100, 1e-8)
    assert coding.converged
    np.testing.assert_allclose(np.sort(coding.atoms, axis=0)[-1], 1)
    np.testing.assert_allclose(coding.path[-1], 4 * sum(0.1 * x - 0.005 for x in (3, 2, 1)))


def test_an_unused_component_stays_where_sparsity_leaves_nothing():
    """A component that could explain only residuals shorter than λ has no codes."""
    X = np.kron(np.diag([3.0, 2.0, 0.4]), np.ones((4, 1)))
    coding = descend(X, np.eye(3), 0.5, 100, 1e-8)
    assert coding.converged
    assert not coding.codes[:, 2].any()
