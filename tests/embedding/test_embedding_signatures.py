"""Signatures: against the heat kernel and sums written out, under scaling and turning, over collections."""

from __future__ import annotations

import numpy as np
import pytest

import spem
from spem.embedding.heat import heat_kernel
from spem.embedding.signatures import (
    heat_kernel_signature,
    scale_invariant_signature,
    shared_times,
    shared_values,
    wave_kernel_signature,
)
from spem.errors import ParameterError
from spem.fields.spectrum import Spectrum, solve_spectrum
from spem.shapes.shape import Shape


@pytest.fixture(scope="module")
def dog() -> Spectrum:
    """Eigenpairs of a shape without symmetry."""
    shape = spem.creatures.creature("dog", rng=np.random.default_rng(3), voxels=900)
    return solve_spectrum(shape, 60)


@pytest.fixture(scope="module")
def scaled(dog) -> Spectrum:
    """Eigenpairs of the same shape three times as large."""
    shape = dog.shape
    large = Shape(shape.mask, tuple(3 * h for h in shape.spacing), shape.origin, cuts=shape.cuts)
    return solve_spectrum(large, 60)


def test_heat_kernel_signature_is_the_diagonal(dog):
    """p_t(x, x) of each time, falling with it."""
    times = np.array([0.1, 0.4, 2.0]) * dog.shape.size**2
    found = heat_kernel_signature(dog, times)
    for column, time in enumerate(times):
        assert np.allclose(found[:, column], np.diag(heat_kernel(dog, time, np.arange(dog.shape.n_nodes))))
    assert (np.diff(found, axis=1) < 0).all()


def test_default_times_follow_the_eigenvalues(dog):
    """From 4 ln 10 / λ_max to 4 ln 10 / λ_2, at which only a constant is left."""
    found = heat_kernel_signature(dog, n_times=5)
    ends = 4 * np.log(10) / dog.values[[-1, 1]]
    assert np.allclose(found[:, [0, -1]], heat_kernel_signature(dog, ends))
    assert np.allclose(found[:, -1] * dog.shape.n_nodes * np.prod(dog.shape.spacing), 1, atol=0.01)


def test_signatures_under_scaling(dog, scaled):
    """HKS and WKS at their own times and energies fall with the volume; the scale-invariant one stays."""
    for function in (heat_kernel_signature, wave_kernel_signature):
        assert np.allclose(function(dog), 9 * function(scaled))
    assert np.allclose(scale_invariant_signature(dog), scale_invariant_signature(scaled))


def test_scale_invariance_holds_without_knowing_the_spectrum(dog, scaled):
    """Over one range of time for both, a shape and one three times as large differ little; their HKS much."""
    span = (scaled.values[1], dog.values[-1])
    one, two = (scale_invariant_signature(s, 6, span=span) for s in (dog, scaled))
    assert np.abs(one - two).max() < 0.03 * np.abs(one).max()
    times = shared_times(dog.shape.size, 2, 60, 6)
    one, two = (heat_kernel_signature(s, times) for s in (dog, scaled))
    assert np.abs(one - two).max() > 0.5 * np.abs(one).max()


def test_wave_kernel_signature_as_written_out(dog):
    """Weights are normal in log λ and sum to one over the pairs."""
    energies, sigma = np.array([20.0, 90.0]) / dog.shape.size**2, 0.2
    values, vectors = dog.values[1:], dog.vectors[:, 1:]
    weight = np.exp(-((np.log(energies)[None] - np.log(values)[:, None]) ** 2) / (2 * sigma**2))
    expected = np.square(vectors) @ (weight / weight.sum(axis=0))
    assert np.allclose(wave_kernel_signature(dog, energies, deviation=sigma), expected)


def test_wave_kernel_signature_holds_one_particle(dog):
    """The probability of being somewhere is one for each energy, even one beyond the spectrum."""
    energies = np.append(shared_values(dog.shape.size, 2, 60, 9), 1e9)
    total = wave_kernel_signature(dog, energies).sum(axis=0) * np.prod(dog.shape.spacing)
    assert np.allclose(total, 1)


def test_signatures_turn_with_the_shape(dog):
    """A quarter turn of the grid carries each node's values along."""
    shape = Shape.from_mask(dog.shape.mask, dog.shape.spacing)
    turned = Shape.from_mask(np.rot90(shape.mask), shape.spacing)
    order = np.rot90(shape.to_grid(np.arange(shape.n_nodes)))
    order = order[np.isfinite(order)].astype(int)
    ours, theirs = solve_spectrum(shape, 40), solve_spectrum(turned, 40)
    for function in (heat_kernel_signature, scale_invariant_signature, wave_kernel_signature):
        assert np.allclose(function(ours)[order], function(theirs), rtol=1e-5, atol=1e-7)


def test_absorbing_boundary_and_components():
    """Signatures are finite where heat dies out, and at components of which no pair is among the lowest."""
    disk = spem.synthetic.disk(radius=1.0, spacing=0.1)
    absorbing = solve_spectrum(disk, 40, boundary="absorbing")
    assert scale_invariant_signature(absorbing)[:, 0].max() < 40
    mask = np.zeros((12, 16))
    mask[:, :12], mask[5, 14] = 1, 1
    apart = solve_spectrum(Shape.from_mask(mask), 5, boundary="absorbing")
    for function in (heat_kernel_signature, scale_invariant_signature, wave_kernel_signature):
        assert np.isfinite(function(apart)).all()


@pytest.mark.parametrize("ndim", [1, 2, 3, 4])
def test_shared_values_bracket_spectra(ndim):
    """From below the first value of round shapes to half of Weyl's estimate, in units of their size."""
    ball = spem.synthetic.n_ball(1.0, (4.0 / 600) ** (1 / ndim), ndim)
    spectrum, shared = solve_spectrum(ball, 40), shared_values(ball.size, ndim, 40, 5)
    assert shared[0] < spectrum.values[1]
    assert 0.4 < shared[-1] / spectrum.values[-1] < 2
    assert np.allclose(shared_times(ball.size, ndim, 40, 5) * shared[::-1], np.log(10))


def test_impossible_options_are_refused(dog):
    """Times, energies and numbers of them, and spectra that are too short."""
    with pytest.raises(ParameterError, match=r"times=\[0.0\]: expected positive finite numbers"):
        heat_kernel_signature(dog, [0.0])
    with pytest.raises(ParameterError, match="energies="):
        wave_kernel_signature(dog, [-1.0])
    with pytest.raises(ParameterError, match="deviation="):
        wave_kernel_signature(dog, deviation=0.0)
    with pytest.raises(ParameterError, match="n_times=0 must be a whole number of at least 1"):
        heat_kernel_signature(dog, n_times=0)
    with pytest.raises(ParameterError, match="n_frequencies=1000 must be a whole number from 1 to"):
        scale_invariant_signature(dog, 1000)
    with pytest.raises(ParameterError, match="no two values above zero among 2; solve for more pairs"):
        heat_kernel_signature(dog.truncated(2))


def test_a_narrow_deviation_counts_the_nearest_value_alone(dog):
    """However narrow: squares of distances may be more than a float64 holds."""
    first = wave_kernel_signature(dog, dog.values[[7]], deviation=1e-5)
    np.testing.assert_allclose(wave_kernel_signature(dog, dog.values[[7]], deviation=1e-300), first)


def test_spans_sizes_and_counts_out_of_range_are_refused(dog):
    """Three ends, no size, no pair, and what is no spectrum."""
    with pytest.raises(ParameterError, match="expected the lowest and the highest eigenvalue"):
        scale_invariant_signature(dog, span=(1.0, 2.0, 3.0))
    with pytest.raises(ParameterError, match="size="):
        shared_values(0.0, 2, 10, 3)
    for arguments in ((1.0, 0, 10, 3), (1.0, 2, 0, 3), (1.0, 2, 10, 0), (1.0, 2, 10, 2.5)):
        with pytest.raises(ParameterError, match="must be a whole number of at least 1"):
            shared_values(*arguments)
    with pytest.raises(ParameterError, match="expected Spectrum, got Shape; make it"):
        heat_kernel_signature(dog.shape)
