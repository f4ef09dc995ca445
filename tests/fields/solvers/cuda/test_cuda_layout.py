"""Rows by system and colour, in whole tiles."""

from __future__ import annotations

import numpy as np
import pytest
from backends import needs_simulator
from hypothesis import given, settings
from hypothesis import strategies as st
from simulator import SimulatedRuntime

from spem.errors import SizeError
from spem.fields.solvers.cuda.layout import Layout
from spem.fields.solvers.cuda.runtime import TILE

pytestmark = needs_simulator

few = st.integers(0, 3 * TILE)
counts_of_systems = st.lists(st.tuples(few, few), min_size=1, max_size=6).map(np.array)


@settings(max_examples=30, deadline=None)
@given(counts_of_systems)
def test_every_node_has_a_row_of_its_own(counts):
    """Nodes of a system and colour stand in its tiles, padding after them, and no two share a row."""
    runtime = SimulatedRuntime()
    layout = Layout.of(counts, runtime)
    system = runtime.download(layout.tile_system)
    taken = np.zeros(layout.n_rows, int)
    for b, row in np.ndindex(counts.shape):
        first = layout.first_row[b, row]
        nodes = np.arange(first, first + counts[b, row])
        taken[nodes] += 1
        assert (system[nodes // TILE] == b).all()
        assert ((nodes // TILE < layout.middle_tile[b]) == (row == 0)).all()
    assert taken.max(initial=0) <= 1
    assert layout.n_rows == system.size * TILE == layout.first_tile[-1] * TILE
    assert layout.n_rows - counts.sum() <= (TILE - 1) * np.count_nonzero(counts)


@settings(max_examples=30, deadline=None)
@given(counts_of_systems, st.data())
def test_lists_the_tiles_of_active_systems(counts, data):
    """Red and black tiles together are all tiles of the active systems, ascending, and of no other."""
    runtime = SimulatedRuntime()
    layout = Layout.of(counts, runtime)
    active = np.array(data.draw(st.lists(st.booleans(), min_size=len(counts), max_size=len(counts))))
    every, red, black = (layout.tiles(active, colour) for colour in ("all", "red", "black"))
    system = runtime.download(layout.tile_system)
    np.testing.assert_array_equal(every, np.flatnonzero(active[system]))
    np.testing.assert_array_equal(np.sort(np.concatenate([red, black])), every)
    assert (red < layout.middle_tile[system[red]]).all()
    assert (black >= layout.middle_tile[system[black]]).all()
    assert every.dtype == red.dtype == black.dtype == np.int32


def test_rows_have_32_bit_numbers():
    """More rows than 32 bits can number are refused with their number."""
    with pytest.raises(SizeError, match=r"2,147,483,800 nodes .* expected fewer than 2\*\*31"):
        Layout.of(np.array([[2**31 - 148, 300]]), SimulatedRuntime())
