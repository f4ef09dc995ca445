"""Fields against closed forms: size of the error and observed order."""

from __future__ import annotations

import numpy as np
import pytest

import spem
from spem.shapes.closed_forms import ball_field, interval_field, shell_field
from spem.shapes.synthetic import annulus, ball, disk, interval, n_ball, shell

OFFSET = 0.3137  # the grid sits at no lucky place

CASES = {
    "interval": (lambda h: interval(2.0, h, offset=OFFSET), lambda x, r: interval_field(x, 2.0, r), 0.1),
    "disk": (lambda h: disk(1.0, h, offset=OFFSET), lambda x, r: ball_field(x, 1.0, r), 0.1),
    "annulus": (
        lambda h: annulus(0.4, 1.0, h, offset=OFFSET),
        lambda x, r: shell_field(x, 0.4, 1.0, r),
        0.06,
    ),
    "ball": (lambda h: ball(1.0, h, offset=OFFSET), lambda x, r: ball_field(x, 1.0, r), 0.16),
    "shell": (lambda h: shell(0.5, 1.0, h, offset=OFFSET), lambda x, r: shell_field(x, 0.5, 1.0, r), 0.1),
    "4-ball": (lambda h: n_ball(1.0, h, 4, offset=OFFSET), lambda x, r: ball_field(x, 1.0, r), 0.25),
}


def _mean_error(make, exact, spacing, boundary="surface"):
    shape = make(spacing)
    v = spem.field(shape, 0.3, boundary=boundary)
    return np.abs(v - exact(shape.points, 0.3)).mean()


@pytest.mark.parametrize("case", CASES)
def test_surface_boundary_is_second_order(case):
    """Dividing the spacing by four divides the mean error by nearly sixteen."""
    make, exact, h = CASES[case]
    coarse, fine = (_mean_error(make, exact, s) for s in (h, h / (4 if case != "4-ball" else 2)))
    order = np.log(coarse / fine) / np.log(4 if case != "4-ball" else 2)
    assert coarse < 0.02
    assert order > 1.75


def test_voxel_boundary_is_first_order():
    """The paper's boundary, at voxel centres, converges no faster than the spacing."""
    make, exact, h = CASES["disk"]
    errors = [_mean_error(make, exact, s, "voxel") for s in (h / 2, h / 8)]
    assert 0.7 < np.log(errors[0] / errors[1]) / np.log(4) < 1.3
    assert errors[1] > 5 * _mean_error(make, exact, h / 8)


def test_anisotropic_spacing_is_in_the_stencil():
    """A disk on a grid of flat voxels has the field of the disk."""
    shape = disk(1.0, (0.05, 0.02))
    error = np.abs(spem.field(shape, 0.3) - ball_field(shape.points, 1.0, 0.3))
    assert error.max() < 5e-3


def test_one_dimension_is_exact_for_the_discrete_equation():
    """On an interval cut anywhere, an infinite ρ gives one and the field is even."""
    shape = interval(3.0, 0.25)
    v = spem.field(shape, [0.5, np.inf])
    assert np.array_equal(v[:, 1], np.ones(shape.n_nodes))
    assert np.allclose(v[:, 0], v[::-1, 0], atol=1e-9)
