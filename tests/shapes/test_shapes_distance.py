"""The signed distance of a shape."""

from __future__ import annotations

import numpy as np
import pytest

from spem.shapes.distance import signed_distance
from spem.shapes.levels import level_shape
from spem.shapes.shape import Shape


def ball(radius, shape, spacing):
    """Signed distance to a centred sphere on a grid."""
    spacing = np.broadcast_to(spacing, len(shape))
    centre = (np.array(shape) - 1) * spacing / 2
    return radius - np.linalg.norm(np.moveaxis(np.indices(shape), 0, -1) * spacing - centre, axis=-1)


@pytest.mark.parametrize(
    ("shape", "spacing"), [((44, 44), 1.0), ((88, 44), (0.5, 1.0)), ((44, 44, 44), 1.0), ((44,), 1.0)]
)
def test_distance_of_a_ball_is_found_within_a_fraction_of_a_voxel(shape, spacing):
    """Beside the surface to some hundredths of a voxel, at the deepest voxel to a tenth."""
    exact = ball(18.3, shape, spacing)
    made = level_shape(exact, spacing)
    found = signed_distance(made)
    low = np.round((np.array(made.origin)) / np.broadcast_to(spacing, len(shape))).astype(int)
    there = exact[tuple(slice(a, a + n) for a, n in zip(low, found.shape, strict=True))]
    near = np.abs(there) < 1
    error = np.abs(found - there)[near]
    assert np.sqrt(np.mean(error**2)) < 0.03
    assert error.max() < 0.15
    assert found.max() == pytest.approx(there.max(), abs=0.1)
    assert np.abs(found - there)[made.mask].max() < 0.5
    assert np.array_equal(found > 0, made.mask)


def test_a_slanted_plane_is_exact():
    """The distance to a plane is the plane's, near it."""
    n = np.array([0.8, 0.6])
    level = 14.2 - np.moveaxis(np.indices((30, 30)), 0, -1) @ n
    made = level_shape(level)
    found = signed_distance(made)[6:-1, 6:-1]
    index = np.moveaxis(np.indices(made.mask.shape), 0, -1) + np.array(made.origin)
    there = (14.2 - index @ n)[6:-1, 6:-1]
    near = (np.abs(there) < 1) & (index[6:-1, 6:-1].min(axis=-1) > 4)
    assert near.sum() > 10
    assert np.abs(found - there)[near].max() < 0.06


def test_faces_of_plain_masks_are_half_a_voxel_away():
    """Without cuts the surface lies on the faces."""
    assert signed_distance(Shape.from_mask(np.ones(4), 2.0)).tolist() == [-1, 1, 3, 3, 1, -1]
