"""The distance to the boundary: exact at flat sides, second order at curved ones; the limit of small ρ."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.ndimage import distance_transform_edt

import spem
from spem.errors import ParameterError
from spem.fields.boundary_distance import distance_to_boundary, screened_distance
from spem.shapes.shape import Cuts, Shape
from spem.shapes.synthetic import annulus, ball, box, disk, interval


@pytest.mark.parametrize(
    ("shape", "half"),
    [
        (interval(2.0, 0.11, offset=0.3), [1.0]),
        (box((2.0, 3.0), (0.1, 0.07), offset=0.3), [1.0, 1.5]),
        (box((2.0, 1.0, 1.4), 0.09, offset=0.2), [1.0, 0.5, 0.7]),
    ],
)
def test_boxes(shape, half):
    """From flat sides distances are right to a hundredth of a voxel, corners among them."""
    exact = (np.array(half) - np.abs(shape.points)).min(axis=1)
    np.testing.assert_allclose(distance_to_boundary(shape), exact, atol=0.01 * max(shape.spacing))


@pytest.mark.parametrize(
    ("make", "exact"),
    [
        (lambda h: disk(1.0, h, offset=0.31), lambda r: 1 - r),
        (lambda h: disk(1.0, (h, 2 * h), offset=0.31), lambda r: 1 - r),
        (lambda h: annulus(0.3, 1.0, h, offset=0.31), lambda r: np.minimum(1 - r, r - 0.3)),
        (lambda h: ball(1.0, 2 * h, offset=0.31), lambda r: 1 - r),
    ],
)
def test_second_order_on_curved_boundaries(make, exact):
    """The largest error falls with the square of the spacing, on the skeleton too."""
    errors = []
    for h in (0.06, 0.03):
        shape = make(h)
        error = np.abs(distance_to_boundary(shape) - exact(np.linalg.norm(shape.points, axis=1)))
        errors.append((error.mean(), error.max()))
    assert errors[0][0] / errors[1][0] > 3
    assert errors[1][1] < 4 * 0.03**2 * 2


def test_cuts_between_inside_voxels_are_boundary():
    """A wall thinner than a voxel is as near as any other."""
    framed = Shape.from_mask(np.ones((1, 6)))
    left = np.ravel_multi_index((1, 3), framed.mask.shape)
    cuts = Cuts(np.array([left, left + 1]), np.array([3, 2]), np.array([0.25, 0.75]))
    shape = Shape(framed.mask, (1.0, 0.1), framed.origin, cuts=cuts)
    np.testing.assert_allclose(distance_to_boundary(shape)[2:4], [0.025, 0.075])


def test_distance_transform_of_a_mask():
    """Of a bare mask it differs from the transform to outside centres by half a voxel, or little more."""
    mask = np.random.default_rng(0).random((30, 40)) < 0.97
    shape = Shape.from_mask(mask)
    transform = distance_transform_edt(shape.mask).ravel()[shape.voxels]
    assert np.abs(distance_to_boundary(shape) - (transform - 0.5)).max() < 0.75


def test_half_space_is_exact_for_every_rho():
    """Beside a flat side far from others −ρ log v is the distance, but for the grid's share h²/24ρ²."""
    shape = interval(40.0, 0.05)
    for rho in (1.0, 0.5):
        u = screened_distance(spem.field(shape, rho, solver=spem.Direct()), rho)
        distance = distance_to_boundary(shape)
        side = distance < 10
        lacking = (distance - u)[side] / distance[side] / (0.05**2 / 24 / rho**2)
        np.testing.assert_allclose(lacking, 1.0, atol=0.05)


def test_two_sides_add_up():
    """In the middle of an interval it falls short by ρ log 2."""
    shape = interval(2.0, 0.01)
    middle = shape.n_nodes // 2
    u = screened_distance(spem.field(shape, 0.1, solver=spem.Direct()), 0.1)
    assert u[middle] - distance_to_boundary(shape)[middle] == pytest.approx(-0.1 * np.log(2), abs=1e-3)


def test_fields_that_are_no_fields_are_refused():
    """Negative values of an iterative solver, NaN, and ρ without a length; zero is infinitely far."""
    with pytest.raises(ParameterError, match="Direct"):
        screened_distance([0.5, -1e-12], 1.0)
    with pytest.raises(ParameterError, match="NaN"):
        screened_distance([np.nan], 1.0)
    for rho in (0.0, -1.0, np.inf, np.nan):
        with pytest.raises(ParameterError, match="positive, finite"):
            screened_distance([1.0], rho)
    assert screened_distance([0.0], 1.0)[0] == np.inf
    with pytest.raises(ParameterError, match="positive, finite"):
        screened_distance([0.5], [1.0, 2.0])
    with pytest.raises(ParameterError, match="read it first"):
        distance_to_boundary(np.ones((3, 3)))
