"""Tests of spem.decomposition.sparse_coding."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import scipy.sparse
from sklearn.decomposition import DictionaryLearning
from sklearn.utils.estimator_checks import parametrize_with_checks

import spem
from spem.decomposition.sparse_coding import NonnegativeSparseCoding, fit_counts, largest_sparsity
from spem.errors import ParameterError
from spem.fields.boundary.sources import point_sources
from spem.fields.operator import assemble
from spem.fields.superposition.fields import solve_sources


@parametrize_with_checks([NonnegativeSparseCoding(2, n_init=1, random_state=0)])
def test_scikit_learn_contract(estimator, check):
    """Sparse coding keeps the contract of scikit-learn's estimators."""
    check(estimator)


@pytest.fixture(scope="module")
def samples() -> np.ndarray:
    """Return noisy samples of four hidden atoms."""
    rng = np.random.default_rng(5)
    atoms = rng.random((4, 30)) * (rng.random((4, 30)) < 0.4)
    return rng.random((300, 4)) ** 3 @ atoms + 0.05 * rng.random((300, 30))


def test_one_component_is_the_singular_vector(samples):
    """With k = 1 and λ = 0 the atom is the first right singular vector, and the error the rest."""
    coder = NonnegativeSparseCoding(1, tol=1e-12).fit(samples)
    _, values, right = np.linalg.svd(samples, full_matrices=False)
    np.testing.assert_allclose(coder.components_[0], np.abs(right[0]), atol=1e-6)
    np.testing.assert_allclose(coder.reconstruction_err_**2, (values[1:] ** 2).sum(), rtol=1e-9)


def test_one_component_with_sparsity_is_stationary(samples):
    """With k = 1 the atom is along the sum of the samples weighted by their codes a·y − λ."""
    coder = NonnegativeSparseCoding(1, 0.5, tol=1e-13)
    codes = coder.fit_transform(samples)
    atom = coder.components_[0]
    np.testing.assert_allclose(codes[:, 0], np.maximum(samples @ atom - 0.5, 0), atol=1e-12)
    pull = codes[:, 0] @ samples
    np.testing.assert_allclose(atom, pull / np.linalg.norm(pull), atol=1e-6)


def test_attributes_agree(samples):
    """Objective, path, error and codes of the fit say the same."""
    coder = NonnegativeSparseCoding(4, 0.1, random_state=0)
    codes = coder.fit_transform(samples)
    rest = samples - coder.inverse_transform(codes)
    np.testing.assert_allclose(coder.reconstruction_err_, np.linalg.norm(rest))
    np.testing.assert_allclose(coder.objective_, 0.5 * (rest**2).sum() + 0.1 * codes.sum())
    np.testing.assert_allclose(coder.transform(samples), codes, atol=1e-12)
    assert coder.objective_ == coder.objective_path_[-1]
    assert coder.n_iter_ == len(coder.objective_path_)
    assert (np.diff(coder.objective_path_) <= 0).all()
    assert coder.converged_
    assert coder.n_active_ == 4
    assert list(coder.get_feature_names_out())[-1] == "nonnegativesparsecoding3"


def test_objective_is_no_higher_than_dictionary_learning(samples):
    """At the same λ, k and unit ball the objective is not above that of scikit-learn's coordinate descent."""
    other = DictionaryLearning(
        4, alpha=0.1, fit_algorithm="cd", positive_code=True, positive_dict=True, random_state=0
    ).fit(samples)
    assert NonnegativeSparseCoding(4, 0.1, random_state=0).fit(samples).objective_ <= other.error_[-1]


def test_sparsity_makes_codes_sparse(samples):
    """A larger λ leaves fewer positive codes and a larger error."""
    coders = [NonnegativeSparseCoding(4, share * largest_sparsity(samples)) for share in (0, 0.1, 0.4)]
    positive = [(coder.fit_transform(samples) > 0).mean() for coder in coders]
    assert positive[0] > positive[1] > positive[2] > 0
    errors = [coder.reconstruction_err_ for coder in coders]
    assert errors[0] < errors[1] < errors[2]


def test_seed_decides(samples):
    """One seed gives one result, and the samples stay as they are."""
    before = samples.copy()
    first, second = (NonnegativeSparseCoding(3, random_state=7).fit_transform(samples) for _ in range(2))
    np.testing.assert_array_equal(first, second)
    np.testing.assert_array_equal(samples, before)


def test_unit_of_the_data_does_not_matter(samples):
    """Samples and λ in another unit give the same atoms and codes in that unit."""
    codes = NonnegativeSparseCoding(3, 0.1, random_state=0).fit_transform(samples)
    scaled = NonnegativeSparseCoding(3, 0.1 * 2.0**70, random_state=0).fit_transform(samples * 2.0**70)
    np.testing.assert_allclose(scaled / 2.0**70, codes, atol=1e-9)


def test_known_atoms_are_where_the_fit_starts(samples):
    """A fit from the atoms of another one does not end higher; missing atoms are added."""
    first = NonnegativeSparseCoding(3, 0.05, random_state=0).fit(samples)
    again = NonnegativeSparseCoding(3, 0.05, init=first.components_).fit(samples)
    more = NonnegativeSparseCoding(4, 0.05, init=first.components_).fit(samples)
    assert again.objective_ <= first.objective_ * (1 + 1e-12)
    assert again.n_iter_ <= first.n_iter_
    assert more.objective_ < first.objective_


def test_curve_over_counts_falls(samples):
    """More components never explain less."""
    coders = list(fit_counts(samples, range(1, 7), 0.02, random_state=0))
    assert [coder.n_components for coder in coders] == [1, 2, 3, 4, 5, 6]
    assert (np.diff([coder.objective_ for coder in coders]) < 0).all()


def test_iterations_run_out(samples):
    """A fit cut short says so and still has atoms of unit norm and exact codes."""
    coder = NonnegativeSparseCoding(4, 0.02, max_iter=1)
    codes = coder.fit_transform(samples)
    assert not coder.converged_
    assert coder.n_iter_ == 1
    np.testing.assert_allclose(coder.transform(samples), codes, atol=1e-12)


def test_zero_samples():
    """Samples that are all zero are coded by zeros."""
    coder = NonnegativeSparseCoding(2)
    assert not coder.fit_transform(np.zeros((5, 4))).any()
    assert coder.objective_ == 0
    assert coder.n_active_ == 0


def test_sparse_matrix(samples):
    """A CSR matrix is coded as the array is."""
    clipped = np.where(samples < 0.2, 0, samples)
    dense, sparse = (
        NonnegativeSparseCoding(3, 0.1, random_state=0).fit_transform(X)
        for X in (clipped, scipy.sparse.csr_array(clipped))
    )
    np.testing.assert_allclose(sparse, dense, atol=1e-6)


BAD = {
    "n_components=0: expected 1 to 30": {"n_components": 0},
    "n_components=31: expected 1 to 30, no more than n_samples=300 or n_features=30": {"n_components": 31},
    "n_components=2.5: expected 1 to 30": {"n_components": 2.5},
    "sparsity=-1: expected a finite": {"sparsity": -1},
    "sparsity=nan: expected a finite": {"sparsity": np.nan},
    "sparsity=1e\\+06: all codes vanish; expected less than 4.68573, the largest norm": {"sparsity": 1e6},
    "init='best': expected one of 'farthest', 'k-means\\+\\+', 'random', or atoms": {"init": "best"},
    "init has the shape \\(2, 5\\); expected finite atoms from 0 on, of shape \\(≤ 8, 30\\)": {
        "init": np.ones((2, 5))
    },
    "sparsity='1': expected a finite": {"sparsity": "1"},
    "n_init=0: expected a whole number, at least 1": {"n_init": 0},
    "max_iter=0: expected a whole number, at least 1": {"max_iter": 0},
    "max_iter=1.5: expected a whole number": {"max_iter": 1.5},
    "tol=None: expected at least 0": {"tol": None},
    "tol=-1: expected at least 0": {"tol": -1},
}


@pytest.mark.parametrize("message", BAD)
def test_bad_parameters(samples, message):
    """A parameter out of its range is named with the range."""
    with pytest.raises(ParameterError, match=message):
        NonnegativeSparseCoding(**BAD[message]).fit(samples)


def test_the_limit_of_sparsity_is_sharp(samples):
    """Just below the largest norm of a sample a code is positive; at it, the call refuses."""
    limit = largest_sparsity(samples)
    assert NonnegativeSparseCoding(1, limit * (1 - 1e-9)).fit_transform(samples).any()
    with pytest.raises(ParameterError, match="all codes vanish"):
        NonnegativeSparseCoding(1, limit).fit(samples)


@pytest.mark.parametrize(("value", "message"), [(-1, "Negative values"), (np.nan, "NaN"), (np.inf, "inf")])
def test_bad_samples(samples, value, message):
    """Samples below zero or not finite are refused, in fit and in transform."""
    bad = samples.copy()
    bad[3, 4] = value
    coder = NonnegativeSparseCoding(2).fit(samples)
    with pytest.raises(ParameterError, match=message):
        coder.transform(bad)
    with pytest.raises(ParameterError, match=message):
        coder.fit(bad)


@pytest.mark.parametrize("unit", [1e-138, 1e140])
def test_the_unit_of_the_samples_does_not_matter(samples, unit):
    """Codes grow with the samples, as far as squares are numbers."""
    coder = NonnegativeSparseCoding(3, 0.1, random_state=0)
    again = NonnegativeSparseCoding(3, 0.1 * unit, random_state=0)
    np.testing.assert_allclose(
        again.fit_transform(samples * unit) / unit, coder.fit_transform(samples), atol=1e-9
    )


@pytest.mark.parametrize("unit", [1e-200, 1e160])
def test_samples_beyond_floating_point_are_refused(samples, unit):
    """Where squares would vanish or overflow, the call says so."""
    with pytest.raises(ParameterError, match="squares leave the range of float64, scale X"):
        NonnegativeSparseCoding(3, random_state=0).fit(samples * unit)


def test_codes_may_be_sparse(samples):
    """Codes as a sparse matrix stand for the same samples."""
    coder = NonnegativeSparseCoding(3, 0.1, random_state=0)
    codes = coder.fit_transform(samples)
    np.testing.assert_allclose(
        coder.inverse_transform(scipy.sparse.csr_array(codes)), coder.inverse_transform(codes)
    )


def test_codes_of_another_size(samples):
    """Codes of another number of components are refused."""
    with pytest.raises(ParameterError, match=r"codes have the shape \(1, 3\); expected \(n_samples, 2\)"):
        NonnegativeSparseCoding(2).fit(samples).inverse_transform(np.ones((1, 3)))


@pytest.mark.data
def test_parts_of_a_hand(data_dir: Path):
    """Eight components of a hand's clipped log-fields explain nearly all, from any seed alike."""
    shape = spem.read(data_dir / "tari1000" / "obj11_3.png", inner_radius=20)
    log = solve_sources(point_sources(assemble(shape, "voxel")), np.inf).log
    X = np.maximum(log - log.mean(axis=0), 0).T
    first, second = (NonnegativeSparseCoding(8, random_state=seed).fit(X) for seed in (0, 1))
    assert first.objective_ < 0.05 * 0.5 * (X**2).sum()
    np.testing.assert_allclose(second.objective_, first.objective_, rtol=1e-5)
