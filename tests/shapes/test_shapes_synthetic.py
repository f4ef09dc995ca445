"""Shapes with known answers, and the engine that cuts the grid."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from spem.errors import ParameterError, ShapeError, SizeError
from spem.shapes import synthetic
from spem.shapes.shape import Shape


def cut_points(shape: Shape) -> np.ndarray:
    """Return the coordinates of all cuts."""
    cuts = shape.cuts
    index = np.stack(np.unravel_index(cuts.voxel, shape.mask.shape), axis=1).astype(float)
    axis = cuts.direction // 2
    index[np.arange(len(cuts)), axis] += np.where(cuts.direction % 2, 1, -1) * cuts.fraction
    return np.asarray(shape.origin) + index * np.asarray(shape.spacing)


def boundary_edges(shape: Shape) -> int:
    """Count the edges from inside to outside."""
    return sum(int((np.diff(shape.mask.astype(np.int8), axis=a) != 0).sum()) for a in range(shape.ndim))


@pytest.mark.parametrize("ndim", [1, 2, 3, 4])
def test_ball_is_cut_on_its_sphere(ndim):
    """Every boundary edge of a ball is cut, at the radius to rounding."""
    shape = synthetic.n_ball(1.0, 0.23, ndim, offset=0.37)
    assert len(shape.cuts) == boundary_edges(shape)
    np.testing.assert_allclose(np.linalg.norm(cut_points(shape), axis=1), 1.0, atol=1e-11)


def test_interval_has_its_length_between_cuts():
    """The two cuts of an interval are its ends."""
    shape = synthetic.interval(1.3, 0.11, offset=0.2)
    np.testing.assert_allclose(cut_points(shape).ravel(), [-0.65, 0.65], atol=1e-12)


def test_box_is_cut_on_its_faces():
    """Each cut of a box lies on the face that its direction points to."""
    shape = synthetic.box((1.0, 1.5, 0.7), (0.1, 0.2, 0.13), offset=(0.1, 0.6, 0.9))
    axis, up = shape.cuts.direction // 2, shape.cuts.direction % 2
    half = np.array([0.5, 0.75, 0.35])[axis] * np.where(up, 1, -1)
    np.testing.assert_allclose(cut_points(shape)[np.arange(axis.size), axis], half, atol=1e-12)


@pytest.mark.parametrize(("make", "ndim"), [(synthetic.annulus, 2), (synthetic.shell, 3)])
def test_hollow_shapes_are_cut_on_both_spheres(make, ndim):
    """A ring and a shell are cut on the inner and on the outer sphere and nowhere else."""
    shape = make(0.5, 1.0, 0.09, offset=0.5)
    r = np.linalg.norm(cut_points(shape), axis=1)
    assert shape.ndim == ndim
    assert len(shape.cuts) == boundary_edges(shape)
    np.testing.assert_allclose(np.minimum(np.abs(r - 0.5), np.abs(r - 1)), 0, atol=1e-11)
    assert (r < 0.75).any()
    assert (r > 0.75).any()


def star_outline(n: int, skip: int, radius: float) -> np.ndarray:
    """Return the outline's vertices: tips and, between them, where neighbouring sides cross."""
    tips = radius * np.exp(2j * np.pi * np.arange(n) / n)
    a, b = tips[0], tips[skip]
    c, d = tips[1], tips[(1 - skip) % n]
    t = np.linalg.solve(
        [[(b - a).real, -(d - c).real], [(b - a).imag, -(d - c).imag]], [(c - a).real, (c - a).imag]
    )
    notch = a + t[0] * (b - a)
    notches = notch * np.exp(2j * np.pi * np.arange(n) / n)
    corners = np.stack([tips, notches], axis=1).ravel()
    return np.stack([-corners.real, corners.imag], axis=1)


@pytest.mark.parametrize("n", range(9, 21))
def test_star_polygon_is_cut_on_its_outline(n):
    """Cuts of a star polygon lie on the outline of its sides, and its area is that of the polygon."""
    shape = synthetic.star_polygon(n, spacing=0.02, offset=(0.3, 0.8))
    outline = star_outline(n, 4, 1.0)
    ends = np.roll(outline, -1, axis=0)
    along = ends - outline
    to = cut_points(shape)[:, None] - outline
    t = np.clip((to * along).sum(2) / (along**2).sum(1), 0, 1)
    distance = np.linalg.norm(to - t[..., None] * along, axis=2).min(axis=1)
    assert distance.max() < 1e-11
    area = 0.5 * abs(np.sum(outline[:, 0] * ends[:, 1] - outline[:, 1] * ends[:, 0]))
    assert shape.volume == pytest.approx(area, rel=0.02)


def test_convex_star_is_a_regular_polygon():
    """With a skip of one the star is the convex polygon, a square for four vertices."""
    shape = synthetic.star_polygon(4, 1, np.sqrt(2), 0.05, offset=0.5)
    assert np.abs(cut_points(shape)).sum(axis=1) == pytest.approx(np.sqrt(2), abs=1e-11)


def test_offset_moves_the_grid_and_not_the_shape():
    """A shift by whole edges changes nothing; any shift keeps the centroid."""
    whole, none = synthetic.disk(1.0, 0.1, offset=3.0), synthetic.disk(1.0, 0.1)
    np.testing.assert_array_equal(whole.mask, none.mask)
    shifted = synthetic.disk(1.0, 0.02, offset=(0.25, 0.6))
    assert np.abs(shifted.points.mean(axis=0)).max() < 2e-3


@settings(max_examples=30, deadline=None)
@given(
    radius=st.floats(0.3, 3),
    spacing=st.floats(0.05, 0.25),
    ndim=st.integers(1, 3),
    offset=st.floats(0, 0.999),
)
def test_volume_converges_to_that_of_the_ball(radius, spacing, ndim, offset):
    """Inside voxels lie in the ball, and their volume is that of the ball to the order of the spacing."""
    shape = synthetic.n_ball(radius, spacing * radius, ndim, offset=offset)
    exact = [2 * radius, np.pi * radius**2, 4 / 3 * np.pi * radius**3][ndim - 1]
    assert np.linalg.norm(shape.points, axis=1).max() < radius
    assert abs(shape.volume / exact - 1) < 2 * spacing


def test_a_kinked_level_is_still_cut_exactly():
    """Root finding survives a level function that is far from linear."""
    shape = synthetic.implicit_shape(
        lambda x: np.maximum(0.3 - np.abs(x[:, 0]), -1e-3) ** 3, (-1.0,), (1.0,), 0.2, offset=0.1
    )
    np.testing.assert_allclose(cut_points(shape).ravel(), [-0.3, 0.3], atol=1e-11)


def test_a_zero_on_an_outside_centre_is_a_whole_edge():
    """Where the level is zero at a voxel centre, that voxel is outside and the fraction is one."""
    shape = synthetic.box((1.0, 1.0), 0.25)
    assert shape.n_nodes == 9
    assert (shape.cuts.fraction == 1.0).all()


def test_centres_on_the_surface_are_outside_on_every_side():
    """Rounding does not make one end of a symmetric shape inside and the other outside."""
    for radius in (1.0, 2.5703125, 0.7):
        shape = synthetic.n_ball(radius, 0.05 * radius, 1)
        assert shape.n_nodes == 39
        np.testing.assert_allclose(shape.cuts.fraction, 1.0)


def test_bad_sizes_are_refused():
    """Sizes, spacings and vertex counts out of range are refused by name."""
    with pytest.raises(ParameterError, match="disk: radius must be positive"):
        synthetic.disk(-1.0, 0.1)
    with pytest.raises(ParameterError, match="annulus: thickness must be positive"):
        synthetic.annulus(1.0, 0.5, 0.1)
    with pytest.raises(ParameterError, match="n must be above 2"):
        synthetic.star_polygon(8)
    with pytest.raises(ParameterError, match="spacing=0: expected one positive number"):
        synthetic.ball(1.0, 0)
    with pytest.raises(SizeError, match=r"ball: .* cells need .* the limit is"):
        synthetic.ball(1.0, 1e-4)
    with pytest.raises(ShapeError, match="no voxel centre lies inside"):
        synthetic.interval(0.1, 1.0, offset=0.5)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: synthetic.box((), 0.1), r"box: lengths=\(\): expected one side length per axis"),
        (lambda: synthetic.box(((1, 2), (3, 4)), 0.1), r"box: lengths=.*: expected one side length per axis"),
        (
            lambda: synthetic.disk(5, 1, offset=float("nan")),
            r"disk: offset=nan: expected one finite number, or 2",
        ),
        (lambda: synthetic.disk(5, 1, offset=(0, 0, 0)), r"disk: offset=\(0, 0, 0\): expected one finite"),
        (lambda: synthetic.disk(5, 1, offset="far"), r"disk: offset=far: expected one finite number"),
        (lambda: synthetic.disk("wide", 1), r"disk: radius must be positive and finite, not wide"),
        (lambda: synthetic.n_ball(1, 0.1, 2.5), r"2.5-ball: ndim must be a whole number, not 2.5"),
        (lambda: synthetic.star_polygon(9.5), r"star 9.5/4: n must be a whole number, not 9.5"),
        (lambda: synthetic.implicit_shape(len, (), (), 0.1), r"shape: the box from \[\] to \[\] is empty"),
    ],
)
def test_arguments_out_of_range_are_refused_by_name(make, message):
    """What NumPy would trip over is named in one line."""
    with pytest.raises(ParameterError, match=message):
        make()
