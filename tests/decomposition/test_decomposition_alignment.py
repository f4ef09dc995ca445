"""Correspondence of the sources of two shapes."""

from __future__ import annotations

import numpy as np
import pytest

from spem.decomposition.alignment import (
    align,
    boundary_distances,
    most_typical,
    relations,
    source_distances,
)
from spem.fields.boundary.patches import patch_sources
from spem.fields.boundary.sources import point_sources
from spem.fields.operator import assemble
from spem.fields.superposition.fields import SourceFields, solve_sources
from spem.shapes.shape import Shape


def _fields(mask: np.ndarray, count: int | None = None) -> SourceFields:
    """Solve for the boundary points or arcs of a mask."""
    system = assemble(Shape.from_mask(mask), "voxel")
    return solve_sources(point_sources(system) if count is None else patch_sources(system, count), np.inf)


def _hook(turns: int = 0) -> np.ndarray:
    """Return a hook of two arms of different length, turned by right angles."""
    mask = np.zeros((40, 40), bool)
    mask[4:36, 4:11] = mask[28:36, 4:22] = True
    return np.rot90(mask, turns)


def test_distances_of_sources_are_a_metric() -> None:
    """They are symmetric, zero for a source itself, and keep the triangle inequality."""
    distances = source_distances(_fields(_hook(), 30))
    assert np.array_equal(distances, distances.T)
    assert np.all(np.diag(distances) == 0)
    assert np.all(distances[:, :, None] <= distances[:, None, :] + distances[None].swapaxes(1, 2) + 1e-9)


def test_distances_grow_along_a_strip() -> None:
    """The farther two sources of a long strip lie apart, the farther apart are their logs."""
    fields = _fields(np.ones((3, 40)))
    along = fields.sources.position[:, 1]
    distances = source_distances(fields)
    start = int(np.argmin(along))
    order = np.argsort(along)[::8]
    assert np.all(np.diff(distances[start, order]) > 0)


def test_ways_along_a_contour_go_round_it() -> None:
    """Around a square they are what walking past its corners takes, not the way through it."""
    sources = _fields(np.ones((30, 30)), 40).sources
    distances = boundary_distances(sources)
    length = sources.measure.sum()
    steps = np.abs(np.subtract.outer(np.arange(40), np.arange(40)))
    assert distances == pytest.approx(np.minimum(steps, 40 - steps) * length / 40, abs=0.06 * length)
    assert np.all(np.diag(distances) == 0)


def test_separate_contours_are_as_far_as_can_be() -> None:
    """From a hole to the outside there is no way along the boundary."""
    mask = np.ones((20, 20), bool)
    mask[8:12, 8:12] = False
    sources = _fields(mask, 30).sources
    distances = boundary_distances(sources)
    apart = sources.contour[:, None] != sources.contour
    assert apart.any()
    assert np.all(distances[apart] == distances.max())


def test_some_of_the_sources_may_be_left_out() -> None:
    """Ways lead over points that belong to no source."""
    sources = _fields(np.ones((20, 30)), 30).sources
    all_of_them, some = boundary_distances(sources), boundary_distances(sources.select([3, 9, 20]))
    assert some == pytest.approx(all_of_them[np.ix_([3, 9, 20], [3, 9, 20])])


def test_sources_in_two_components_are_far_and_finite() -> None:
    """Sources without a common node have the largest distance of all."""
    mask = np.zeros((5, 14), bool)
    mask[:, :5] = mask[:, 8:] = True
    fields = _fields(mask)
    distances, left = source_distances(fields), fields.sources.position[:, 1] < 6
    assert np.isfinite(distances).all()
    assert 0 < left.sum() < left.size
    assert np.all(distances[np.ix_(left, ~left)] == distances.max())


def test_profiles_do_not_depend_on_the_division_of_the_boundary() -> None:
    """The quantiles of arcs at one place are nearly the same for 25 arcs and for 99."""
    coarse, fine = _fields(_hook(), 25), _fields(_hook(), 99)
    near = np.argmin(np.linalg.norm(coarse.sources.position[:, None] - fine.sources.position, axis=2), axis=1)
    few, many = relations(coarse).profiles, relations(fine).profiles[near]
    assert np.abs(few - many).mean() < 0.1


def test_a_turned_shape_is_aligned_with_itself() -> None:
    """After a quarter turn each arc is carried near to its own place: within the width of an arm, 7."""
    here, there = _fields(_hook(), 60), _fields(_hook(1), 60)
    found = align(relations(here), relations(there)).to_first(there.sources.position)
    row, column = here.sources.position.T
    gap = np.linalg.norm(found - np.stack([39 - column, row], axis=1), axis=1)
    assert gap.mean() < 3.5


def test_the_most_typical_shape_is_not_the_odd_one() -> None:
    """Of two hooks and a disk, one of the hooks."""
    rows, columns = np.mgrid[-9:10, -9:10]
    shapes = [_fields(rows**2 + columns**2 < 80, 40), _fields(_hook(), 40), _fields(_hook(1), 40)]
    assert most_typical([relations(f) for f in shapes]) in (1, 2)
