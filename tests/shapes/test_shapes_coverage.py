"""Edges finer than a pixel out of area coverage."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter

from spem.shapes.coverage import coverage_cuts, is_coverage
from spem.shapes.levels import level_shape
from spem.shapes.shape import Shape

SUPERSAMPLING = 40


def covered(inside, n):
    """Area coverage of n x n pixels by the points where a function of coordinates is True."""
    x = (np.arange(n * SUPERSAMPLING) + 0.5) / SUPERSAMPLING - 0.5
    fine = inside(x[:, None], x[None, :])
    return fine.reshape(n, SUPERSAMPLING, n, SUPERSAMPLING).mean(axis=(1, 3))


def cut_places(shape):
    """Coordinates of the cuts of a shape."""
    place = np.stack(np.unravel_index(shape.cuts.voxel, shape.mask.shape), axis=1).astype(float)
    step = np.where(shape.cuts.direction % 2, 1.0, -1.0) * shape.cuts.fraction
    place[np.arange(len(place)), shape.cuts.direction // 2] += step
    return place + shape.origin


def disk_error(radius, make, seed=0):
    """Root mean square distance in pixels from the cuts to the circle, over two random centres."""
    rng = np.random.default_rng(seed)
    errors = []
    for _ in range(2):
        n = 2 * radius + 6
        centre = n / 2 - 0.5 + rng.uniform(-0.5, 0.5, 2)
        image = covered(lambda x, y, c=centre: (x - c[0]) ** 2 + (y - c[1]) ** 2 < radius**2, n)
        errors.append(np.linalg.norm(cut_places(make(image)) - centre, axis=1) - radius)
    return np.sqrt(np.mean(np.concatenate(errors) ** 2))


def by_area(image):
    """Make a shape by the area that is covered."""
    return Shape.from_mask(image > 0.5, cuts=coverage_cuts(image, image > 0.5))


def by_interpolation(image):
    """Make a shape by interpolating the shares."""
    return level_shape(image - 0.5)


def test_cuts_of_a_disk_are_second_order_and_beat_interpolation():
    """The error in pixels falls with the radius, so faster than the pixel, and far below interpolation's."""
    errors = np.array([disk_error(r, by_area) for r in (4, 8, 16)])
    assert errors[0] < 0.012
    assert errors[-1] < 0.005
    assert np.mean(np.log2(errors[:-1] / errors[1:])) > 0.6
    assert errors[2] < disk_error(16, by_interpolation) / 6


@pytest.mark.parametrize("angle", np.deg2rad([0, 7, 26.6, 45, 61, 90, 133]))
def test_straight_edges_are_found_exactly(angle):
    """A straight edge of any direction is placed to the rounding of its coverage."""
    n = np.array([np.cos(angle), np.sin(angle)])
    image = covered(lambda x, y: (x - 9.3) * n[0] + (y - 9.6) * n[1] < 0, 20)
    shape = by_area(image)
    places = cut_places(shape)
    middle = np.all(np.abs(places - 9.5) < 6, axis=1)
    assert np.abs((places[middle] - [9.3, 9.6]) @ n).max() < 0.03


def test_eight_bits_are_enough():
    """Rounding the coverage to eight bits leaves the edge within a hundredth of a pixel."""
    error = disk_error(16, lambda image: by_area(np.round(image * 255) / 255))
    assert error < 0.01


def test_crisp_pixels_are_cut_on_their_sides():
    """Where no pixel is partly covered, the edge is on the face."""
    image = np.zeros((6, 7))
    image[2:4, 2:5] = 1.0
    assert np.array_equal(coverage_cuts(image, image > 0.5).fraction, np.full(10, 0.5))


def test_blurred_edges_are_told_from_coverage():
    """A blur of one pixel makes edges too wide for area coverage; noise and ringing do not."""
    image = covered(lambda x, y: (x - 20) ** 2 + (y - 20) ** 2 < 200, 40)
    assert is_coverage(image, image > 0.5)
    noisy = image + np.random.default_rng(0).normal(0, 0.02, image.shape)
    assert is_coverage(noisy, noisy > 0.5)
    assert not is_coverage(gaussian_filter(image, 1.0), image > 0.5)
