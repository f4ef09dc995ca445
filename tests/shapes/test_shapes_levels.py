"""Level functions to shapes."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from spem.errors import ParameterError, ShapeError
from spem.shapes.levels import (
    border_repairs,
    boundary_edges,
    level_shape,
    otsu_level,
    signed_distance_shape,
)


def radii_of_cuts(shape, centre):
    """Distance from a centre to every cut of a shape."""
    place = np.stack(np.unravel_index(shape.cuts.voxel, shape.mask.shape), axis=1).astype(float)
    step = np.where(shape.cuts.direction % 2, 1.0, -1.0) * shape.cuts.fraction
    place[np.arange(len(place)), shape.cuts.direction // 2] += step
    place = np.asarray(shape.origin) + place * shape.spacing
    return np.linalg.norm(place - centre, axis=1)


def ball(radius, shape, spacing):
    """Signed distance to a centred sphere, positive inside, and its centre."""
    spacing = np.broadcast_to(spacing, len(shape))
    centre = (np.array(shape) - 1) * spacing / 2
    index = np.moveaxis(np.indices(shape), 0, -1) * spacing
    return radius - np.linalg.norm(index - centre, axis=-1), centre


@pytest.mark.parametrize("d", [1, 2, 3, 4])
def test_a_plane_is_cut_where_it_lies(d):
    """Linear interpolation of a linear function is exact in any dimension."""
    level = np.indices((6,) * d).sum(axis=0) - 2.7
    shape = level_shape(-level)
    cuts = shape.cuts
    node = np.stack(np.unravel_index(cuts.voxel, shape.mask.shape), axis=1) + np.array(shape.origin)
    real = cuts.direction % 2 == 1
    assert real.any()
    np.testing.assert_allclose((node.sum(axis=1) + cuts.fraction)[real], 2.7, atol=1e-12)


def test_cuts_of_a_ball_converge_at_second_order():
    """Halving the spacing divides the error of the cuts by about four."""
    errors = []
    for n in (16, 32, 64):
        level, centre = ball(1.0, (n, n, n), 2.4 / n)
        errors.append(np.abs(radii_of_cuts(level_shape(level, 2.4 / n), centre) - 1).mean())
    assert np.log2(errors[0] / errors[2]) / 2 > 1.8


def test_anisotropic_spacing_places_cuts():
    """Spacings may differ between axes."""
    level, centre = ball(1.0, (60, 30), (0.05, 0.1))
    shape = level_shape(level, (0.05, 0.1))
    assert abs(radii_of_cuts(shape, centre) - 1).max() < 0.004


@settings(max_examples=30, deadline=None)
@given(hnp.arrays(float, hnp.array_shapes(min_dims=1, max_dims=3, max_side=6), elements=st.floats(-1, 1)))
def test_every_boundary_edge_within_the_array_is_cut_once(level):
    """Inside is where the level is positive, and each edge to an outside value carries one cut."""
    inside = level > 0
    if not inside.any():
        with pytest.raises(ShapeError, match="no voxel centre lies inside"):
            level_shape(level)
        return
    before = level.copy()
    shape = level_shape(level)
    assert shape.n_nodes == inside.sum()
    assert len(shape.cuts) == sum(
        np.abs(np.diff(inside.astype(int), axis=a)).sum() for a in range(level.ndim)
    )
    assert np.array_equal(level, before)


@settings(max_examples=30, deadline=None)
@given(hnp.arrays(bool, hnp.array_shapes(min_dims=1, max_dims=4, max_side=5)))
def test_boundary_edges_join_neighbours_across_the_boundary(inside):
    """Each edge goes from an inside voxel to its outside neighbour in the direction named."""
    for direction, start, end in boundary_edges(inside):
        step = np.zeros(inside.ndim, int)
        step[direction // 2] = 1 if direction % 2 else -1
        ends = np.stack([np.unravel_index(i, inside.shape) for i in (start, end)])
        assert np.array_equal(ends[0] + step[:, None], ends[1])
        assert inside.ravel()[start].all()
        assert not inside.ravel()[end].any()


def test_padding_is_reported():
    """A shape that touches the border of its array is padded, and the report says on which axis."""
    level = np.full((4, 5), -1.0)
    level[1:3, 2:] = 1.0
    shape = level_shape(level)
    assert shape.report.repairs == ("touched the border of the array on axis 1: padded",)
    assert border_repairs(np.zeros((3, 3), bool)) == ()


def test_signed_distance_takes_either_sign():
    """The same shape comes of a distance of either sign; the wrong sign is explained."""
    level, _ = ball(4.3, (12, 12), 1.0)
    one, other = signed_distance_shape(-level), signed_distance_shape(level, inside="positive")
    assert np.array_equal(one.mask, other.mask)
    assert np.array_equal(one.cuts.fraction, other.cuts.fraction)
    with pytest.raises(ShapeError, match=r"nowhere negative, .*; if it is positive inside, say 'positive'"):
        signed_distance_shape(np.ones((3, 3)))
    with pytest.raises(ParameterError, match="distance 'in' inside: expected 'negative' or 'positive'"):
        signed_distance_shape(level, inside="in")


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
def test_values_that_are_not_finite_are_counted_and_placed(bad):
    """NaN and infinities are refused, with their number and the first place."""
    level = np.ones((3, 4))
    level[1, 2] = level[2, 3] = bad
    with pytest.raises(ShapeError, match=r"2 of 12 values are NaN or infinite, the first at \[1, 2\]"):
        level_shape(level)
    with pytest.raises(ShapeError, match=r"the first at \[1, 2\]"):
        signed_distance_shape(level)


def test_large_finite_values_are_not_taken_for_infinite():
    """A sum that overflows is no infinite value."""
    assert level_shape(np.full((3, 3), 1e308)).n_nodes == 9


def test_otsu_agrees_with_the_reference_on_two_peaks():
    """The level differs from scikit-image's by less than two bins."""
    from skimage.filters import threshold_otsu

    rng = np.random.default_rng(0)
    values = np.concatenate([rng.normal(20, 4, 4000), rng.normal(60, 9, 2000)])
    assert abs(otsu_level(values) - threshold_otsu(values)) < 2 * np.ptp(values) / 256


@pytest.mark.parametrize("kind", ["f2", "f4", "f8", "u1", "i8"])
def test_otsu_takes_every_kind_of_number(kind):
    """Two peaks are parted between them in any precision."""
    values = np.array([0, 1, 2, 98, 99, 100], kind)
    assert 2 <= otsu_level(values) < 98


@pytest.mark.parametrize(
    ("low", "high", "kind"),
    [
        (-1.7e308, 1.7e308, "f8"),
        (-3e38, 3e38, "f4"),
        (0, 5e-324, "f8"),
        (1, 1 + 2**-52, "f8"),
        (1, 1 + 2**-23, "f4"),
    ],
)
def test_otsu_parts_any_two_numbers(low, high, kind):
    """Huge, denormal and adjacent numbers have a level with one of them above it."""
    values = np.array([low, low, high], kind)
    assert (values > otsu_level(values)).tolist() == [False, False, True]


def test_masked_levels_are_refused():
    """A level function and a signed distance have a value everywhere."""
    values = np.ma.masked_greater([-1.0, 1.0, 2.0], 1.5)
    for make in (level_shape, signed_distance_shape):
        with pytest.raises(ShapeError, match=r"shape: 1 of 3 values are masked, the first at \[2\]"):
            make(values)


def test_huge_levels_are_cut_where_they_are_zero():
    """The difference of two levels may be beyond the largest number."""
    assert level_shape([-1.5e308, 0.5e308, -0.5e308]).cuts.fraction == pytest.approx([0.25, 0.5])
