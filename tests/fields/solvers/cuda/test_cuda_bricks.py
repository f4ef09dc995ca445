"""The order of rows."""

from __future__ import annotations

import numpy as np
import pytest
from backends import needs_simulator
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from simulator import SimulatedRuntime

from spem.fields.operator import assemble
from spem.fields.solvers.cuda.bricks import brick_side, first_cells, lay_out
from spem.fields.solvers.cuda.levels import Hierarchy
from spem.fields.solvers.cuda.runtime import TILE
from spem.shapes.shape import Shape

pytestmark = needs_simulator


@settings(max_examples=20, deadline=None)
@given(st.integers(1, 4), st.integers(0, 2**32 - 1))
def test_marked_cells_are_numbered_within_system_and_colour(d, seed):
    """The n-th marked cell of a system and colour has the n-th row of these."""
    rng = np.random.default_rng(seed)
    grid = rng.integers(1, 20, (4, d))
    cells = first_cells(grid, rng.random(4) < 0.8)
    assume(cells[-1] > 0)
    marks = (rng.random(cells[-1]) < rng.random()).astype(np.int8)
    runtime = SimulatedRuntime()
    layout, n_marked, base = lay_out(runtime.upload(marks), cells, runtime)
    n_marked, base = runtime.download(n_marked), runtime.download(base)
    for b, colour in np.ndindex(4, 2):
        marked = np.flatnonzero(marks[cells[2 * b + colour] : cells[2 * b + colour + 1]])
        row = base[b, colour] + n_marked[cells[2 * b + colour] + marked]
        np.testing.assert_array_equal(row, layout.first_row[b, colour] + np.arange(marked.size))
        assert layout.counts[b, colour] == marked.size


@pytest.mark.parametrize(
    ("d", "side", "most"), [(1, 3000, 1.01), (2, 160, 1.36), (3, 40, 2.2), (4, 14, 3.2)], ids=str
)
def test_tiles_are_compact(d, side, most):
    """A tile in a solid box gathers few other rows for each of its own."""
    runtime = SimulatedRuntime()
    level = Hierarchy.of([assemble(Shape.from_mask(np.ones((side,) * d)))], runtime).levels[0]
    neighbours = runtime.download(level.neighbours)
    tiles = level.layout.tiles(np.array([True]), "red")[:-1]
    gathered = [np.unique(neighbours[tile * TILE : (tile + 1) * TILE]) for tile in tiles]
    counts = [np.sum(rows < level.layout.n_rows) for rows in gathered]
    assert np.mean(counts) <= most * TILE


def test_colours_share_a_brick():
    """Bricks have whole tiles of either colour."""
    for d in (1, 2, 3, 4):
        assert brick_side(d) ** d % (2 * TILE) == 0
