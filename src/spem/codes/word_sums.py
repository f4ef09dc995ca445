"""Sums over the nodes of each word (5.1), (5.2) of many shapes at once, on a device."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from spem.codes.part import Part
from spem.codes.vocabulary import Residuals
from spem.errors import ParameterError
from spem.fields.solvers.cuda.engine import CudaEngine
from spem.fields.solvers.cuda.runtime import THREADS, TILE, Array, Program, Runtime

_SOURCE = "spem.codes.cuda/vlad.cu"
# Tiles of one chunk: enough rows that their sums are few against them, and chunks enough to fill a device.
_CHUNK = 16

Kept = NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class Rows:
    """Which rows of a table are nodes of which shape, and which of them count.

    Parameters
    ----------
    n_rows
        Number of rows; each tile of them belongs to one shape.
    n_shapes, n_chunks
        Number of shapes, and of chunks of tiles that sums are taken over first.
    tile_shape
        ``(n_tiles,)`` int32 on the device: the shape of each tile.
    kept
        ``(n_rows,)`` uint8 on the device: 1 for nodes that count.
    n_kept
        ``(n_shapes,)`` int32 on the device: how many do.
    first_row
        ``(n_chunks + 1,)`` int32 on the device: chunk c has the rows from ``first_row[c]`` to before
        ``first_row[c + 1]``.
    first_chunk
        ``(n_shapes + 1,)`` int32 on the device: shape b has the chunks from ``first_chunk[b]`` to before
        ``first_chunk[b + 1]``.
    """

    n_rows: int
    n_shapes: int
    n_chunks: int
    tile_shape: Array
    kept: Array
    n_kept: Array
    first_row: Array
    first_chunk: Array

    @classmethod
    def of(cls, engine: CudaEngine, kept: Sequence[Kept]) -> Rows:
        """Find the rows of the nodes of an engine's systems.

        Parameters
        ----------
        engine
            The engine, on a device.
        kept
            For each system ``(n_nodes,)`` whether a node counts.
        """
        runtime, hierarchy = engine.runtime, engine.hierarchy
        layout = hierarchy.levels[0].layout
        chosen = runtime.zeros(layout.n_rows, np.uint8)
        chosen[hierarchy.rows] = runtime.upload(np.concatenate(kept).astype(np.uint8))
        tiles = np.diff(layout.first_tile)
        first = np.concatenate([np.zeros(1, np.int64), np.cumsum(-(-tiles // _CHUNK))])
        starts = [
            np.arange(a, b, _CHUNK) for a, b in zip(layout.first_tile, layout.first_tile[1:], strict=False)
        ]
        rows = np.concatenate([*starts, layout.first_tile[-1:]]) * TILE
        counts = np.array([each.sum() for each in kept], np.int32)
        tables = (runtime.upload(each.astype(np.int32)) for each in (counts, rows, first))
        return cls(layout.n_rows, len(kept), int(first[-1]), layout.tile_system, chosen, *tables)


@dataclass(frozen=True, eq=False)
class WordSums:
    """Sums the differences of the nodes of shapes from their words, and their squares, level by level.

    Parameters
    ----------
    rows
        Which rows are nodes of which shape.
    runtime
        The device.
    program
        Kernels for so many maps, words and levels.
    learnt
        Mean and transform of the normalisation, in single precision, on the device.
    centers
        ``(n_centers, n_maps)`` float32 words on the device.
    cuts
        ``(n_levels - 1,)`` float64 values between levels on the device, at least one number.
    n_bins
        Number of levels times number of words.
    """

    rows: Rows
    runtime: Runtime
    program: Program
    learnt: tuple[Array, Array]
    centers: Array
    cuts: Array
    n_bins: int

    @classmethod
    def of(cls, part: Part, band: int, rows: Rows, runtime: Runtime) -> WordSums:
        """Bring what was learnt of one band of maps to a device.

        Raises
        ------
        ParameterError
            When there are more maps than a block of the device has threads.
        """
        n_centers, n_maps = part.centers[band].shape
        if n_maps > THREADS:
            msg = f"n_maps={n_maps}: a device codes at most {THREADS}; take fewer, or no device"
            raise ParameterError(msg)
        cuts = part.cuts[band] if part.cuts else np.empty(0)
        normal = part.normalisations[band]
        mean, transform, centers = (
            runtime.upload(np.ascontiguousarray(each, np.float32))
            for each in (normal.mean, normal.transform, part.centers[band])
        )
        return cls(
            rows,
            runtime,
            runtime.program(_SOURCE, N_MAPS=n_maps, N_CENTERS=n_centers, N_CUTS=cuts.size),
            (mean, transform),
            centers,
            runtime.upload(np.append(cuts, np.inf).astype(np.float64)),
            (cuts.size + 1) * n_centers,
        )

    def __call__(self, maps: Array) -> list[Residuals]:
        """Sum over the nodes of each shape.

        Parameters
        ----------
        maps
            ``(n_rows, n_maps)`` float32 maps on the device; features are left in their place.

        Returns
        -------
        list
            For each shape what `spem.codes.vocabulary.sum_residuals` returns.
        """
        rows, launch = self.rows, self.program.launch
        bins = self._find_words(maps)
        counts, sums = self._tables(rows.n_chunks)
        blocks = -(-self.n_bins * maps.shape[1] // THREADS)
        launch("chunk_sums", rows.n_chunks * blocks, maps, bins, rows.first_row, self.centers, counts, sums)
        totals = self._tables(rows.n_shapes)
        launch("shape_sums", rows.n_shapes * blocks, counts, sums, rows.first_chunk, *totals)
        found = zip(*(self.runtime.download(total) for total in totals), strict=True)
        return [Residuals(number.astype(np.int64), total, squares) for number, (total, squares) in found]

    def _find_words(self, maps: Array) -> Array:
        """Make features of maps, in place, and return the bin of each row."""
        rows, launch = self.rows, self.program.launch
        chunks = maps, rows.kept, rows.first_row
        partial = self.runtime.empty((rows.n_chunks, maps.shape[1]), np.float64)
        peak, rms = (self.runtime.empty((rows.n_shapes, maps.shape[1]), np.float32) for _ in range(2))
        launch("chunk_peaks", rows.n_chunks, *chunks, partial)
        launch("shape_peaks", rows.n_shapes, partial, rows.first_chunk, peak)
        launch(
            "chunk_squares", rows.n_chunks, maps, rows.kept, rows.first_row, rows.tile_shape, peak, partial
        )
        launch("shape_rms", rows.n_shapes, partial, rows.first_chunk, rows.n_kept, rms)
        bins = self.runtime.empty(rows.n_rows, np.int32)
        known = peak, rms, *self.learnt, self.centers, self.cuts
        n_blocks, n_rows = -(-rows.n_rows // THREADS), np.int32(rows.n_rows)
        launch("find_words", n_blocks, maps, rows.kept, n_rows, rows.tile_shape, *known, bins)
        return bins

    def _tables(self, count: int) -> tuple[Array, Array]:
        """Make room for the counts of so many chunks or shapes, and for their sums and sums of squares."""
        n_maps = self.centers.shape[1]
        return (
            self.runtime.empty((count, self.n_bins), np.int32),
            self.runtime.empty((count, 2, self.n_bins, n_maps), np.float64),
        )
