"""Parts of separately divided shapes under one numbering."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import spem
from spem.decomposition.division import region_parts
from spem.decomposition.matching import match_parts
from spem.decomposition.part_graph import part_graph
from spem.decomposition.parts import Parts
from spem.errors import ParameterError
from spem.fields.boundary.patches import patch_sources
from spem.fields.operator import assemble
from spem.fields.superposition.fields import solve_sources
from spem.shapes.shape import Shape


def _body() -> np.ndarray:
    """Return a body with three arms of different lengths."""
    mask = np.zeros((60, 70), bool)
    mask[20:36, 10:40] = mask[25:30, 40:70] = mask[36:60, 14:19] = mask[8:20, 30:35] = True
    return mask


def _parts(mask: np.ndarray, k: int = 4) -> Parts:
    """Divide the region of a mask by eighty arcs."""
    return region_parts(solve_sources(patch_sources(assemble(Shape.from_mask(mask), "voxel"), 80), np.inf), k)


@pytest.fixture(scope="module")
def divided() -> tuple[Parts, Parts]:
    """Return the parts of a body and of the same body turned."""
    return _parts(_body()), _parts(np.rot90(_body()))


@given(order=st.permutations(range(4)))
@settings(max_examples=8, deadline=None)
def test_a_permutation_is_undone(divided: tuple[Parts, Parts], order: list[int]) -> None:
    """However the parts of the turned shape were numbered, they get the numbers of the first."""
    one, turned = divided
    matched = match_parts([one, turned.relabelled(order)], reference=0)
    there = np.rot90(one.shape.to_grid(one.node_labels, -9))
    second = matched.parts[1]
    assert np.mean(there == second.shape.to_grid(second.node_labels, -9)) > 0.98
    assert matched.costs[0] == 0
    assert matched.costs[1] < 0.05


def test_the_reference_keeps_its_numbers(divided: tuple[Parts, Parts]) -> None:
    """Its labels are the ones it came with."""
    matched = match_parts(divided, reference=1)
    assert matched.reference == 1
    assert np.array_equal(matched.parts[1].node_labels, divided[1].node_labels)


@pytest.mark.parametrize("reference", [0, 1, None])
def test_left_over_parts_come_last(divided: tuple[Parts, Parts], reference: int | None) -> None:
    """Where numbers of parts differ, like parts are matched and no part is lost."""
    few = divided[0].relabelled([2, 0, 1])
    matched = match_parts([few, divided[1]], reference=reference)
    first, second = matched.parts
    assert first.n_parts == second.n_parts == 4
    there = np.rot90(first.shape.to_grid(first.node_labels, -9))
    both = second.shape.to_grid(second.node_labels, -9)
    assert np.mean((there == both)[there >= 0]) > 0.98
    assert np.array_equal(np.sort(second.sizes[second.sizes > 0]), np.sort(divided[1].sizes))


def test_features_tell_parts_apart_that_lie_alike() -> None:
    """Two equal halves of a bar are matched by what is said of their nodes."""
    bar = Shape.from_mask(np.ones((4, 41)))
    parts = spem.parts(bar, 2)
    column = bar.points[:, 1:]
    swapped = parts.relabelled([1, 0])
    matched = match_parts([parts, swapped], [column, column], reference=0).parts[1]
    assert np.array_equal(matched.node_labels, parts.node_labels)


def test_distances_run_inside_the_shape() -> None:
    """The two ends of a ring with a gap are far apart, though the gap is narrow."""
    rows, columns = np.mgrid[-20:21, -20:21]
    radius = np.hypot(rows, columns)
    ring = (radius < 20) & (radius > 15) & ~((np.abs(rows) < 2) & (columns > 0))
    parts = _parts(ring, 3)
    graph = part_graph(parts)
    ends = [
        int(parts.node_labels[np.argmin(np.hypot(*(parts.shape.points - [20 + s, 37]).T))]) for s in (-3, 3)
    ]
    assert ends[0] != ends[1]
    assert graph.distances[ends[0], ends[1]] == graph.distances[~np.eye(3, dtype=bool)].max()


def test_bad_arguments_are_refused(divided: tuple[Parts, Parts]) -> None:
    """No parts, a reference that is not there, features that do not fit."""
    n, m = (p.node_labels.size for p in divided)
    with pytest.raises(ParameterError, match="no parts"):
        match_parts([])
    with pytest.raises(ParameterError, match="reference=2"):
        match_parts(divided, reference=2)
    with pytest.raises(ParameterError, match="features of 1 shapes for parts of 2"):
        match_parts(divided, [np.zeros((n, 1))])
    with pytest.raises(ParameterError, match="one row a node"):
        match_parts(divided, [np.zeros((n, 1)), np.zeros((m, 2))])
    with pytest.raises(ParameterError, match="finite"):
        match_parts(divided, [np.zeros((n, 1)), np.full((m, 1), np.nan)])
