"""Levels made on the device against the host's hierarchy."""

from __future__ import annotations

import numpy as np
import pytest
from backends import DEVICES, needs_simulator, use_runtime
from hypothesis import given, settings
from hypothesis import strategies as st
from simulator import SimulatedRuntime

from spem.errors import ParameterError
from spem.fields.operator import assemble
from spem.fields.solvers import multigrid
from spem.fields.solvers.cuda.footprint import hierarchy_bytes
from spem.fields.solvers.cuda.levels import Hierarchy
from spem.fields.solvers.cuda.runtime import TILE
from spem.shapes.shape import Cuts, Shape

LONGEST = {1: 700, 2: 40, 3: 13, 4: 6}
SIEVE = np.random.default_rng(0).random((120, 120)) < 0.3


def ball(n, d):
    """A solid ball in a grid of n^d voxels."""
    axes = np.meshgrid(*[np.linspace(-1, 1, n)] * d, indexing="ij")
    return np.sum(np.square(axes), axis=0) < 1


def noise(rng, d):
    """A system of noise, thin or thick: many components, single voxels, edges cut between inside voxels."""
    sides = rng.integers(1, LONGEST[d] + 1, d)
    mask = rng.random(sides) < rng.choice([0.05, 0.6, 0.95])
    mask.flat[rng.integers(mask.size)] = True
    shape = Shape.from_mask(mask, tuple(rng.uniform(0.2, 3.0, d)))
    upper = assemble(shape).domain.neighbours[:, 1]
    low = np.flatnonzero((upper < shape.n_nodes) & (rng.random(upper.size) < 0.1))
    ends = shape.voxels[np.concatenate([low, upper[low]])]
    direction = np.repeat([1, 0], low.size)
    cuts = Cuts(ends, direction.astype(np.uint8), rng.uniform(0.1, 1.0, ends.size))
    shape = Shape(shape.mask, shape.spacing, shape.origin, cuts=cuts)
    return assemble(shape, rng.choice(["surface", "voxel"]))


@pytest.fixture(scope="module")
def batch():
    """Systems of two dimensions that end at four different levels."""
    masks = [ball(70, 2), np.ones((1, 1)), ball(12, 2), np.ones((1, 300)), np.ones((6, 8))]
    return [assemble(Shape.from_mask(mask, (1.0, 0.5))) for mask in masks]


def tables(level, runtime):
    """Arrays of a level on the host; the dummy row is -1."""
    layout = level.layout
    names = ["neighbours", "weight", "diagonal", "mass", "parent", "children"]
    found = {name: runtime.download(array) for name in names if (array := getattr(level, name)) is not None}
    found["neighbours"][found["neighbours"] == layout.n_rows] = -1
    return found


def assert_as_on_the_host(systems, hierarchy, runtime):
    """Every level of every system is the host's but for the order of nodes, in the simulator in every bit."""
    near = 0 if isinstance(runtime, SimulatedRuntime) else 3e-6
    levels = [tables(level, runtime) for level in hierarchy.levels]
    all_rows = runtime.download(hierarchy.rows)
    for b, system in enumerate(systems):
        host = multigrid.Hierarchy.of(system)
        rows = all_rows[hierarchy.first_node[b] : hierarchy.first_node[b + 1]]
        assert hierarchy.depth[b] == len(host.levels) - 1
        for expected, level, found in zip(host.levels, hierarchy.levels, levels, strict=False):
            neighbours, weight, step, diagonal, mass = expected.graph
            n = expected.n_nodes
            assert np.unique(rows).size == n == level.layout.counts[b].sum()
            np.testing.assert_array_equal(found["neighbours"][rows], np.append(rows, -1)[neighbours])
            own = np.full(n, b) if level.fine else rows
            np.testing.assert_allclose(found["weight"][own], weight[step * np.arange(n)], near)
            np.testing.assert_allclose(found["diagonal"][rows], diagonal, near)
            np.testing.assert_allclose(found["mass"][rows], mass, near)
            if expected.aggregate is not None:
                above = np.empty(expected.aggregate.max() + 1, np.int32)
                above[expected.aggregate] = found["parent"][rows]
                np.testing.assert_array_equal(above[expected.aggregate], found["parent"][rows])
                rows = above


def assert_consistent(hierarchy, runtime):
    """Edges join colours of one system, parents and children agree, padding is joined to nothing."""
    levels = [tables(level, runtime) for level in hierarchy.levels]
    for level, found in zip(hierarchy.levels, levels, strict=True):
        layout, n = level.layout, level.layout.n_rows
        node = np.zeros(n, bool)
        for b, colour in np.ndindex(layout.counts.shape):
            node[layout.first_row[b, colour] :][: layout.counts[b, colour]] = True
        tile = np.arange(n) // TILE
        system = runtime.download(layout.tile_system)[tile]
        red = tile < layout.middle_tile[system]
        row, k = np.nonzero(found["neighbours"] >= 0)
        other = found["neighbours"][row, k]
        assert node[row].all()
        assert (system[row] == system[other]).all()
        assert (red[row] != red[other]).all()
        assert (found["diagonal"][~node] == 1).all()
        assert (found["mass"][~node] == 0).all()
        assert (found["diagonal"][node] > 0).all()
        assert (found["mass"][node] > 0).all()
    for fine, coarse, below, above in zip(
        hierarchy.levels[:-1], hierarchy.levels[1:], levels[:-1], levels[1:], strict=True
    ):
        n, n_coarse = fine.layout.n_rows, coarse.layout.n_rows
        row, corner = np.nonzero(above["children"] < n)
        child = above["children"][row, corner]
        assert np.unique(child).size == child.size
        expected = np.full(n, n_coarse)
        expected[child] = row
        np.testing.assert_array_equal(below["parent"], expected)
    assert hierarchy.levels[-1].parent is None
    assert hierarchy.levels[0].children is None


@pytest.mark.parametrize("device", DEVICES)
@settings(max_examples=12, deadline=None)
@given(st.integers(1, 4), st.integers(1, 3), st.integers(0, 2**32 - 1))
def test_levels_are_those_of_the_host(device, d, n_systems, seed):
    """Noise of any dimension, alone or in batches, gives the host's graphs."""
    rng = np.random.default_rng(seed)
    systems = [noise(rng, d) for _ in range(n_systems)]
    runtime = use_runtime(device, "shuffled")
    hierarchy = Hierarchy.of(systems, runtime)
    assert_as_on_the_host(systems, hierarchy, runtime)
    assert_consistent(hierarchy, runtime)


@pytest.mark.parametrize("device", DEVICES)
def test_systems_end_at_levels_of_their_own(device, batch):
    """A system has no tiles past its coarsest level, where it has at most 48 nodes."""
    runtime = use_runtime(device)
    hierarchy = Hierarchy.of(batch, runtime)
    assert_as_on_the_host(batch, hierarchy, runtime)
    assert_consistent(hierarchy, runtime)
    np.testing.assert_array_equal(hierarchy.depth, [4, 0, 1, 3, 0])
    for number, level in enumerate(hierarchy.levels):
        left = level.layout.counts.sum(axis=1)
        np.testing.assert_array_equal(left > 0, number <= hierarchy.depth)
        np.testing.assert_array_equal(left > multigrid.COARSEST, number < hierarchy.depth)


@pytest.mark.parametrize("device", DEVICES)
def test_a_batch_does_not_change_its_systems(device, batch):
    """Each system has the same rows, counted from its first, and the same values, alone and in a batch."""
    runtime = use_runtime(device)
    together = Hierarchy.of(batch, runtime)
    all_rows = runtime.download(together.rows)
    for b, system in enumerate(batch):
        alone = Hierarchy.of([system], runtime)
        rows = all_rows[together.first_node[b] : together.first_node[b + 1]]
        first = together.levels[0].layout.first_row[b, 0]
        np.testing.assert_array_equal(rows - first, runtime.download(alone.rows))
        for level, single in zip(together.levels, alone.levels, strict=False):
            part = slice(*(level.layout.first_tile[b : b + 2] * TILE))
            found, expected = tables(level, runtime), tables(single, runtime)
            weight = found["weight"][[b] if level.fine else part]
            np.testing.assert_array_equal(weight, expected["weight"])
            shifted = found["neighbours"][part] - np.where(found["neighbours"][part] >= 0, part.start, 0)
            np.testing.assert_array_equal(shifted, expected["neighbours"])
            for name in ("diagonal", "mass"):
                np.testing.assert_array_equal(found[name][part], expected[name])


@needs_simulator
@pytest.mark.parametrize("order", ["backward", "shuffled"])
def test_levels_do_not_depend_on_the_order_of_threads(batch, order):
    """Threads and blocks in another order make the same levels."""
    first, second = SimulatedRuntime("forward"), SimulatedRuntime(order)
    for expected, found in zip(
        Hierarchy.of(batch, first).levels, Hierarchy.of(batch, second).levels, strict=True
    ):
        after = tables(found, second)
        for name, values in tables(expected, first).items():
            np.testing.assert_array_equal(after[name], values)


@pytest.mark.parametrize("device", DEVICES)
def test_voxels_that_touch_nothing_merge_in_the_end(device):
    """A lattice of single voxels, of which no two share a block at first, is coarsened to the end."""
    mask = np.zeros((28, 28))
    mask[::2, ::2] = 1
    runtime = use_runtime(device)
    hierarchy = Hierarchy.of([assemble(Shape.from_mask(mask))], runtime)
    assert [int(level.layout.counts.sum()) for level in hierarchy.levels] == [196, 196, 49, 16]
    assert_consistent(hierarchy, runtime)


@pytest.mark.parametrize("device", DEVICES)
def test_finest_level_is_kept_in_double_precision(device, batch):
    """Exact values are those of the systems in units of their least spacing; padding has 1 and 0."""
    runtime = use_runtime(device)
    hierarchy = Hierarchy.of(batch, runtime)
    weights, diagonal, mass = map(runtime.download, hierarchy.exact)
    rows = runtime.download(hierarchy.rows)
    np.testing.assert_array_equal(hierarchy.units, 0.5)
    np.testing.assert_array_equal(hierarchy.counts, [system.n_nodes for system in batch])
    np.testing.assert_array_equal(weights, [[0.25, 0.25, 1.0, 1.0]] * len(batch))
    np.testing.assert_array_equal(diagonal[rows], np.concatenate([s.diagonal for s in batch]) / 4)
    np.testing.assert_array_equal(mass[rows], np.concatenate([s.mass for s in batch]))
    padding = np.delete(np.arange(diagonal.size), rows)
    assert (diagonal[padding] == 1).all()
    assert (mass[padding] == 0).all()


@needs_simulator
@pytest.mark.parametrize(
    ("mask", "slack"),
    [(ball(30, 3), 1.3), (ball(120, 2), 1.2), (np.ones(20_000), 1.1), (ball(12, 4), 1.8), (SIEVE, 1.3)],
    ids=["ball", "disk", "line", "4-D", "sieve"],
)
def test_memory_is_told_in_advance(mask, slack):
    """A device with the bytes told is enough, and little more than what is held afterwards."""
    systems = [assemble(Shape.from_mask(mask))] * 3
    told = hierarchy_bytes(systems)
    runtime = SimulatedRuntime(memory=told.peak)
    hierarchy = Hierarchy.of(systems, runtime)
    held = told.peak - runtime.free_bytes()
    assert held <= told.held <= slack * held
    del hierarchy
    assert runtime.free_bytes() == told.peak


@needs_simulator
def test_a_batch_has_one_dimension(batch):
    """Systems of different dimension, or none, are refused."""
    with pytest.raises(ParameterError, match=r"dimensions \[2, 3\]: expected shapes, all of one"):
        Hierarchy.of([batch[0], assemble(Shape.from_mask(ball(4, 3)))], SimulatedRuntime())
    with pytest.raises(ParameterError, match=r"dimensions \[\]"):
        Hierarchy.of([], SimulatedRuntime())
