"""Sources: right-hand sides, selection, what each stands for, nearest ones, components."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from spem.errors import ParameterError
from spem.fields.boundary.patches import patch_sources
from spem.fields.boundary.sources import point_sources
from spem.fields.operator import assemble
from spem.shapes.shape import Shape
from spem.shapes.synthetic import disk

MASKS = hnp.arrays(bool, hnp.array_shapes(min_dims=1, max_dims=4, min_side=1, max_side=5)).filter(np.any)
MODELS = ["surface", "voxel"]


@pytest.fixture
def bar():
    """Return the ten outside voxels of a bar of 2 x 3."""
    return point_sources(assemble(Shape.from_mask(np.ones((2, 3)), 0.5, name="bar"), "voxel"))


@settings(max_examples=40, deadline=None)
@given(MASKS, st.sampled_from(MODELS), st.integers(0, 99))
def test_right_hand_sides_sum_to_that_of_the_system(mask, boundary, seed):
    """Σ b^{p_i} = b to rounding, for points and for patches of any number; measures sum alike."""
    system = assemble(Shape.from_mask(mask, 0.7), boundary)
    points = point_sources(system)
    pieces, n = points.points.n_contours, points.n_sources
    count = int(np.random.default_rng(seed).integers(pieces, n + 1))
    for sources in (points, patch_sources(system, count, np.random.default_rng(seed))):
        assert np.allclose(sources.rhs.sum(axis=1), system.rhs, rtol=1e-14, atol=0)
        assert sources.measure.sum() == pytest.approx(points.points.measure.sum())
        assert sources.measure.shape == sources.contour.shape == (sources.n_sources,)
        assert np.all(np.bincount(sources.group) > 0)


def test_selection_keeps_the_order_given(bar):
    """Chosen sources have the positions, measures and right-hand sides that they had."""
    chosen = bar.select([7, 2])
    assert chosen.n_sources == 2
    assert np.array_equal(chosen.position, bar.position[[7, 2]])
    assert np.array_equal(chosen.measure, bar.measure[[7, 2]])
    assert np.array_equal(chosen.rhs.toarray(), bar.rhs.toarray()[:, [7, 2]])
    assert bar.select(3).n_sources == 1
    assert "2 sources of 2 of 10 boundary points" in repr(chosen)
    assert "1 source of 1" in repr(bar.select(3))


@pytest.mark.parametrize(
    ("numbers", "message"),
    [
        ([0, 10], "no source 10, expected 0 to 9"),
        ([-1], "no source -1, expected 0 to 9"),
        ([4, 2, 4], "source 4 is chosen twice"),
        ([], "whole numbers from 0 to 9"),
        ([0.5], "whole numbers from 0 to 9"),
        (["a"], "whole numbers from 0 to 9"),
    ],
)
def test_wrong_selection_is_refused(bar, numbers, message):
    """Numbers that are not those of sources are named."""
    with pytest.raises(ParameterError, match=f"bar: .*{message}"):
        bar.select(numbers)


def test_nearest_source_is_in_the_coordinates_of_the_shape():
    """Origin and spacing count, and the distance comes back."""
    shape = disk(2.0, (0.1, 0.05), offset=0.3)
    sources = point_sources(assemble(shape))
    source, distance = sources.nearest([(2.0, 0.0), (0.0, -2.1)])
    assert np.allclose(sources.position[source], [(2, 0), (0, -2)], atol=0.06)
    assert distance == pytest.approx([0, 0.1], abs=0.05)
    assert sources.nearest((2.0, 0.0))[0] == source[0]


def test_nearest_patch_holds_the_nearest_point():
    """A point on a patch finds it, though the middle of another may be nearer."""
    sources = patch_sources(assemble(disk(1.0, 0.05), "voxel"), 7)
    source, distance = sources.nearest(sources.points.position, distinct=False)
    assert np.array_equal(source, sources.group)
    assert np.all(distance == 0)


@pytest.mark.parametrize(
    ("points", "options", "message"),
    [
        (
            [(0.0, 0.0), (40.0, 0.0)],
            {},
            "point 40,0 is 39 from .* more than 1.5; the nearest boundary node is 1,0",
        ),
        ([(0.0, -1.0)], {"tolerance": 0.1}, "point 0,-1 is 0.5 from .* more than 0.1"),
        ([(0.0, -0.6), (0.1, -0.6)], {}, "points 0,-0.6 and 0.1,-0.6 fall on one source"),
        ([(0.0, 1e300)], {}, "point 0,1e\\+300 is 1e\\+300 from"),
        ([(0.0, 0.0)], {"tolerance": -1.0}, "tolerance=-1.0 must be a positive distance"),
        ([(0.0, 0.0)], {"tolerance": np.nan}, "tolerance=nan must be a positive distance"),
        ([(0.0, 0.0, 0.0)], {}, "a point has 2 finite coordinates"),
        ([(0.0, np.nan)], {}, "a point has 2 finite coordinates"),
        ([], {}, "a point has 2 finite coordinates"),
        ("middle", {}, "a point has 2 finite coordinates"),
    ],
)
def test_points_without_a_source_are_refused(bar, points, options, message):
    """Far points, twins and what is no point are named, with what was expected."""
    with pytest.raises(ParameterError, match=f"bar: .*{message}"):
        bar.nearest(points, **options)


def test_twins_may_be_allowed(bar):
    """Two points may ask for one source where that is wanted."""
    source, _ = bar.nearest([(0.0, -0.6), (0.1, -0.6)], distinct=False)
    assert source[0] == source[1]


def test_reach_of_sources_between_two_components():
    """An outside voxel between two components touches both, a cut point touches one."""
    shape = Shape.from_mask([[1, 1, 0, 1]])
    assert assemble(shape).domain.component.tolist() == [0, 0, 1]
    between = point_sources(assemble(shape, "voxel"))
    reach = between.reach.toarray()
    middle, _ = between.nearest((0.0, 2.0))
    assert reach[middle].tolist() == [[True, True]]
    assert reach.sum() == between.n_sources + 1
    assert point_sources(assemble(shape)).reach.toarray().sum(axis=0).tolist() == [6, 4]


@settings(max_examples=20, deadline=None)
@given(MASKS, st.sampled_from(MODELS))
def test_right_hand_sides_live_in_the_reach(mask, boundary):
    """A source's right-hand side is zero at the nodes of all components but those that it touches."""
    sources = point_sources(assemble(Shape.from_mask(mask), boundary))
    component = sources.system.domain.component
    touched = np.zeros(sources.reach.shape, bool)
    node, source = sources.rhs.nonzero()
    touched[source, component[node]] = True
    assert np.array_equal(touched, sources.reach.toarray())
    assert np.all(np.diff(np.bincount(component)) <= 0)
