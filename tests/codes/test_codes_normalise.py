"""Intensities of projections."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from spem.codes.features import sweep_bands
from spem.codes.normalise import Normalisation, peak_share, relative_deviations, unit_rms
from spem.codes.settings import Settings
from spem.embedding.maps import compute_maps
from spem.errors import ParameterError
from spem.shapes.synthetic import disk


def test_share_of_the_peak_is_of_the_first_projection_in_any_unit():
    """Only the first projection counts, its largest magnitude is one, and zeros stay zero."""
    maps = np.random.default_rng(2).normal(size=(50, 3))
    shares = peak_share(maps)
    assert np.abs(shares).max() == 1
    np.testing.assert_allclose(peak_share(maps * [1e200, 0, 9]), shares, rtol=1e-14)
    assert not peak_share(np.zeros((4, 2))).any()


def test_share_of_the_mean_field_falls_from_the_boundary():
    """On a disk the share of the first SPEM map is near one at the rim and least at the middle."""
    shape = disk(radius=12.0, spacing=1.0)
    shares = peak_share(compute_maps(sweep_bands(shape, Settings()), 3).values)
    radius = np.linalg.norm(shape.points - shape.points.mean(axis=0), axis=1)
    assert shares[radius.argmax()] > 0.9
    assert shares.argmin() == radius.argmin()


def test_unit_rms_has_mean_square_one_and_keeps_zero_columns():
    """Every column has mean square one, but for one of zeros."""
    maps = np.random.default_rng(0).normal(3, 2, (500, 4))
    maps[:, 2] = 0
    assert np.mean(unit_rms(maps) ** 2, axis=0) == pytest.approx([1, 1, 0, 1], abs=1e-14)


@given(st.floats(-300, 300), st.integers(1, 5))
def test_unit_rms_ignores_scale_and_repetition(exponent, copies):
    """Neither the unit of a projection nor finer sampling of the same values changes a node."""
    maps = np.random.default_rng(1).normal(size=(20, 3))
    scaled = np.tile(maps * 10.0**exponent, (copies, 1))
    np.testing.assert_allclose(unit_rms(scaled)[:20], unit_rms(maps), rtol=1e-12)


def test_unit_rms_leaves_its_argument_alone_and_keeps_float32():
    """The caller's array is untouched, and single precision stays single."""
    maps = np.full((4, 2), 5, np.float32)
    maps.flags.writeable = False
    assert unit_rms(maps).dtype == np.float32


@given(st.floats(1e-6, 1e6), st.integers(1, 6))
def test_deviations_ignore_unit_and_number_of_nodes(unit, copies):
    """A common factor on all projections or more nodes of the same values change no weight."""
    samples = [np.random.default_rng(seed).normal(size=(30, 3)) * [3, 2, 1] for seed in range(2)]
    weights = relative_deviations(samples)
    changed = relative_deviations([np.tile(unit * sample, (copies, 1)) for sample in samples])
    np.testing.assert_allclose(changed, weights, rtol=1e-9)
    assert np.linalg.norm(weights) == pytest.approx(1)


def test_deviations_are_the_pooled_ones():
    """Deviations are taken over the nodes of all shapes together, not shape by shape."""
    samples = [np.array([[0.0, 0.0]] * 2), np.array([[3.0, 4.0]] * 2)]
    np.testing.assert_allclose(relative_deviations(samples), [0.6, 0.8])


def test_deviations_of_constant_maps_are_refused():
    """Maps that nowhere vary cannot be weighted."""
    with pytest.raises(ParameterError, match="no projection varies"):
        relative_deviations([np.ones((5, 2))])


def test_standard_nodes_have_unit_deviation():
    """Over the training nodes every standardised projection has mean zero and deviation one."""
    rng = np.random.default_rng(0)
    unit = [unit_rms(rng.normal(2, 1, (300, 3)) * [1, 5, 9]) for _ in range(4)]
    normal = Normalisation.standard(unit)
    nodes = np.concatenate([normal.apply(maps) for maps in unit])
    np.testing.assert_allclose([nodes.mean(axis=0), nodes.std(axis=0)], [[0] * 3, [1] * 3], atol=1e-12)


def test_standardising_does_not_blow_up_what_is_constant():
    """A projection that is zero everywhere gives zeros."""
    maps = np.random.default_rng(0).normal(size=(200, 2)) * [1, 0]
    assert not Normalisation.standard([unit_rms(maps)]).apply(maps)[:, 1].any()


def test_whitened_nodes_have_unit_covariance():
    """Over the training nodes whitened features have mean zero and covariance one."""
    rng = np.random.default_rng(0)
    unit = [unit_rms(rng.normal(2, 1, (300, 3)) @ rng.normal(size=(3, 3))) for _ in range(4)]
    normal = Normalisation.whitening(unit)
    nodes = np.concatenate([normal.apply(maps) for maps in unit])
    np.testing.assert_allclose(nodes.mean(axis=0), 0, atol=1e-12)
    np.testing.assert_allclose(np.cov(nodes.T, bias=True), np.eye(3), atol=1e-10)


def test_whitening_does_not_blow_up_what_is_constant():
    """A projection that is zero, or a copy of another, gives finite small features."""
    maps = np.random.default_rng(0).normal(size=(200, 1)) * [1, 1, 0]
    features = Normalisation.whitening([unit_rms(maps)]).apply(maps)
    assert np.abs(features[:, 1:]).max() < 1e-6


def test_deviation_weights_are_those_of_the_paper():
    """Features are unit-rms projections times the deviation of their index."""
    maps = np.random.default_rng(0).normal(size=(200, 3)) * [5, 2, 1]
    expected = unit_rms(maps) * relative_deviations([maps])
    np.testing.assert_allclose(Normalisation.by_deviation([maps]).apply(maps), expected, rtol=1e-12)


def test_whitening_of_constant_maps_is_refused():
    """Maps that nowhere vary cannot be whitened or standardised."""
    with pytest.raises(ParameterError, match="no projection varies"):
        Normalisation.whitening([np.ones((5, 2))])
    with pytest.raises(ParameterError, match="no projection varies"):
        Normalisation.standard([np.ones((5, 2))])
