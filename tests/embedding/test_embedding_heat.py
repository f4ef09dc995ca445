"""The heat kernel and the diffusion distance: closed forms and laws."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.linalg

import spem
from spem.embedding.heat import diffusion_distance, heat_kernel
from spem.errors import ParameterError
from spem.fields.spectrum import Spectrum, solve_spectrum
from spem.shapes.shape import Shape


@pytest.fixture(scope="module")
def whole() -> Spectrum:
    """All eigenpairs of a small shape, so that sums over them are exact."""
    mask = np.ones((7, 6))
    mask[2:5, 3:] = 0
    return solve_spectrum(Shape.from_mask(mask, (0.5, 1.0)), int(mask.sum()))


def test_heat_kernel_is_the_exponential_of_the_laplacian(whole):
    """p_t = exp(-tA)/h^d, entry for entry, where no pair is left out."""
    size = whole.values.size
    laplacian = (whole.vectors * whole.values) @ whole.vectors.T * 0.5
    expected = scipy.linalg.expm(-0.3 * laplacian) / 0.5
    assert np.allclose(heat_kernel(whole, 0.3, np.arange(size)), expected)


def test_heat_kernel_is_symmetric_positive_and_keeps_heat(whole):
    """What leaves q for x leaves x for q, none is lost through a free boundary, and it composes over time."""
    nodes = np.arange(whole.values.size)
    heat = heat_kernel(whole, 0.4, nodes)
    assert np.allclose(heat, heat.T)
    assert heat.min() > 0
    assert np.allclose(heat.sum(axis=0) * 0.5, 1)
    assert np.allclose(heat @ heat * 0.5, heat_kernel(whole, 0.8, nodes))


def test_heat_is_gaussian_away_from_the_boundary():
    """(3.2): a square is much larger than the spread, and time than a voxel."""
    square = Shape.from_mask(np.ones((41, 41)), 0.1)
    spectrum = solve_spectrum(square, 120)
    middle, time = 20 * 41 + 20, 0.2
    distance = np.linalg.norm(square.points - square.points[middle], axis=1)
    exact = np.exp(-(distance**2) / (4 * time)) / (4 * np.pi * time)
    assert np.allclose(heat_kernel(spectrum, time, middle)[:, 0], exact, atol=0.01 * exact.max())


def test_absorbing_boundary_takes_heat():
    """What is left of it decays with the first eigenvalue."""
    disk = spem.synthetic.disk(radius=1.0, spacing=0.1)
    spectrum = solve_spectrum(disk, 60, boundary="absorbing")
    early, late = (heat_kernel(spectrum, time, 0).sum() for time in (1.0, 1.5))
    assert late / early == pytest.approx(np.exp(-0.5 * spectrum.values[0]), rel=1e-3)


def test_diffusion_distance_is_the_distance_of_heat_kernels(whole):
    """In L2 over the shape; symmetric, zero at the source, with the triangle inequality."""
    nodes = np.arange(whole.values.size)
    heat = heat_kernel(whole, 0.3, nodes)
    direct = np.sqrt(0.5 * np.square(heat[:, :, None] - heat[:, None, :]).sum(axis=0))
    distance = diffusion_distance(whole, 0.3, nodes)
    assert np.allclose(distance, direct)
    assert np.allclose(distance, distance.T)
    assert (distance[:, None] <= distance[:, :, None] + distance[None] + 1e-12).all()


@pytest.mark.parametrize("sources", [-1, 33, [0.5], [], [[0]]])
def test_sources_are_nodes(whole, sources):
    """The message says how many there are."""
    with pytest.raises(ParameterError, match="expected numbers of nodes, 0 to 32"):
        heat_kernel(whole, 1.0, sources)


@pytest.mark.parametrize("time", [0.0, -1.0, np.inf])
def test_time_is_positive(whole, time):
    """For the kernel and the distance alike."""
    for function in (heat_kernel, diffusion_distance):
        with pytest.raises(ParameterError, match=r"time=.*expected positive finite numbers"):
            function(whole, time, 0)


def test_what_is_no_spectrum_or_no_time_is_refused(whole):
    """A shape, or a word."""
    with pytest.raises(ParameterError, match="expected Spectrum, got Shape; make it"):
        heat_kernel(whole.shape, 1.0, [0])
    with pytest.raises(ParameterError, match="expected Spectrum, got Shape; make it"):
        diffusion_distance(whole.shape, 1.0, [0])
    with pytest.raises(ParameterError, match=r"time=.*expected positive finite numbers"):
        heat_kernel(whole, "a", [0])
