"""Curvature of level curves and surfaces, and turning of traced curves."""

from __future__ import annotations

import numpy as np
import pytest

from spem.errors import ParameterError
from spem.fields.isocontours import iso_contours
from spem.fields.level_curves import level_curvature, turning_angles
from spem.fields.operator import assemble
from spem.shapes.closed_forms import ball_field
from spem.shapes.synthetic import disk, n_ball


@pytest.mark.parametrize(("ndim", "spacing"), [(2, 0.05), (3, 0.08)])
@pytest.mark.parametrize("logarithm", [False, True])
def test_spheres_have_the_sum_of_their_curvatures(ndim, spacing, logarithm):
    """On the field of a ball it is (d − 1)/r, of second order inside, and of v and log v alike."""
    errors = []
    for h in (spacing, spacing / 2):
        shape = n_ball(1.0, h, ndim, offset=0.31)
        v = ball_field(shape.points, 1.0, 0.3)
        values, boundary = (np.log(v), 0.0) if logarithm else (v, 1.0)
        curvature = level_curvature(assemble(shape), values, boundary=boundary)
        r = np.linalg.norm(shape.points, axis=1)
        inside = (r > 0.3) & (r < 0.75)
        errors.append(np.abs(curvature - (ndim - 1) / r)[inside].max())
        beside = r > 1 - h
        assert np.abs(curvature - (ndim - 1) / r)[beside].max() < 6 * h
    assert errors[0] / errors[1] == pytest.approx(4, abs=1)


def test_sign_and_scale():
    """A field that falls outward has the opposite sign; growing functions of a field change nothing."""
    shape = disk(1.0, 0.05, offset=0.2)
    system = assemble(shape)
    squared = (shape.points**2).sum(axis=1)
    up = level_curvature(system, squared, boundary=1.0)
    np.testing.assert_allclose(level_curvature(system, 5 - 3 * squared, boundary=2.0), -up, rtol=1e-9)
    np.testing.assert_array_equal(level_curvature(shape, squared, boundary=1.0), up)


def test_what_is_no_shape_is_refused():
    """A mask has no boundary yet."""
    with pytest.raises(ParameterError, match="expected Shape, got ndarray; read it first"):
        level_curvature(np.ones((3, 3)), np.ones(9))


def test_unknown_boundaries_and_flat_fields_have_none():
    """NaN beside a boundary of unknown value, and where the gradient vanishes."""
    shape = disk(1.0, 0.1)
    system = assemble(shape)
    unknown = level_curvature(system, shape.points[:, 0])
    beside = (system.domain.neighbours == shape.n_nodes).any(axis=1)
    assert (np.isnan(unknown) == beside).all()
    np.testing.assert_allclose(unknown[~beside], 0.0, atol=1e-9)
    assert np.isnan(level_curvature(system, np.ones(shape.n_nodes), boundary=1.0)).all()


def test_circles_turn_once():
    """A traced circle turns by 2π in all, evenly; the other way round, by −2π."""
    shape = disk(1.0, 0.02)
    (line,) = iso_contours(shape, np.linalg.norm(shape.points, axis=1), [0.6])[0]
    angles = turning_angles(line, 0.1)
    assert abs(angles.sum()) == pytest.approx(2 * np.pi)
    np.testing.assert_allclose(np.abs(angles), 0.1 / 0.6, rtol=0.15)
    np.testing.assert_allclose(turning_angles(line[::-1], 0.1).sum(), -angles.sum())


def test_notches_turn_both_ways():
    """A plus sign turns twelve times by a right angle: 6π in all, 2π with signs."""
    arm = np.array(
        [[1, 0], [2, 0], [2, 1], [3, 1], [3, 2], [2, 2], [2, 3], [1, 3], [1, 2], [0, 2], [0, 1], [1, 1]]
    )
    angles = turning_angles([*arm, arm[0]], 0.5)
    assert np.abs(angles).sum() == pytest.approx(6 * np.pi)
    assert angles.sum() == pytest.approx(2 * np.pi)


@pytest.mark.parametrize(
    ("line", "step", "match"),
    [
        ([[0, 0], [1, 0], [1, 1]], 0.1, "close it"),
        ([[0, 0, 0], [0, 0, 0]], 0.1, "close it"),
        ([[0, 0], [1, 0], [0, 1], [0, 0]], 2.0, "at most a third"),
        ([[0, 0], [1, 0], [0, 1], [0, 0]], 0.0, "positive step"),
    ],
)
def test_open_and_short_curves_are_refused(line, step, match):
    """Curves that are not closed, not plane, or shorter than three steps."""
    with pytest.raises(ParameterError, match=match):
        turning_angles(line, step)
