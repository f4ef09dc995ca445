"""Boundary points: which there are, their order, contours and measures."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from spem.fields.boundary.contours import trace_contours
from spem.fields.boundary.points import boundary_points, point_graph
from spem.fields.operator import assemble
from spem.shapes.shape import Shape
from spem.shapes.synthetic import annulus, ball, disk, shell

MASKS = hnp.arrays(bool, hnp.array_shapes(min_dims=1, max_dims=4, min_side=1, max_side=5)).filter(np.any)
PLANES = hnp.arrays(bool, hnp.array_shapes(min_dims=2, max_dims=2, min_side=1, max_side=9)).filter(np.any)
MODELS = ["surface", "voxel"]


def _sorted(rows: np.ndarray) -> np.ndarray:
    return rows[np.lexsort(rows.T)]


@settings(max_examples=50, deadline=None)
@given(MASKS, st.sampled_from(MODELS))
def test_points_are_the_ends_of_the_boundary_edges(mask, boundary):
    """Each edge ends at its point, every point ends an edge, and no two points of a voxel model coincide."""
    system = assemble(Shape.from_mask(mask, 0.5), boundary)
    points = boundary_points(system)
    node, direction = np.nonzero(system.domain.neighbours == system.n_nodes)
    end = system.shape.points[node]
    sign = np.where(direction % 2, 0.5, -0.5)
    end[np.arange(node.size), direction // 2] += sign * system.domain.fraction
    assert np.allclose(points.position[points.edge_point], end)
    assert np.array_equal(np.unique(points.edge_point), np.arange(points.n_points))
    assert points.n_points == (len(np.unique(end, axis=0)) if boundary == "voxel" else node.size)
    assert np.array_equal(np.unique(points.contour), np.arange(points.n_contours))
    assert np.all(points.measure > 0)


@settings(max_examples=50, deadline=None)
@given(PLANES)
def test_points_of_the_surface_follow_its_contours(mask):
    """Consecutive cut points of a contour, last and first too, are at most the diagonal of a voxel apart."""
    points = boundary_points(assemble(Shape.from_mask(mask)))
    assert np.all(np.diff(points.contour) >= 0)
    for c in range(points.n_contours):
        walk = points.position[points.contour == c]
        assert np.linalg.norm(walk - np.roll(walk, -1, axis=0), axis=1).max() <= np.sqrt(2) + 1e-12


@settings(max_examples=50, deadline=None)
@given(PLANES)
def test_outside_voxels_are_numbered_by_first_meeting(mask):
    """Along the contours new voxels come in the order of their numbers, one step of a king at a time."""
    system = assemble(Shape.from_mask(mask), "voxel")
    points = boundary_points(system)
    order, contour = trace_contours(system.domain, np.ones(points.edge_point.size))
    met = points.edge_point[order]
    step = np.abs(np.diff(points.position[met], axis=0)).max(axis=1)
    assert np.all(step[np.diff(contour[order]) == 0] <= 1)
    if points.n_contours == 1:
        assert np.all(np.diff(np.maximum.accumulate(met)) <= 1)


@pytest.mark.parametrize("boundary", MODELS)
def test_points_of_a_disk_go_round_it(boundary):
    """The angle grows all the way, and neighbours are two voxels apart at most."""
    points = boundary_points(assemble(disk(1.0, 0.05, offset=0.2), boundary))
    angle = np.unwrap(np.arctan2(points.position[:, 1], points.position[:, 0]))
    assert np.all(np.diff(angle) > -0.04)
    assert angle[-1] - angle[0] == pytest.approx(2 * np.pi, abs=0.15)
    step = np.linalg.norm(points.position - np.roll(points.position, -1, axis=0), axis=1)
    assert step.max() <= 2 * 0.05


@settings(max_examples=30, deadline=None)
@given(PLANES, st.sampled_from(MODELS))
def test_a_quarter_turn_permutes_the_points(mask, boundary):
    """Points, lengths and contours of a turned mask are those of the mask."""
    here = boundary_points(assemble(Shape.from_mask(mask), boundary))
    there = boundary_points(assemble(Shape.from_mask(np.rot90(mask)), boundary))
    row, column = here.position.T
    turned = np.column_stack([mask.shape[1] - 1 - column, row, here.measure])
    assert np.allclose(
        _sorted(turned.round(9)), _sorted(np.column_stack([there.position, there.measure]).round(9))
    )
    if boundary == "surface":
        assert np.array_equal(np.bincount(np.bincount(here.contour)), np.bincount(np.bincount(there.contour)))


def test_one_voxel_and_two_that_touch():
    """One pixel has four points; two at a corner share two outside voxels but no cut point."""
    one = boundary_points(assemble(Shape.from_mask(np.ones((1, 1))), "voxel"))
    assert (one.n_points, one.n_contours, one.measure.tolist()) == (4, 1, [1.0] * 4)
    two = Shape.from_mask(np.eye(2))
    assert boundary_points(assemble(two, "voxel")).contour.tolist() == [0, 0, 0, 0, 1, 1]
    assert boundary_points(assemble(two)).contour.tolist() == [0] * 4 + [1] * 4


def test_slit_of_one_voxel_is_met_once():
    """Outside voxels between two fingers have one point each, which stands for both sides."""
    mask = np.ones((6, 3), bool)
    mask[:5, 1] = False
    points = boundary_points(assemble(Shape.from_mask(mask), "voxel"))
    slit = (points.position[:, 1] == 1) & (points.position[:, 0] >= 0) & (points.position[:, 0] <= 4)
    assert np.count_nonzero(slit) == 5
    assert np.all(points.measure[slit][1:-1] > 1)


@pytest.mark.parametrize("boundary", MODELS)
def test_pieces_of_boundary(boundary):
    """Rings and shells have two pieces, the outer first; in one dimension each point is one."""
    ring = boundary_points(assemble(annulus(0.5, 1.0, 0.1), boundary))
    hollow = boundary_points(assemble(shell(0.5, 1.0, 0.1), boundary))
    for points in (ring, hollow):
        radius = np.linalg.norm(points.position, axis=1)
        assert np.array_equal(points.contour, (radius < 0.75).astype(int))
    line = boundary_points(assemble(Shape.from_mask([1, 1, 0, 0, 1]), boundary))
    assert line.contour.tolist() == [0, 1, 2, 3]
    assert line.measure.tolist() == [1.0] * 4


def test_points_in_space_are_in_c_order():
    """Outside voxels of a ball are in the order of the grid."""
    points = boundary_points(assemble(ball(1.0, 0.25), "voxel"))
    assert np.array_equal(np.lexsort(points.position.T[::-1]), np.arange(points.n_points))


@pytest.mark.parametrize("boundary", MODELS)
def test_neighbours_are_along_the_surface(boundary):
    """Two fingers two voxels apart have no neighbouring points across the gap."""
    mask = np.ones((12, 3, 8), bool)
    mask[:9, :, 3:5] = False
    system = assemble(Shape.from_mask(mask), boundary)
    points = boundary_points(system)
    graph = point_graph(system, points.edge_point).tocoo()
    apart = np.linalg.norm(points.position[graph.row] - points.position[graph.col], axis=1)
    assert apart.max() <= np.sqrt(2) + 1e-12
    gap = (points.position[:, 0] > 0) & (points.position[:, 0] < 7) & (abs(points.position[:, 2] - 3.5) <= 1)
    inner = gap[graph.row] & gap[graph.col]
    side = points.position[:, 2] < 3.5
    assert np.array_equal(side[graph.row[inner]], side[graph.col[inner]])
    assert "1 contours" in repr(points)
