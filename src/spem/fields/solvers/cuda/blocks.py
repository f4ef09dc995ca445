"""The blocks of a reduced basis on the device: what they predict, and what a new one has with all."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spem.fields.solvers.cuda.cycle import upload_lists
from spem.fields.solvers.cuda.layout import Layout
from spem.fields.solvers.cuda.levels import Hierarchy
from spem.fields.solvers.cuda.runtime import TILE, Array, Runtime, addresses
from spem.fields.solvers.engine import LANES, Products, Small

# Products are summed over chunks of at least so many tiles, and at most so many chunks a system: blocks of
# threads enough for a device, and few sums to keep.
_CHUNK_TILES, _MOST_CHUNKS = 8, 1024
# Entries that a block of threads of `sum_runs` has.
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
        self.layout, self.neighbours, self._rows = level.layout, level.neighbours, hierarchy.rows
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
        lists = np.flatnonzero(active), self._chunks.of_systems(active), self.layout.tiles(active)
        self.active = active
        self._chosen, self._chosen_chunks, self.tiles = upload_lists(
            self.runtime, [part.astype(np.int32) for part in lists]
        )

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
        tiles = self.runtime.empty((self.layout.n_rows // TILE, LANES), np.float64)
        self._launch_tiles("source_residual", *self._graph, self._upload(shifts), b, v, r, tiles)
        chunks = self._partial(LANES)
        self._sum(self._chosen_chunks, self._chunks.tile, tiles, chunks)
        return self._total(chunks)

    def overlaps(self, x: Array) -> Small:
        """Inner products ``(n_systems, K + LANES, LANES)`` of the basis, then of x, with x."""
        entries = (len(self.arrays) + 1) * LANES * LANES
        found = self._cross("cross", _GROUP, entries, *self._basis, x)
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
        tables = self.layout.tile_system, *self._basis, new, *self._graph
        found = self._cross("cross_operator", _GROUP_OPERATOR[self.dtype], entries, *tables)
        self.arrays.append(new)
        self._table = self.runtime.upload(addresses(self.runtime, self.arrays))
        square, sums = found[:, : -2 * LANES], found[:, -2 * LANES :]
        parts = square.reshape(len(found), -1, 3, LANES, LANES)
        gram, stiffness, mass = (parts[:, :, k].reshape(len(found), -1, LANES) for k in range(3))
        return Products(gram, stiffness, mass, sums[:, :LANES], sums[:, LANES:])

    def project(self, constant: Small, mix: Small) -> Array:
        """Make constant + B·mix of all systems, on the device.

        Parameters
        ----------
        constant
            ``(n_systems, k)``.
        mix
            ``(n_systems, K, k)``.

        Returns
        -------
        ``(n_rows, k)`` float32; padding rows hold the constant.
        """
        return self._project(
            constant, mix, self.runtime.empty((self.layout.n_rows, mix.shape[2]), np.float32)
        )

    def columns(self, mix: Small) -> Array:
        """Make B·mix of all systems in the order of nodes, ``(n_nodes, k)``, in the precision of the basis.

        Parameters
        ----------
        mix
            ``(n_systems, K, k)``.
        """
        n_nodes, runtime = self._rows.size, self.runtime
        place = runtime.empty((self.layout.n_rows,), np.int32)
        place[...] = -1
        place[self._rows] = runtime.xp.arange(n_nodes, dtype=np.int32)
        out = runtime.empty((n_nodes, mix.shape[2]), self.dtype)
        return self._project(np.zeros((len(mix), mix.shape[2])), mix, out, place)

    def _project(self, constant: Small, mix: Small, out: Array, place: Array = None) -> Array:
        """Write constant + B·mix, each row where its place is."""
        if mix.shape[2] == 0:
            return out
        kernel = "project_double" if out.dtype == np.float64 else "project_single"
        mixes = self._upload(constant), self._upload(mix), np.int32(mix.shape[2])
        tables = self.every_tile, self.layout.tile_system, *self._basis, *mixes, place, out
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

    def _cross(self, kernel: str, group: int, entries: int, *arguments: Any) -> Small:
        """Return what a kernel sums over chunks, for so many blocks at a time, summed over systems."""
        groups, chunks = len(self.arrays) // group + 1, self._chosen_chunks
        partial = self._partial(entries)
        self._program.launch(kernel, chunks.size * groups, chunks, self._chunks.tile, *arguments, partial)
        return self._total(partial)

    def _partial(self, entries: int) -> Array:
        """Make room for sums over chunks."""
        return self.runtime.empty((int(self._chunks.first[-1]), entries), np.float64)

    def _total(self, partial: Array) -> Small:
        """Sum over the chunks of each active system, ``(n_systems, entries)``; zeros for the others."""
        found = self.runtime.zeros((self.active.size, partial.shape[1]), np.float64)
        self._sum(self._chosen, self._chunks.first_on_device, partial, found)
        return np.asarray(self.runtime.download(found))

    def _sum(self, runs: Array, first: Array, partial: Array, out: Array) -> None:
        """Sum the rows of each run of a list."""
        entries = partial.shape[1]
        groups = -(-entries // _SUMMED)
        self._program.launch("sum_runs", runs.size * groups, runs, first, partial, np.int32(entries), out)

    def _upload(self, values: Small) -> Array:
        """Small matrices on the device; None where there is nothing."""
        return self.runtime.upload(np.ascontiguousarray(values, np.float64)) if values.size else None
