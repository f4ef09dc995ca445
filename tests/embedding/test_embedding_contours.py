"""Points along contours: evenly spaced, on the boundary, with the shape on the left."""

from __future__ import annotations

import numpy as np
import pytest

from spem.embedding.contours import contour_points
from spem.errors import ParameterError, ShapeError
from spem.shapes.shape import Shape
from spem.shapes.synthetic import annulus, ball, disk


@pytest.mark.parametrize("boundary", ["surface", "voxel"])
def test_points_of_a_disk_lie_on_its_circle(boundary):
    """On a disk points are as far from the centre as the boundary model says, and tangents turn left."""
    points = contour_points(disk(1.0, 0.02), 64, boundary=boundary)
    radius = np.linalg.norm(points.position, axis=1)
    outward = points.position / radius[:, None]
    assert np.abs(radius - 1.0).max() < (1e-2 if boundary == "surface" else 0.03)
    np.testing.assert_allclose(np.einsum("ij,ij->i", outward, points.tangent), 0, atol=0.05)
    assert (outward[:, 0] * points.tangent[:, 1] - outward[:, 1] * points.tangent[:, 0]).min() > 0.99


def test_points_are_evenly_spaced():
    """Steps from point to point along a contour are equal to a few hundredths."""
    points = contour_points(disk(1.0, 0.02), 100)
    steps = np.linalg.norm(points.position[points.onward] - points.position, axis=1)
    np.testing.assert_allclose(steps, 2 * np.pi / 100, rtol=0.05)


def test_contours_share_points_by_length():
    """A ring of radii 1 and 2 has a third of its points on the hole, the shape on their left too."""
    points = contour_points(annulus(1.0, 2.0, 0.04), 120)
    assert np.bincount(points.contour).tolist() == pytest.approx([80, 40], abs=2)
    hole = points.contour == 1
    x, tangent = points.position[hole], points.tangent[hole]
    assert (x[:, 0] * tangent[:, 1] - x[:, 1] * tangent[:, 0]).max() < 0
    assert points.onward[hole].max() == 119
    assert contour_points(annulus(1.0, 2.0, 0.04), 120, holes=False).contour.max() == 0


def test_a_hole_too_short_for_a_polygon_is_left_out():
    """A pixel missing from a large square changes the number of contours only where points suffice."""
    mask = np.ones((40, 40))
    mask[20, 20] = 0
    assert np.unique(contour_points(Shape.from_mask(mask), 40).contour).tolist() == [0]
    assert contour_points(Shape.from_mask(mask), 40).contour.size == 40


@pytest.mark.parametrize("spacing", [0.05, (0.05, 0.03)])
def test_smoothing_takes_the_steps_of_the_grid_out(spacing):
    """Tangents of a disk known as pixels alone follow the circle, on anisotropic grids too."""
    plain = Shape.from_mask(disk(1.0, spacing).mask, spacing)
    for smoothing, most in ((0.0, np.inf), (1.5, 0.12)):
        points = contour_points(plain, 40, smoothing=smoothing)
        outward = points.position - points.position.mean(axis=0)
        slope = np.einsum("ij,ij->i", outward, points.tangent)
        assert np.abs(slope).max() < most
    assert np.abs(slope).max() > 0


def test_the_smallest_shape_has_points():
    """One pixel has a contour like any other shape."""
    points = contour_points(Shape.from_mask(np.ones((1, 1))), 12)
    assert np.isfinite(points.position).all()
    np.testing.assert_allclose(np.linalg.norm(points.tangent, axis=1), 1)


def test_only_silhouettes_have_contours():
    """A solid is refused, and so are two points and smoothing that is no length."""
    with pytest.raises(ShapeError, match="3-D shape has no contours"):
        contour_points(ball(1.0, 0.5))
    for bad in ({"n_points": 2}, {"smoothing": -1.0}, {"smoothing": np.inf}):
        with pytest.raises(ParameterError, match="3 or more, and 0 or more"):
            contour_points(disk(1.0, 0.1), **bad)
    with pytest.raises(ParameterError, match="read it first"):
        contour_points(np.ones((3, 3)))
