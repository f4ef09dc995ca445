"""Multigrid levels of a batch of systems, made on the device: the host's hierarchy in rows by colour."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from spem.errors import ParameterError
from spem.fields.operator import System
from spem.fields.solvers.cuda.bricks import brick_side, first_cells, lay_out
from spem.fields.solvers.cuda.layout import Layout
from spem.fields.solvers.cuda.runtime import THREADS, Program, Runtime
from spem.fields.solvers.cuda.uploads import upload_joined
from spem.fields.solvers.multigrid import COARSEST


@dataclass(frozen=True, eq=False)
class Level:
    """One graph of the batch and the maps to the levels next to it, on the device.

    Its edges join red and black rows only. Rows that a node lacks are the dummy row, ``n_rows`` of the level
    that the row is of; padding rows have none but dummy neighbours, diagonal 1 and mass 0.

    Parameters
    ----------
    layout
        Which rows are whose.
    neighbours
        ``(n_rows, 2 d)`` int32 rows of the neighbours.
    weight
        float32 weights of edges: ``(n_systems, 2 d)`` on the finest level, ``(n_rows, 2 d)`` on others.
    fine
        Whether this is the finest level.
    diagonal, mass
        ``(n_rows,)`` float32 diagonals of A and M, A in units of 1/`Hierarchy.units`².
    parent
        ``(n_rows,)`` int32 row of the next level; its dummy row for padding and for systems that end here.
        None on the last level.
    children
        ``(n_rows, 2**d)`` int32 rows of the finer level, by their place in the block, C order. None on the
        finest level.
    """

    layout: Layout
    neighbours: Any
    weight: Any
    fine: bool
    diagonal: Any
    mass: Any
    parent: Any = None
    children: Any = None


class Exact(NamedTuple):
    """The finest level in double precision, on the device.

    Parameters
    ----------
    weights
        ``(n_systems, 2 d)`` weights of edges.
    diagonal, mass
        ``(n_rows,)`` diagonals of A and M.
    """

    weights: Any
    diagonal: Any
    mass: Any


@dataclass(frozen=True, eq=False)
class Hierarchy:
    """Levels from fine to coarse of a batch of systems; A in units of the least spacing of each.

    Blocks of 2^d voxels merge until a system has at most `COARSEST` nodes: that is its last level, and later
    ones have no rows of it.

    Parameters
    ----------
    levels
        From the finest on.
    depth
        ``(n_systems,)`` number of the coarsest level of each system.
    units
        ``(n_systems,)`` least spacing of each system, the length that A is scaled by.
    counts
        ``(n_systems,)`` number of nodes of each system.
    exact
        The finest graph in double precision.
    rows
        ``(n_nodes,)`` int32 on the device: the row of each node of system 0, of system 1, ...
    first_node
        ``(n_systems + 1,)`` first node of each system among all, and their number.
    """

    levels: tuple[Level, ...]
    depth: NDArray[np.int64]
    units: NDArray[np.float64]
    counts: NDArray[np.int64]
    exact: Exact
    rows: Any
    first_node: NDArray[np.int64]

    @classmethod
    def of(cls, systems: Sequence[System], runtime: Runtime) -> Hierarchy:
        """Coarsen systems of one dimension.

        Raises
        ------
        ParameterError
            When there is no system, or they differ in dimension.
        SizeError
            When the rows are too many for their 32-bit numbers.
        """
        batch = _Batch.of(systems, runtime)
        level, rows, exact, stage = batch.finest()
        levels = [level]
        depth = np.zeros(len(systems), np.int64)
        while (large := levels[-1].layout.counts.sum(axis=1) > COARSEST).any():
            levels[-1], coarse, stage = batch.coarsen(levels[-1], stage, large)
            depth[large] = len(levels)
            levels.append(coarse)
        counts = np.diff(batch.first_node)
        return cls(tuple(levels), depth, batch.units, counts, exact, rows, batch.first_node)


class _Stage(NamedTuple):
    """Where the rows of a level lie in the grids: what the next level is made from."""

    grid: NDArray[np.int32]  # (n_systems, d)
    position: Any  # (n_rows,) flat index in the grid, -1 for padding


@dataclass(frozen=True, eq=False)
class _Batch:
    """The systems of a hierarchy while it is made."""

    systems: Sequence[System]
    runtime: Runtime
    program: Program
    units: NDArray[np.float64]
    first_node: NDArray[np.int64]

    @classmethod
    def of(cls, systems: Sequence[System], runtime: Runtime) -> _Batch:
        dimensions = sorted({system.shape.ndim for system in systems})
        if len(dimensions) != 1:
            msg = f"a batch of shapes of dimensions {dimensions}: expected shapes, all of one dimension"
            raise ParameterError(msg)
        units = np.array([min(system.shape.spacing) for system in systems])
        first = np.cumsum([0, *(system.n_nodes for system in systems)], dtype=np.int64)
        program = runtime.program("levels.cu", DIM=dimensions[0])
        return cls(systems, runtime, program, units, first)

    @property
    def n_nodes(self) -> int:
        """Number of nodes of all systems."""
        return int(self.first_node[-1])

    def finest(self) -> tuple[Level, Any, Exact, _Stage]:
        """Return the finest level, the row of each node, the level in double precision and its positions."""
        first = self.runtime.upload(self.first_node)
        layout, rows, stage = self._number(first)
        neighbours = self._neighbours(layout, rows, first)
        scale = np.square(self.units)
        weights = np.stack([np.repeat(system.weights, 2) for system in self.systems]) * scale[:, None]
        diagonal, diagonal_single = self._values([s.diagonal for s in self.systems], scale, layout, rows, 1)
        mass, mass_single = self._values([s.mass for s in self.systems], np.ones_like(scale), layout, rows, 0)
        single = self.runtime.upload(weights.astype(np.float32))
        level = Level(layout, neighbours, single, True, diagonal_single, mass_single)
        return level, rows, Exact(self.runtime.upload(weights), diagonal, mass), stage

    def _number(self, first: Any) -> tuple[Layout, Any, _Stage]:
        """Lay out the finest level: rows of nodes, and voxels of rows."""
        runtime, n = self.runtime, np.int64(self.n_nodes)
        grid = np.array([system.shape.mask.shape for system in self.systems], np.int32)
        first_cell = first_cells(grid, np.ones(len(grid), np.bool_))
        voxels = upload_joined(runtime, (system.shape.voxels for system in self.systems), self.n_nodes)
        brick = np.int32(brick_side(grid.shape[1]))
        where = voxels, first, runtime.upload(grid), runtime.upload(first_cell), brick
        sizes = np.int32(len(grid)), n
        marks = runtime.zeros((int(first_cell[-1]),), np.int8)
        self._launch("mark_nodes", int(n), *where, *sizes, marks)
        layout, n_marked, base = lay_out(marks, first_cell, runtime)
        del marks
        rows = runtime.empty((int(n),), np.int32)
        position = _filled(runtime, (layout.n_rows,), np.int64, -1)
        self._launch("number_nodes", int(n), *where, n_marked, base, *sizes, rows, position)
        return layout, rows, _Stage(grid, position)

    def _neighbours(self, layout: Layout, rows: Any, first: Any) -> Any:
        """Neighbour table of the finest level."""
        runtime, n, dummy = self.runtime, self.n_nodes, np.int32(layout.n_rows)
        found = upload_joined(runtime, (system.domain.neighbours for system in self.systems), n)
        width = found.shape[1]
        table = _filled(runtime, (layout.n_rows, width), np.int32, layout.n_rows)
        n_systems = np.int32(len(self.systems))
        self._launch("place_neighbours", n * width, found, rows, first, n_systems, np.int64(n), dummy, table)
        return table

    def _values(
        self,
        values: Sequence[NDArray[np.float64]],
        scale: NDArray[np.float64],
        layout: Layout,
        rows: Any,
        padding: int,
    ) -> tuple[Any, Any]:
        """Values of nodes, scaled, by rows: in double and in single precision."""
        runtime, n = self.runtime, self.n_nodes
        scaled = (value * factor for value, factor in zip(values, scale, strict=True))
        table = upload_joined(runtime, scaled, n)
        exact = _filled(runtime, (layout.n_rows,), np.float64, padding)
        rounded = _filled(runtime, (layout.n_rows,), np.float32, padding)
        self._launch("place_values", n, table, rows, np.int64(n), exact, rounded)
        return exact, rounded

    def coarsen(self, fine: Level, stage: _Stage, large: NDArray[np.bool_]) -> tuple[Level, Level, _Stage]:
        """Merge the blocks of the `large` systems; return the finer level with parents, and the coarser."""
        runtime, d = self.runtime, stage.grid.shape[1]
        layout, parent, children, coarse_stage = self._merge(fine.layout, stage, large)
        n_rows, n_coarse = np.int32(fine.layout.n_rows), np.int32(layout.n_rows)
        table = runtime.empty((layout.n_rows, 2 * d), np.int32)
        weight = runtime.empty((layout.n_rows, 2 * d), np.float32)
        diagonal = runtime.empty((layout.n_rows,), np.float32)
        mass = runtime.empty((layout.n_rows,), np.float32)
        graph = fine.neighbours, fine.weight, fine.diagonal, fine.mass
        sizes = np.int32(fine.fine), n_rows, n_coarse
        coarse = table, weight, diagonal, mass
        tile_system = fine.layout.tile_system
        self._launch("coarsen", layout.n_rows, children, parent, *graph, tile_system, *sizes, *coarse)
        level = Level(layout, table, weight, False, diagonal, mass, None, children)
        return replace(fine, parent=parent), level, coarse_stage

    def _merge(
        self, fine: Layout, stage: _Stage, large: NDArray[np.bool_]
    ) -> tuple[Layout, Any, Any, _Stage]:
        """Lay out the next level: parents of rows, children and positions of coarse rows."""
        runtime, n = self.runtime, fine.n_rows
        coarse_grid = (stage.grid + 1) // 2
        first_cell = first_cells(coarse_grid, large)
        tables = runtime.upload(stage.grid), runtime.upload(first_cell)
        where = stage.position, fine.tile_system, *tables, np.int32(brick_side(stage.grid.shape[1]))
        marks = runtime.zeros((int(first_cell[-1]),), np.int8)
        self._launch("mark_blocks", n, *where, np.int64(n), marks)
        layout, n_marked, base = lay_out(marks, first_cell, runtime)
        del marks
        parent = runtime.empty((n,), np.int32)
        children = _filled(runtime, (layout.n_rows, 2 ** stage.grid.shape[1]), np.int32, n)
        position = _filled(runtime, (layout.n_rows,), np.int64, -1)
        sizes = np.int64(n), np.int32(layout.n_rows)
        self._launch("join_blocks", n, *where, n_marked, base, *sizes, parent, children, position)
        return layout, parent, children, _Stage(coarse_grid, position)

    def _launch(self, kernel: str, n_threads: int, *arguments: Any) -> None:
        """Launch a kernel of one thread an item."""
        self.program.launch(kernel, -(-n_threads // THREADS), *arguments)


def _filled(runtime: Runtime, shape: tuple[int, ...], dtype: Any, value: int) -> Any:
    """Device array with one value everywhere."""
    array = runtime.empty(shape, dtype)
    array[...] = value
    return array
