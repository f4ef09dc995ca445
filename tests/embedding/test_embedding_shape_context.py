"""Shape contexts: symmetries of circle and square, and what leaves them as they are."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from spem.embedding.shape_context import inner_distance_shape_context, shape_context
from spem.errors import ParameterError, ShapeError
from spem.shapes.creatures import creature
from spem.shapes.shape import Shape
from spem.shapes.synthetic import ball, disk

BOTH = pytest.mark.parametrize("context", [shape_context, inner_distance_shape_context])


@pytest.fixture(scope="module")
def hand():
    """Return a silhouette with limbs, without symmetry."""
    return creature("hand", ndim=2, voxels=3000, rng=np.random.default_rng(3))


def test_a_circle_looks_the_same_from_each_of_its_points():
    """All points of a disk have the histogram of chords 2 sin(t/2) at angle t/2, to the error of pixels."""
    seen = shape_context(disk(1.0, 0.01), 96, n_radii=4, n_angles=8)
    assert np.ptp(seen, axis=0).max() < 0.015
    halves = seen.mean(axis=0).reshape(4, 8).sum(axis=0)
    # uniform in angle from 0 to π: whole bins between, halves at the ends, nothing on the other side
    np.testing.assert_allclose(halves, np.array([1, 2, 2, 2, 1, 0, 0, 0]) / 8, atol=0.01)


def test_distances_on_a_circle_are_those_of_chords():
    """Shares of distance on a circle follow the law of chords, in units of their mean 4/π."""
    seen = shape_context(disk(1.0, 0.01), 96, n_radii=5, n_angles=1).mean(axis=0)
    t = np.pi * (np.arange(1, 96) / 96)
    chord = 2 * np.sin(t) / np.mean(2 * np.sin(t))
    place = np.clip(5 * np.log(chord / 0.125) / np.log(16) - 0.5, 0, 4)
    weight = np.maximum(0, 1 - np.abs(place[:, None] - np.arange(5)))
    np.testing.assert_allclose(seen, weight.mean(axis=0), atol=0.005)


@BOTH
def test_a_square_has_four_equal_sides(context):
    """Points a quarter of the way round a square have equal histograms."""
    seen = context(Shape.from_mask(np.ones((30, 30))), 64)
    np.testing.assert_allclose(seen, np.roll(seen, 16, axis=0), atol=0.03)


@given(st.floats(0.1, 10), st.floats(-5, 5), st.integers(6, 20), st.integers(6, 20))
@settings(max_examples=10, deadline=None)
def test_both_are_equal_in_convex_shapes(spacing, origin, rows, columns):
    """In a box of any size the way is straight, and scale and place do not matter."""
    box = Shape.from_mask(np.ones((rows, columns)), spacing, origin=(origin, -origin))
    seen = shape_context(box, 40)
    np.testing.assert_allclose(inner_distance_shape_context(box, 40), seen, atol=1e-6)
    plain = Shape.from_mask(np.ones((rows, columns)))
    np.testing.assert_allclose(shape_context(plain, 40), seen, atol=1e-6)


@BOTH
def test_moved_and_scaled_shapes_look_alike(context, hand):
    """Translation and scale leave every histogram as it is."""
    moved = replace(hand, spacing=tuple(3 * h for h in hand.spacing), origin=(7.0, -2.0))
    np.testing.assert_allclose(context(moved, 80), context(hand, 80), atol=1e-9)


@BOTH
def test_a_quarter_turn_keeps_histograms_about_the_tangent(context, hand):
    """Turned by 90 degrees a shape has the same mean histogram about tangents; about an axis they shift."""
    turned = Shape.from_mask(np.rot90(hand.mask), hand.spacing)
    plain = Shape.from_mask(hand.mask, hand.spacing)
    np.testing.assert_allclose(context(turned).mean(axis=0), context(plain).mean(axis=0), atol=2e-3)
    fixed, shifted = (context(s, frame="fixed").mean(axis=0).reshape(8, 8) for s in (plain, turned))
    np.testing.assert_allclose(np.roll(fixed, 2, axis=1), shifted, atol=2e-3)
    assert np.abs(fixed - shifted).max() > 5e-3


@BOTH
def test_a_mirrored_shape_has_directions_in_reverse_order(context, hand):
    """With eight bins direction 0 along the tangent becomes direction 4, and so on round the normal."""
    plain = Shape.from_mask(hand.mask, hand.spacing)
    mirrored = Shape.from_mask(hand.mask[::-1], hand.spacing)
    seen, reverse = (context(s).mean(axis=0).reshape(8, 8) for s in (plain, mirrored))
    np.testing.assert_allclose(seen[:, (4 - np.arange(8)) % 8], reverse, atol=2e-3)


def test_bent_arms_change_inner_distances_less():
    """Bending an L open changes inner-distance contexts less than straight ones."""
    arm = np.zeros((60, 60))
    arm[:, :8], arm[-8:, :] = 1, 1
    bent, straight = Shape.from_mask(arm), Shape.from_mask(np.ones((112, 8)))
    change = [
        np.abs(context(bent, 100).mean(axis=0) - context(straight, 100).mean(axis=0)).sum()
        for context in (inner_distance_shape_context, shape_context)
    ]
    assert change[0] < 0.7 * change[1]


@BOTH
def test_shares_add_up_to_one(context, hand):
    """Every point counts every other once, with any number of bins."""
    for n_radii, n_angles in ((1, 1), (3, 7), (5, 12)):
        seen = context(hand, 50, n_radii=n_radii, n_angles=n_angles)
        assert seen.shape == (50, n_radii * n_angles)
        assert seen.min() >= 0
        np.testing.assert_allclose(seen.sum(axis=1), 1)


@BOTH
def test_bad_bins_frames_and_solids_are_refused(context):
    """Bins below one, unknown frames and shapes that are no silhouettes are named."""
    shape = disk(1.0, 0.1)
    with pytest.raises(ParameterError, match="at least one bin"):
        context(shape, n_radii=0)
    with pytest.raises(ParameterError, match="frame='up'"):
        context(shape, frame="up")
    with pytest.raises(ShapeError, match="3-D shape has no contours"):
        context(ball(1.0, 0.5))
