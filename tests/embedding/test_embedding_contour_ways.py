"""Shortest ways between contour points: exact in polygons, with holes too."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from spem.embedding.contour_ways import contour_ways
from spem.embedding.contours import ContourPoints, contour_points
from spem.fields.geodesics import inner_distances
from spem.shapes.creatures import creature
from spem.shapes.shape import Shape


def _polygon(*rings):
    """Return the corners of rings as points; tangents do not matter."""
    corners = np.concatenate([np.asarray(ring, float) for ring in rings])
    contour = np.repeat(np.arange(len(rings), dtype=np.int32), [len(ring) for ring in rings])
    return ContourPoints(corners, np.zeros_like(corners), contour)


U = [(0, 0), (3, 0), (3, 3), (2, 3), (2, 1), (1, 1), (1, 3), (0, 3)]


def test_ways_in_a_u_bend_at_its_inner_corners():
    """From tip to tip of a U the way goes round two corners; where it starts it goes to the first."""
    distance, first = contour_ways(_polygon(U))
    assert distance[6, 3] == pytest.approx(2 + 1 + 2)
    assert distance[7, 2] == pytest.approx(2 * np.hypot(1, 2) + 1)
    assert first[7, 2] == 5
    assert first[2, 7] == 4
    assert distance[0, 2] == pytest.approx(np.hypot(2, 1) + np.hypot(1, 2))
    assert first[0, 1] == 1


def test_a_hole_stands_in_the_way():
    """Across a square with a square hole the way goes round a corner of the hole."""
    points = _polygon([(0, 0), (4, 0), (4, 4), (0, 4)], [(1, 1), (1, 3), (3, 3), (3, 1)])
    distance, _ = contour_ways(points)
    assert distance[0, 2] == pytest.approx(2 * np.hypot(1, 3))
    assert distance[0, 4] == pytest.approx(np.sqrt(2))
    assert distance[4, 6] == pytest.approx(4)


def test_separate_pieces_have_no_way():
    """Between two squares apart the distance is infinite."""
    square = np.array([(0, 0), (1, 0), (1, 1), (0, 1)])
    distance, first = contour_ways(_polygon(square, square + 5))
    assert np.isinf(distance[:4, 4:]).all()
    assert (first[:4, 4:] == -1).all()
    np.testing.assert_allclose(distance[:4, :4], distance[4:, 4:])


@given(st.integers(5, 40), st.integers(0, 99))
@settings(max_examples=15, deadline=None)
def test_ways_are_straight_in_convex_polygons(n, seed):
    """Among corners of a convex polygon, and points on its sides, every way is straight."""
    rng = np.random.default_rng(seed)
    angle = np.sort(rng.random(n)) * 2 * np.pi
    corners = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    if np.diff(angle, append=angle[0] + 2 * np.pi).min() < 1e-3:
        return
    middle = (corners + np.roll(corners, -1, axis=0)) / 2
    ring = np.stack([corners, middle], axis=1).reshape(-1, 2)
    distance, _ = contour_ways(_polygon(ring))
    straight = np.linalg.norm(ring[:, None] - ring[None], axis=2)
    np.testing.assert_allclose(distance, straight, atol=1e-12)


@given(st.integers(0, 99))
@settings(max_examples=5, deadline=None)
def test_distances_are_a_metric_not_below_the_straight_one(seed):
    """In a silhouette with limbs distances are symmetric, at least straight, and keep the triangle."""
    hand = creature("hand", ndim=2, voxels=1500, rng=np.random.default_rng(seed))
    points = contour_points(hand, 80)
    distance, first = contour_ways(points)
    straight = np.linalg.norm(points.position[:, None] - points.position[None], axis=2)
    assert (distance >= straight - 1e-12).all()
    np.testing.assert_allclose(distance, distance.T, rtol=1e-12)
    assert (distance[:, None] <= distance[:, :, None] + distance[None] + 1e-9).all()
    rows = np.arange(80)[:, None]
    np.testing.assert_allclose(distance, straight[rows, first] + distance[first, rows.T], rtol=1e-9)


def test_polygons_agree_with_the_grid():
    """In an L of pixels distances are those of the marching on nodes, to the size of a pixel."""
    mask = np.zeros((40, 40))
    mask[:, :12], mask[28:, :] = 1, 1
    shape = Shape.from_mask(mask)
    points = contour_points(shape, 80)
    ends = [int(np.argmin(points.position @ side)) for side in ((1.0, 1.0), (-1.0, -1.0))]
    nearest = [int(np.linalg.norm(shape.points - points.position[end], axis=1).argmin()) for end in ends]
    marched = inner_distances(shape, nearest[0])[0, nearest[1]]
    assert contour_ways(points)[0][ends[0], ends[1]] == pytest.approx(marched, abs=3)
