"""Inner geodesic distances: exact where they are straight, convergent round corners, apart where cut."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.sparse import coo_array
from scipy.sparse.csgraph import dijkstra

import spem
from spem.errors import ParameterError
from spem.fields.domain import surface_domain
from spem.fields.geodesics import inner_distances, source_distances
from spem.paper.geodesics import u_way
from spem.shapes.shape import Cuts, Shape


@pytest.mark.parametrize("ndim", [1, 2, 3, 4])
def test_straight_lines_in_convex_shapes(ndim):
    """In a box every way is straight, to rounding, on anisotropic grids of every dimension."""
    shape = Shape.from_mask(np.ones((7, 6, 5, 4)[:ndim]), (1.0, 0.5, 2.0, 0.7)[:ndim])
    distance = inner_distances(shape, [0, shape.n_nodes // 2])
    straight = np.linalg.norm(shape.points[[0, shape.n_nodes // 2], None] - shape.points, axis=2)
    np.testing.assert_allclose(distance, straight, rtol=1e-14, atol=1e-14)


def test_first_order_round_corners():
    """Round the two corners of a U ways are too long by a fixed share of a voxel."""
    errors = []
    for cells in (20, 60):
        way, marched = u_way(cells)
        errors.append(np.abs(marched - way.distance).mean())
        assert marched.min() >= 0
        assert np.abs(marched - way.distance).max() < 1.6 / cells
    assert np.log(errors[0] / errors[1]) / np.log(3) == pytest.approx(1.0, abs=0.1)


def test_second_order_differences_are_better_than_first():
    """On a U the errors of first order are half as large again as those of second, or more."""
    way, _ = u_way(40)
    first, second = (np.abs(source_distances(way.sources, order=k)[0] - way.distance).mean() for k in (1, 2))
    assert first > 1.5 * second


def test_parts_that_touch_through_the_grid_stay_apart():
    """A cut between two inside voxels is no way; round its end there is one."""
    mask = np.ones((4, 6), bool)
    framed = Shape.from_mask(mask)
    rows = np.arange(3)  # the last row is left open
    left = np.ravel_multi_index((rows + 1, np.full(3, 3)), framed.mask.shape)
    cuts = Cuts(np.concatenate([left, left + 1]), np.repeat([3, 2], 3), np.full(6, 0.5))
    shape = Shape(framed.mask, framed.spacing, framed.origin, cuts=cuts)
    distance = inner_distances(shape, [0])[0]
    across = int(np.flatnonzero((shape.points == [0, 3]).all(axis=1))[0])
    assert distance[across] > 6
    closed = np.ravel_multi_index((np.arange(4) + 1, np.full(4, 3)), framed.mask.shape)
    wall = Cuts(np.concatenate([closed, closed + 1]), np.repeat([3, 2], 4), np.full(8, 0.5))
    apart = Shape(framed.mask, framed.spacing, framed.origin, cuts=wall)
    assert np.isinf(inner_distances(apart, [0])[0]).sum() == 12


@given(st.integers(0, 2**32 - 1))
@settings(max_examples=15, deadline=None)
def test_between_the_straight_line_and_the_way_along_edges(seed):
    """On random masks lengths lie between the straight line, nearly, and the way along edges."""
    rng = np.random.default_rng(seed)
    shape = Shape.from_mask(rng.random((9, 8)) < 0.75, (1.0, 1.3))
    source = int(rng.integers(shape.n_nodes))
    first, second = (inner_distances(shape, [source], order=order)[0] for order in (1, 2))
    neighbours = surface_domain(shape).neighbours
    node, direction = np.nonzero(neighbours < shape.n_nodes)
    length = np.take(shape.spacing, direction // 2)
    graph = coo_array((length, (node, neighbours[node, direction])), shape=(shape.n_nodes, shape.n_nodes))
    along = dijkstra(graph.tocsr(), indices=source)
    straight = np.linalg.norm(shape.points - shape.points[source], axis=1)
    assert (first >= straight - 1e-12).all()
    assert (second >= straight - 0.15).all()
    assert (np.maximum(first, second) <= along + 1e-12).all()


def test_turned_and_mirrored_shapes_have_turned_and_mirrored_distances():
    """Symmetries of the grid permute the distances exactly."""
    mask = np.random.default_rng(3).random((10, 7)) < 0.8
    shape = Shape.from_mask(mask)
    grid = np.full(mask.shape, np.nan)
    grid[mask] = inner_distances(shape, [0])[0]
    for turn in (lambda a: np.rot90(a), lambda a: a[::-1], lambda a: a.T):
        turned = turn(mask)
        source = int(turn(grid)[turned].argmin())
        found = inner_distances(Shape.from_mask(turned), [source])[0]
        np.testing.assert_allclose(found, turn(grid)[turned], rtol=1e-13)


def test_sources_are_measured_from_their_cuts():
    """The distance from a boundary source starts at its cut, and a group has the nearest of its points."""
    shape = Shape.from_mask(np.ones((5, 5)), 2.0)
    sources = spem.sources(shape)
    distance = source_distances(sources, [0])[0]
    straight = np.linalg.norm(shape.points - sources.position[0], axis=1)
    np.testing.assert_allclose(distance, straight, rtol=1e-14)
    everything = source_distances(sources).min(axis=0)
    np.testing.assert_allclose(everything, spem.distance_to_boundary(shape), rtol=1e-12)


@pytest.mark.parametrize(
    ("sources", "match"),
    [
        ([99], "no node 99, expected 0 to 11"),
        ([-1], "no node -1"),
        ([], "numbers of nodes"),
        ([0.5], "numbers of nodes"),
        ([[0, 1]], "numbers of nodes"),
    ],
)
def test_what_is_no_node_is_refused(sources, match):
    """Numbers out of range, none at all, and what are no numbers."""
    with pytest.raises(ParameterError, match=match):
        inner_distances(Shape.from_mask(np.ones((3, 4))), sources)


def test_one_node_gives_one_row():
    """A number in place of a list of one."""
    shape = Shape.from_mask(np.ones((3, 4)))
    np.testing.assert_array_equal(inner_distances(shape, 3), inner_distances(shape, [3]))


def test_wrong_arguments_are_named():
    """A mask in place of a shape, an order of three, and nodes in place of sources."""
    shape = Shape.from_mask(np.ones((3, 4)))
    with pytest.raises(ParameterError, match="read it first"):
        inner_distances(shape.mask, [0])
    with pytest.raises(ParameterError, match="order=3: expected 1 or 2"):
        inner_distances(shape, [0], order=3)
    with pytest.raises(ParameterError, match="make them"):
        source_distances([0])


@pytest.mark.data
def test_ways_on_a_hand_are_symmetric(data_dir):
    """From tip to tip and back ways have one length, within half a voxel."""
    shape = spem.read(data_dir / "tari1000" / "obj11_1.png")
    nodes = np.random.default_rng(0).integers(0, shape.n_nodes, 6)
    between = inner_distances(shape, nodes)[:, nodes]
    assert np.abs(between - between.T).max() < 0.5 * max(shape.spacing)


@settings(max_examples=15, deadline=None)
@given(seed=st.integers(0, 999), tall=st.floats(0.1, 8.0))
def test_no_way_is_shorter_than_the_straight_line(seed, tall):
    """On rough masks with flat voxels too, where second-order differences alone undershoot."""
    mask = np.random.default_rng(seed).random((14, 12)) < 0.75
    shape = Shape.from_mask(mask, spacing=(1.0, tall))
    ways = inner_distances(shape, [0])[0]
    assert (ways >= np.linalg.norm(shape.points - shape.points[0], axis=1) * (1 - 1e-12)).all()
