"""Faces of a boundary: neighbours across ridges, contours, areas."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from spem.fields.boundary.contours import face_areas, face_neighbours, trace_contours
from spem.fields.domain import surface_domain, voxel_domain
from spem.shapes.shape import Cuts, Shape
from spem.shapes.synthetic import annulus, ball, disk, n_ball

MASKS = hnp.arrays(bool, hnp.array_shapes(min_dims=2, max_dims=4, min_side=1, max_side=5)).filter(np.any)
PLANES = hnp.arrays(bool, hnp.array_shapes(min_dims=2, max_dims=2, min_side=1, max_side=9)).filter(np.any)


def _cracked(mask: np.ndarray, seed: int) -> Shape:
    """Return a shape with surfaces between some neighbouring inside voxels."""
    rng = np.random.default_rng(seed)
    shape = Shape.from_mask(mask)
    domain = voxel_domain(shape)
    node, direction = np.nonzero((domain.neighbours < domain.n_nodes) & (np.arange(2 * mask.ndim) % 2 == 1))
    keep = rng.random(node.size) < 0.3
    node, direction = node[keep], direction[keep]
    voxel = np.concatenate([shape.voxels[node], shape.voxels[domain.neighbours[node, direction]]])
    cuts = Cuts(voxel, np.concatenate([direction, direction ^ 1]), rng.uniform(0.1, 0.4, voxel.size))
    return Shape(shape.mask, shape.spacing, shape.origin, cuts=cuts)


@settings(max_examples=40, deadline=None)
@given(MASKS, st.integers(0, 9))
def test_faces_are_neighbours_of_each_other(mask, seed):
    """Across a ridge there is exactly one face, and it sees the first one back, cracks or none."""
    neighbours = face_neighbours(surface_domain(_cracked(mask, seed)))
    n = len(neighbours)
    start, end = np.repeat(np.arange(n), neighbours.shape[1]), neighbours.ravel()
    there, back = np.sort(start * n + end), np.sort(end * n + start)
    assert np.array_equal(there, back)
    assert np.all(np.bincount(end, minlength=n) == 2 * (mask.ndim - 1))


@settings(max_examples=40, deadline=None)
@given(PLANES, st.integers(0, 9))
def test_contours_meet_every_edge_once(mask, seed):
    """Contours are closed walks from face to neighbouring face that together meet every face once."""
    domain = surface_domain(_cracked(mask, seed))
    neighbours = face_neighbours(domain)
    order, contour = trace_contours(domain, np.ones(len(neighbours)))
    assert np.array_equal(np.sort(order), np.arange(len(neighbours)))
    assert np.all(np.diff(contour[order]) >= 0)
    for c in range(contour.max() + 1):
        walk = order[contour[order] == c]
        assert walk[0] == walk.min()
        assert all(b in neighbours[a] for a, b in zip(walk, np.roll(walk, -1), strict=True))


def test_outer_contours_come_before_longer_holes():
    """A small island is numbered before the long hole of a ring, after the ring's outside."""
    mask = np.zeros((12, 20), bool)
    mask[:, :13] = True
    mask[1:-1, 1:12] = False
    mask[5, 15:18] = True
    domain = voxel_domain(Shape.from_mask(mask))
    _, contour = trace_contours(domain, np.ones(face_neighbours(domain).shape[0]))
    assert np.bincount(contour).tolist() == [2 * (12 + 13), 8, 2 * (10 + 11)]


def test_voxels_that_touch_at_a_corner_have_contours_of_their_own():
    """Inside is connected across faces alone."""
    domain = voxel_domain(Shape.from_mask(np.eye(3)))
    assert np.bincount(trace_contours(domain, np.ones(12))[1]).tolist() == [4, 4, 4]


def test_crack_has_two_sides():
    """A crack within a shape is a contour of its own, one from its border is part of the outer contour."""
    for ends, direction, sizes in (((1, 4), (1, 0), [12, 2]), ((0, 1), (3, 2), [14])):
        cuts = Cuts(np.array(ends), np.array(direction), np.array([0.3, 0.3]))
        domain = surface_domain(Shape.from_mask(np.ones((3, 3)), cuts=cuts))
        assert np.bincount(trace_contours(domain, np.ones(14))[1]).tolist() == sizes


@pytest.mark.parametrize("flip", [False, True])
def test_shape_is_on_the_left(flip):
    """The signed area is positive outside, negative in holes, whatever the shape."""
    shape = annulus(0.4, 1.0, 0.1, offset=0.3)
    mask = shape.mask[:, ::-1] if flip else shape.mask
    domain = voxel_domain(Shape.from_mask(mask))
    node, direction = np.nonzero(domain.neighbours == domain.n_nodes)
    index = np.stack(np.unravel_index(shape.voxels if not flip else np.flatnonzero(mask), mask.shape), axis=1)
    point = index[node].astype(float)
    point[np.arange(node.size), direction // 2] += np.where(direction % 2, 0.5, -0.5)
    order, contour = trace_contours(domain, np.ones(node.size))
    for c, sign in ((0, 1), (1, -1)):
        x, y = point[order[contour[order] == c]].T
        assert np.sign(np.sum(x * np.roll(y, -1) - y * np.roll(x, -1))) == sign


@pytest.mark.parametrize("scale", [(1.0, 1.0), (1.0, 1.6)])
@pytest.mark.parametrize("offset", [0.0, 0.3])
def test_length_of_a_circle(scale, offset):
    """The staircase of a disk has the length of the circle, on grids of any proportion."""
    errors = []
    for h in (0.2, 0.1, 0.02):
        shape = disk(1.0, tuple(h * s for s in scale), offset=offset)
        errors.append(face_areas(surface_domain(shape), shape.spacing).sum() / (2 * np.pi) - 1)
    assert np.abs(errors) == pytest.approx(0, abs=0.065)
    assert np.abs(errors[1:]) == pytest.approx(0, abs=0.02)
    assert abs(errors[2]) < 0.012


def test_area_of_spheres():
    """A ball has the area of the sphere, in three and four dimensions."""
    shape = ball(1.0, 0.05, offset=0.2)
    assert face_areas(surface_domain(shape), shape.spacing).sum() == pytest.approx(4 * np.pi, rel=0.01)
    shape = n_ball(1.0, 0.2, ndim=4)
    assert face_areas(surface_domain(shape), shape.spacing).sum() == pytest.approx(2 * np.pi**2, rel=0.07)


@pytest.mark.parametrize("slope", [0.0, 0.1, 0.25, 0.5, 0.8, 1.0, 2.5])
def test_length_of_a_tilted_line(slope):
    """Away from its ends a line of any slope has its own length."""
    x, y = np.indices((120, 400)) - 0.2
    shape = Shape.from_mask(y < 50.3 + slope * x)
    domain = surface_domain(shape)
    node, direction = np.nonzero(domain.neighbours == domain.n_nodes)
    row, column = shape.points[node].T
    slanted = (row >= 20) & (row < 100) & (column > 20) & (direction != 2)
    length = face_areas(domain, shape.spacing)[slanted].sum()
    assert length == pytest.approx(80 * np.hypot(1, slope), rel=0.012)


def test_area_of_a_tilted_plane():
    """Away from its rim a plane of any tilt has its own area."""
    spacing = (1.0, 0.8, 1.1)
    x, y, z = (h * i for h, i in zip(spacing, np.indices((60, 70, 80)), strict=True))
    shape = Shape.from_mask(z < 30 + 0.3 * x + 0.55 * y, spacing)
    domain = surface_domain(shape)
    node, direction = np.nonzero(domain.neighbours == domain.n_nodes)
    x, y, z = shape.points[node].T
    tilted = (x >= 12) & (x < 48) & (y >= 12) & (y < 44) & (z > 10) & (direction != 4)
    wanted = 36 * 32 * np.sqrt(1 + 0.3**2 + 0.55**2)
    assert face_areas(domain, spacing)[tilted].sum() == pytest.approx(wanted, rel=0.015)


def test_small_and_thin_shapes_have_areas():
    """Single voxels are exact, strips nearly so, and no face stands for nothing."""
    for mask, wanted in ((np.ones(3), 2), (np.ones((1, 1)), 4), (np.ones((1, 1, 1)), 6)):
        assert face_areas(surface_domain(Shape.from_mask(mask)), (1.0,) * mask.ndim).sum() == pytest.approx(
            wanted
        )
    strip = face_areas(surface_domain(Shape.from_mask(np.ones((1, 100)))), (1.0, 1.0))
    assert strip.sum() == pytest.approx(202, rel=0.01)
    assert strip.min() > 0
