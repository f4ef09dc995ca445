"""The symmetric V-cycle of a batch of systems: the preconditioner of the sweep on a device.

Large levels are done by four kernels each, the rest of a system by one block of threads, from the first of
its levels that is small. Where that is depends on the system alone, so its answers do not depend on what else
is in the batch.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import chain
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spem.fields.solvers.cuda.levels import Hierarchy, Level
from spem.fields.solvers.cuda.runtime import TILE, Array, Runtime
from spem.fields.solvers.engine import LANES, Small
from spem.fields.solvers.multigrid import COARSEST

# A system's levels of at most so many tiles are left to one block: its passes over a few tiles take about as
# long as launches of their own would. An estimate: it was never measured on a device.
TAIL_TILES = 8

Flags = NDArray[np.bool_]


class Cycle:
    """An approximate inverse of A + s M for each lane of each system, symmetric positive definite.

    Parameters
    ----------
    hierarchy
        Levels of the systems.
    runtime
        The device.
    tail_tiles
        Levels of a system that have no more tiles are left to one block of threads.

    Attributes
    ----------
    shift
        ``(n_systems * LANES,)`` float32 on the device: the shifts of the last `prepare`.
    partial
        ``(n_tiles, LANES)`` float64 on the device: r·z of each tile of active systems, after `apply`.
    """

    def __init__(self, hierarchy: Hierarchy, runtime: Runtime, tail_tiles: int = TAIL_TILES) -> None:
        levels = hierarchy.levels
        self.hierarchy, self.runtime = hierarchy, runtime
        self._program = runtime.program("cycle.cu", DIM=levels[0].neighbours.shape[1] // 2)
        count = len(hierarchy.depth)
        shapes = [(level.layout.n_rows + 1, LANES) for level in levels[1:]]
        self._r = [None, *(runtime.zeros(shape, np.float32) for shape in shapes)]
        self._z = [None, *(runtime.zeros(shape, np.float32) for shape in shapes)]
        self.partial = runtime.empty((levels[0].layout.n_rows // TILE, LANES), np.float64)
        self.shift = runtime.zeros(count * LANES, np.float32)
        self._inverse = runtime.empty(count * COARSEST**2 * LANES, np.float32)
        self._launches: tuple[Array, Array, list[Callable[[], None]]] | None = None
        self._active: Flags | None = None
        self._entry = _entries(hierarchy, tail_tiles)
        self._tables = runtime.upload(self._addresses())
        ranges = np.stack([_ranges(level) for level in levels]).astype(np.int32)
        self._places = runtime.upload(ranges), np.int32(count)
        self._bounds = tuple(runtime.upload(part.astype(np.int32)) for part in (self._entry, hierarchy.depth))

    def prepare(self, shifts: Small, active: Flags) -> None:
        """Take the shifts of a round, and invert the coarsest matrices of active systems.

        Parameters
        ----------
        shifts
            ``(n_systems, LANES)`` in units of the hierarchy.
        active
            ``(n_systems,)`` as for `select`.
        """
        self.shift = self.runtime.upload(shifts.astype(np.float32).ravel())
        self._launches = None
        self.select(active)
        systems, (_, depth) = self._systems, self._bounds
        self._program.launch(
            "cycle_invert",
            systems.size * LANES,
            *(systems, self._tables, *self._places, depth, self.shift, self._inverse),
        )

    def select(self, active: Flags) -> None:
        """Work on these systems only, ``(n_systems,)``; they have been active in the last `prepare`."""
        if self._active is not None and np.array_equal(active, self._active):
            return
        self._active = active.copy()
        levels = self.hierarchy.levels
        top = int(self._entry[active].max(initial=0))
        lists = [np.flatnonzero(active).astype(np.int32)]
        for depth in range(top):
            here = active & (self._entry > depth)
            layout, coarse = levels[depth].layout, levels[depth + 1].layout
            lists += [layout.tiles(here, "red"), layout.tiles(here, "black"), coarse.tiles(here, "all")]
        self._systems, *tiles = upload_lists(self.runtime, lists)
        self._tiles = [tuple(tiles[k : k + 3]) for k in range(0, len(tiles), 3)]
        self._launches = None

    def apply(self, r: Array, z: Array) -> None:
        """Write the cycle's answer to r into z, and r·z of each tile into `partial`.

        Parameters
        ----------
        r, z
            ``(n_rows + 1, LANES)`` float32 vectors of the finest level.
        """
        if self._launches is None or self._launches[0] is not r or self._launches[1] is not z:
            self._launches = r, z, self._bind(r, z)
        for launch in self._launches[2]:
            launch()

    def _bind(self, r: Array, z: Array) -> list[Callable[[], None]]:
        """Check the launches of a cycle once: it is run dozens of times between two choices of systems."""
        residuals, answers = [r, *self._r[1:]], [z, *self._z[1:]]
        depths = range(len(self._tiles))
        down = [self._descend(depth, residuals, answers) for depth in depths]
        up = [self._ascend(depth, residuals, answers) for depth in reversed(depths)]
        tail = self._program.bind(
            "cycle_tail",
            self._systems.size,
            *(self._systems, self._tables, *self._places, *self._bounds),
            *(self.shift, self._inverse, r, z, self.partial),
        )
        return [*chain(*down), tail, *chain(*up)]

    def _descend(
        self, depth: int, residuals: Sequence[Array], answers: Sequence[Array]
    ) -> tuple[Callable[[], None], ...]:
        level, coarse = self.hierarchy.levels[depth : depth + 2]
        _, black, above = self._tiles[depth]
        n_rows, fine = np.int32(level.layout.n_rows), np.int32(depth == 0)
        down = self._program.bind(
            "cycle_down",
            black.size,
            *(black, level.layout.tile_system, *_graph(level), n_rows, fine, self.shift),
            *(residuals[depth], answers[depth]),
        )
        restrict = self._program.bind(
            "cycle_restrict",
            above.size,
            *(above, coarse.layout.tile_system, coarse.children, level.neighbours, level.weight),
            *(n_rows, fine, answers[depth], residuals[depth + 1]),
        )
        return down, restrict

    def _ascend(
        self, depth: int, residuals: Sequence[Array], answers: Sequence[Array]
    ) -> tuple[Callable[[], None], ...]:
        level, coarse = self.hierarchy.levels[depth : depth + 2]
        red, black, _ = self._tiles[depth]
        n_rows, fine = np.int32(level.layout.n_rows), np.int32(depth == 0)
        common = level.layout.tile_system, *_graph(level), n_rows, fine, self.shift
        n_coarse = np.int32(coarse.layout.n_rows)
        own = residuals[depth], answers[depth], self.partial
        relax_black = self._program.bind(
            "cycle_black",
            black.size,
            *(black, *common, level.parent, n_coarse, answers[depth + 1], *own),
        )
        return relax_black, self._program.bind("cycle_red", red.size, red, *common, *own)

    def _addresses(self) -> NDArray[np.int64]:
        """Rows of `Table` in cycle.cu."""
        levels = self.hierarchy.levels
        rows = []
        for depth, level in enumerate(levels):
            coarse = levels[depth + 1] if depth + 1 < len(levels) else None
            children = coarse.children if coarse else None
            arrays = (*_graph(level), level.parent, children, self._r[depth], self._z[depth])
            places = [0 if array is None else self.runtime.address(array) for array in arrays]
            rows.append([*places, level.layout.n_rows, coarse.layout.n_rows if coarse else 0])
        return np.array(rows, np.int64)


def cycle_bytes(hierarchy: Hierarchy) -> int:
    """Bytes that one cycle for all systems must move: each pass reads its inputs, and writes, once."""
    levels, row = hierarchy.levels, 4 * LANES
    width = levels[0].neighbours.shape[1]
    total = 0
    for depth, level in enumerate(levels):
        last = hierarchy.depth == depth
        nodes = level.layout.counts[last].sum(axis=1)
        total += int(np.sum(4 * LANES * nodes**2 + 2 * row * nodes))  # inverse, r; z
        red, black = level.layout.counts[~last].sum(axis=0).tolist()
        if red + black == 0:
            continue
        above = int(levels[depth + 1].layout.counts.sum())
        star = 4 * width if level.fine else 8 * width  # neighbours, and weights where rows have their own
        total += (red + black) * (row + 8) + black * (star + row)  # down: r, diagonal, mass; z
        total += red * star + black * row + above * (4 * 2 ** (width // 2) + row)  # children; r of blocks
        total += above * row + red * 4 + black * (star + 8 + (3 if level.fine else 2) * row)  # parents; z
        total += black * row + red * (star + 8 + 2 * row)  # r; z
    return total


def upload_lists(runtime: Runtime, lists: Sequence[NDArray[np.int32]]) -> list[Array]:
    """Upload int32 lists of tiles or systems in one transfer; the views of them on the device."""
    together = runtime.upload(np.concatenate(lists))
    ends = np.cumsum([part.size for part in lists]).tolist()
    return [together[start:end] for start, end in zip([0, *ends], ends, strict=False)]


def _graph(level: Level) -> tuple[Any, ...]:
    """Arrays of a level's operator, as kernels take them."""
    return level.neighbours, level.weight, level.diagonal, level.mass


def _entries(hierarchy: Hierarchy, tail_tiles: int) -> NDArray[np.int64]:
    """First level of each system that is left to one block."""
    tiles = np.stack([np.diff(level.layout.first_tile) for level in hierarchy.levels])
    return np.asarray(np.minimum(np.sum(tiles > tail_tiles, axis=0), hierarchy.depth))


def _ranges(level: Level) -> NDArray[np.int64]:
    """``(n_systems, 5)`` as `Range` in cycle.cu: first, middle and end tile, red and black nodes."""
    layout = level.layout
    tiles = layout.first_tile[:-1], layout.middle_tile, layout.first_tile[1:]
    return np.column_stack([*tiles, layout.counts])
