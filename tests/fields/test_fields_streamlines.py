"""Streamlines along known fields, and up to the sources of real shapes."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import spem
from spem.errors import ParameterError
from spem.fields.boundary.sources import point_sources
from spem.fields.gradients import gradient, source_gradient
from spem.fields.operator import assemble
from spem.fields.streamlines import even_nodes, source_streamlines, trace_streamlines
from spem.fields.superposition.fields import solve_sources
from spem.shapes.shape import Cuts, Shape
from spem.shapes.synthetic import annulus, ball, disk


def _vectors(shape, function):
    """Return a vector field at the nodes."""
    return np.stack(function(*shape.points.T), axis=1)


@pytest.mark.parametrize(("make", "spacing"), [(disk, (0.05, 0.03)), (ball, 0.1)])
def test_radial_lines_are_straight_and_end_on_the_boundary(make, spacing):
    """Lines along the radius keep their direction to a hundredth and end within a voxel of the sphere."""
    shape = make(1.0, spacing, offset=0.3137)
    radius = np.linalg.norm(shape.points, axis=1)
    seeds = np.flatnonzero((radius > 0.3) & (radius < 0.4))[::7]
    lines = trace_streamlines(assemble(shape), shape.points, seeds)
    assert set(lines.ends) == {"boundary"}
    for seed, line in zip(seeds, lines, strict=True):
        assert line[0].tolist() == shape.points[seed].tolist()
        along = line / np.linalg.norm(line, axis=1, keepdims=True)
        assert np.linalg.norm(along - along[0], axis=1).max() < 0.02
        assert np.linalg.norm(line[-1]) == pytest.approx(1, abs=max(shape.spacing))
        gaps = np.linalg.norm(np.diff(line, axis=0), axis=1)
        assert gaps[:-1] == pytest.approx(0.25 * min(shape.spacing))
        assert gaps[-1] <= 0.25 * min(shape.spacing) * (1 + 1e-9)


def test_circles_close_and_stop_at_the_greatest_length():
    """A line around an annulus stays on its circle and goes on until it is as long as asked."""
    shape = annulus(0.5, 1.0, 0.05, offset=0.3137)
    system = assemble(shape)
    start = int(np.argmin(np.abs(np.linalg.norm(shape.points, axis=1) - 0.75)))
    lines = trace_streamlines(system, _vectors(shape, lambda x, y: (-y, x)), [start], max_length=10.0)
    radius = np.linalg.norm(lines[0], axis=1)
    assert lines.ends == ("length",)
    assert radius == pytest.approx(radius[0], rel=0.01)
    assert np.linalg.norm(np.diff(lines[0], axis=0), axis=1).sum() == pytest.approx(10, abs=0.02)


def test_lines_into_the_middle_stop_there():
    """Up the deficit of the whole field of a disk every line stops in its middle."""
    shape = disk(1.0, 0.06, offset=0.3137)
    system = assemble(shape)
    inward = -gradient(system, spem.field(shape, 0.4), boundary=1.0)
    lines = trace_streamlines(system, inward, even_nodes(system, 12))
    assert set(lines.ends) == {"stagnation"}
    assert max(np.linalg.norm(line[-1]) for line in lines) < 0.08


def test_lines_do_not_cross_a_cut():
    """Where two surfaces pass between neighbours, a line ends at the first."""
    shape = Shape.from_mask(np.ones((4, 3)))
    row = np.flatnonzero(np.isin(shape.voxels // 5, 2)), np.flatnonzero(np.isin(shape.voxels // 5, 3))
    voxel = np.concatenate([shape.voxels[row[0]], shape.voxels[row[1]]])
    cuts = Cuts(voxel, np.repeat([1, 0], 3), np.repeat([0.25, 0.5], 3))
    system = assemble(Shape(shape.mask, shape.spacing, shape.origin, cuts=cuts))
    down = np.tile([1.0, 0.0], (12, 1))
    down[6:] = [0.0, 1.0]  # beyond the cut all goes another way
    line = trace_streamlines(system, down, [1])
    assert line.ends == ("boundary",)
    assert line[0][-1].tolist() == [1.25, 1.0]
    assert (line[0][:, 1] == 1).all()


@pytest.mark.parametrize("boundary", ["voxel", "surface"])
@settings(max_examples=12, deadline=None)
@given(st.integers(0, 2**32 - 1), st.sampled_from([2, 3]))
def test_lines_up_a_source_end_at_it(boundary, seed, ndim):
    """Whatever the shape and spacing, lines from all nodes that a source reaches end at one of its points."""
    rng = np.random.default_rng(seed)
    mask = rng.random((9, 9) if ndim == 2 else (5, 5, 5)) < 0.65
    mask.flat[0] = True
    system = assemble(Shape.from_mask(mask, tuple(rng.uniform(0.5, 2.0, ndim))), boundary)
    sources = point_sources(system)
    fields = solve_sources(
        sources.select([int(rng.integers(sources.n_sources))]), float(rng.choice([1, np.inf]))
    )
    reached = np.flatnonzero(np.isfinite(fields.log[0]))
    lines = source_streamlines(fields, 0, reached)
    assert set(lines.ends) == {"source"}
    for line in lines:
        assert line[-1] == pytest.approx(fields.sources.position[0])


def test_unreached_nodes_have_no_line():
    """In a component that a source does not touch a line is its seed alone."""
    shape = Shape.from_mask([[1, 1, 0, 0, 1, 1]])
    fields = solve_sources(point_sources(assemble(shape)), 1.0)
    lines = source_streamlines(fields, 0, [0, 3])
    assert lines.ends == ("source", "stagnation")
    assert [len(line) for line in lines] == [2, 1]
    assert lines[1].tolist() == [[0.0, 5.0]]


@pytest.mark.data
@pytest.mark.parametrize("boundary", ["voxel", "surface"])
def test_lines_of_a_hand_end_at_the_source(data_dir, boundary):
    """From nodes all over a real hand, lines up the field of a source on a finger end there, and rise."""
    shape = spem.read(data_dir / "tari1000" / "obj11_3.png", inner_radius=12)
    sources = point_sources(assemble(shape, boundary))
    fields = solve_sources(sources.select([int(np.argmin(sources.position[:, 0]))]), np.inf)
    lines = source_streamlines(fields, 0, np.arange(0, shape.n_nodes, 5))
    assert set(lines.ends) == {"source"}
    slope = source_gradient(fields, 0)
    for seed, line in zip(range(0, shape.n_nodes, 5), lines, strict=True):
        if len(line) > 3:
            assert (line[1] - line[0]) @ slope[seed] > 0


@settings(max_examples=10, deadline=None)
@given(st.integers(1, 40))
def test_even_nodes_keep_apart(count):
    """No two even nodes are nearer than the next one would be, and asking for more only adds."""
    system = assemble(disk(1.0, 0.15))
    chosen = even_nodes(system, count)
    points = system.shape.points
    gap = [np.linalg.norm(points[chosen[:k]] - points[chosen[k]], axis=1).min() for k in range(1, count)]
    assert all(b <= a + 1e-12 for a, b in pairwise(gap))
    assert even_nodes(system, count + 1)[:count].tolist() == chosen.tolist()


def test_lines_are_a_sequence():
    """Lines are counted, indexed from both ends and told with their ends; without seeds there are none."""
    system = assemble(Shape.from_mask(np.ones((3, 3))))
    lines = trace_streamlines(system, np.ones((9, 2)), [0, 8])
    assert len(lines) == 2
    assert lines[-1].tolist() == list(lines)[1].tolist()
    assert "2 lines" in repr(lines)
    assert "2 at boundary" in repr(lines)
    none = trace_streamlines(system, np.ones((9, 2)), [])
    assert len(none) == 0
    assert "none" in repr(none)
    with pytest.raises(IndexError, match="out of range"):
        lines[2]


def test_bad_arguments_are_refused():
    """Vectors of another shape, seeds that are no nodes, lengths that are none and unknown sources."""
    system = assemble(Shape.from_mask(np.ones((3, 3)), name="square"))
    with pytest.raises(ParameterError, match=r"square: vectors must be \(9, 2\) and finite, not \(9, 3\)"):
        trace_streamlines(system, np.ones((9, 3)), [0])
    with pytest.raises(ParameterError, match="finite"):
        trace_streamlines(system, np.full((9, 2), np.nan), [0])
    with pytest.raises(ParameterError, match="a seed is node 9, expected 0 to 8"):
        trace_streamlines(system, np.ones((9, 2)), [9])
    with pytest.raises(ParameterError, match=r"numbers of nodes, \(n,\), not \(1, 2\) of float64"):
        trace_streamlines(system, np.ones((9, 2)), [(np.nan, 0.0)])
    with pytest.raises(ParameterError, match="expected 0 < step <= 1"):
        trace_streamlines(system, np.ones((9, 2)), [0], step=0)
    with pytest.raises(ParameterError, match="a length above 0"):
        trace_streamlines(system, np.ones((9, 2)), [0], max_length=-1)
    with pytest.raises(ParameterError, match="source 99, expected 0 to 11"):
        source_streamlines(solve_sources(point_sources(system), 1.0), 99, [0])
    with pytest.raises(ParameterError, match="count=0: expected one node or more"):
        even_nodes(system, 0)
