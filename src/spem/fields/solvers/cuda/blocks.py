"""The blocks of a reduced basis on the device: what they predict, and what a new one has with all."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spem.fields.solvers.cuda.layout import Layout
from spem.fields.solvers.cuda.levels import Hierarchy
from spem.fields.solvers.cuda.runtime import Array, Runtime, addresses
from spem.fields.solvers.engine import LANES, Products, Small

# Products are summed over chunks of at least so many tiles, and at most so many chunks a system: blocks of
# threads enough for a device, and few sums to keep.
_CHUNK_TILES, _MOST_CHUNKS = 8, 1024
# Entries that a block of threads of `sum_chunks` has.
_SUMMED = 32
# As GROUP in blocks.cu.
_GROUP, _GROUP_OPERATOR = 4, {np.dtype(np.float32): 2, np.dtype(np.float64): 1}

Flags = NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class Chunks:
    """Runs of tiles over which products are summed; how a system is cut depends on it alone.

    Parameters
    ----------
    first
        ``(n_systems + 1,)`` chunks of system b are ``first[b]`` to ``first[b + 1] - 1``.
    first_on_device
        The same as int32 on the device.
    tile
        ``(n_chunks + 1,)`` int32 on the device: first tile of each chunk, and the number of tiles.
    """

    first: NDArray[np.int64]
    first_on_device: Array
    tile: Array

    @classmethod
    def of(cls, layout: Layout, runtime: Runtime) -> Chunks:
        """Cut the tiles of each system."""
        tiles = np.diff(layout.first_tile)
        length = np.maximum(_CHUNK_TILES, -(-tiles // _MOST_CHUNKS))
        counts = -(-tiles // length)
        first = np.concatenate([[0], np.cumsum(counts)])
        within = np.arange(first[-1]) - np.repeat(first[:-1], counts)
        start = np.repeat(layout.first_tile[:-1], counts) + within * np.repeat(length, counts)
        tile = np.append(start, layout.first_tile[-1]).astype(np.int32)
        return cls(first, runtime.upload(first.astype(np.int32)), runtime.upload(tile))

    def of_systems(self, active: Flags) -> NDArray[np.int32]:
        """List the chunks of some systems."""
        return np.flatnonzero(np.repeat(active, np.diff(self.first))).astype(np.int32)


class Blocks:
    """Blocks of `LANES` columns of a batch of systems.

    Parameters
    ----------
    hierarchy
        Levels of the systems.
    dtype
        Precision that columns are stored in.
    runtime
        The device.

    Attributes
    ----------
    arrays
        Of each block ``(n_rows + 1, LANES)`` on the device, zero for systems that were not active.
    """

    def __init__(self, hierarchy: Hierarchy, dtype: type[np.floating[Any]], runtime: Runtime) -> None:
        level = hierarchy.levels[0]
        self.dtype, self.runtime, self.exact = np.dtype(dtype), runtime, hierarchy.exact
        self.layout, self.neighbours = level.layout, level.neighbours
        self._program = runtime.program(
            "blocks.cu", DIM=level.neighbours.shape[1] // 2, WIDE=int(self.dtype == np.float64)
        )
        self._chunks = Chunks.of(level.layout, runtime)
        every = np.ones(hierarchy.counts.size, bool)
        self.every_tile = runtime.upload(level.layout.tiles(every))
        self.arrays: list[Array] = []
        self._table: Array = None
        self.select(every)

    def select(self, active: Flags) -> None:
        """Work on these systems only, ``(n_systems,)``."""
        systems = np.flatnonzero(active).astype(np.int32)
        self.active = active
        self.tiles = self.runtime.upload(self.layout.tiles(active))
        self._lists = self.runtime.upload(systems), self.runtime.upload(self._chunks.of_systems(active))

    @property
    def n_columns(self) -> int:
        """Number K of columns."""
        return LANES * len(self.arrays)

    @property
    def shape(self) -> tuple[int, int]:
        """Shape of a block, and of all vectors."""
        return self.layout.n_rows + 1, LANES

    def predict(self, mix: Small, u: Array) -> None:
        """Write u = B·mix, ``(n_rows + 1, LANES)`` float64, of mix ``(n_systems, K, LANES)``."""
        self._launch_tiles("predict", *self._basis, self._upload(mix), np.int32(self.layout.n_rows), u)

    def residual(self, u: Array, r: Array, shifts: Small) -> None:
        """Write r = s M (1 − u) − A u, float32, computed in double precision."""
        self._launch_tiles("deficit_residual", *self._graph, self._upload(shifts), u, r)

    def advance(self, x: Array, v: Array) -> None:
        """Add x to v, float64."""
        self._program.launch("advance_solution", self.tiles.size, self.tiles, x, v)

    def source_residual(self, b: Array, v: Array, r: Array, shifts: Small) -> Small:
        """Write r = b − (A + s M) v, float32, and return r·r in double precision, ``(n_systems, LANES)``."""
        tables = self.layout.tile_system, *self._graph, self._upload(shifts)
        return self._sum("source_residual", 1, LANES, *tables, b, v, r)

    def overlaps(self, x: Array) -> Small:
        """Inner products ``(n_systems, K + LANES, LANES)`` of the basis, then of x, with x."""
        entries = (len(self.arrays) + 1) * LANES * LANES
        found = self._sum("cross", self._groups(_GROUP), entries, *self._basis, x)
        return found.reshape(len(found), -1, LANES)

    def append(self, x: Array, mix: Small, remove: Small) -> Products:
        """Append the block x·mix + B·remove, and return its products with all blocks.

        Parameters
        ----------
        x
            ``(n_rows + 1, LANES)`` float32.
        mix
            ``(n_systems, LANES, LANES)``.
        remove
            ``(n_systems, K, LANES)``.
        """
        new = self.runtime.zeros(self.shape, self.dtype)
        mixes = self._upload(mix), *self._basis, self._upload(remove)
        self._launch_tiles("make_block", x, *mixes, new)
        entries = (len(self.arrays) + 1) * 3 * LANES * LANES + 2 * LANES
        groups = self._groups(_GROUP_OPERATOR[self.dtype])
        tables = self.layout.tile_system, *self._basis, new, *self._graph
        found = self._sum("cross_operator", groups, entries, *tables)
        self.arrays.append(new)
        self._table = self.runtime.upload(addresses(self.runtime, self.arrays))
        square, sums = found[:, : -2 * LANES], found[:, -2 * LANES :]
        parts = square.reshape(len(found), -1, 3, LANES, LANES)
        wide = (parts[:, :, product].reshape(len(found), -1, LANES) for product in range(3))
        return Products(*wide, sums[:, :LANES], sums[:, LANES:])

    def project(self, constant: Small, mix: Small, dtype: Any = np.float32) -> Array:
        """Make constant + B·mix of all systems, on the device.

        Parameters
        ----------
        constant
            ``(n_systems, k)``.
        mix
            ``(n_systems, K, k)``.
        dtype
            Precision of the answer.

        Returns
        -------
        ``(n_rows, k)`` in `dtype`; padding rows hold the constant.
        """
        width = mix.shape[2]
        out = self.runtime.empty((self.layout.n_rows, width), dtype)
        if width == 0:
            return out
        kernel = "project_double" if np.dtype(dtype) == np.float64 else "project_single"
        mixes = self._upload(constant), self._upload(mix)
        tables = self.every_tile, self.layout.tile_system, *self._basis, *mixes, np.int32(width), out
        self._program.launch(kernel, self.every_tile.size, *tables)
        return out

    @property
    def _basis(self) -> tuple[Array, np.int32]:
        """Table of the addresses of the blocks, and their number."""
        return self._table, np.int32(len(self.arrays))

    @property
    def _graph(self) -> tuple[Array, ...]:
        """The operator in double precision, as kernels take it."""
        return self.neighbours, *self.exact

    def _launch_tiles(self, kernel: str, *arguments: Any) -> None:
        """Launch a kernel of one block of threads a tile."""
        self._program.launch(kernel, self.tiles.size, self.tiles, self.layout.tile_system, *arguments)

    def _groups(self, size: int) -> int:
        """Count the groups of the blocks and one more."""
        return len(self.arrays) // size + 1

    def _sum(self, kernel: str, groups: int, entries: int, *arguments: Any) -> Small:
        """Sum over systems, ``(n_systems, entries)``, what a kernel sums over chunks in groups of entries."""
        systems, chunks = self._lists
        partial = self.runtime.empty((int(self._chunks.first[-1]), entries), np.float64)
        found = self.runtime.zeros((self.active.size, entries), np.float64)
        self._program.launch(kernel, chunks.size * groups, chunks, self._chunks.tile, *arguments, partial)
        width = -(-entries // _SUMMED)
        tables = systems, self._chunks.first_on_device, partial, np.int32(entries), found
        self._program.launch("sum_chunks", systems.size * width, *tables)
        return np.asarray(self.runtime.download(found))

    def _upload(self, values: Small) -> Array:
        """Small matrices on the device; None where there is nothing."""
        return self.runtime.upload(np.ascontiguousarray(values)) if values.size else None
