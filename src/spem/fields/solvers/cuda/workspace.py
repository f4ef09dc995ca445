"""What an engine holds on its device, and how much memory that takes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from spem.errors import ParameterError, SizeError
from spem.fields.operator import System
from spem.fields.solvers.cuda.blocks import Blocks
from spem.fields.solvers.cuda.bricks import first_cells
from spem.fields.solvers.cuda.cycle import Cycle
from spem.fields.solvers.cuda.footprint import hierarchy_bytes
from spem.fields.solvers.cuda.krylov import Krylov, Vectors
from spem.fields.solvers.cuda.levels import Hierarchy
from spem.fields.solvers.cuda.meter import Meter
from spem.fields.solvers.cuda.runtime import TILE, Array, Runtime
from spem.fields.solvers.engine import LANES
from spem.fields.solvers.multigrid import COARSEST

# Blocks of a basis that room is asked for before anything is allocated.
EXPECTED_BLOCKS = 3
# Kernels multiply the number of a row by that of its faces, or corners, in 32 bits.
_MOST_ENTRIES = 2**31
# CuPy sums up no more numbers than that, and says nothing.
_MOST_CELLS = 2**31


class Sources(NamedTuple):
    """Right-hand sides and their solutions, ``(n_rows + 1, LANES)`` float64 on the device."""

    b: Array
    v: Array


class MeteredCycle(Cycle):
    """A cycle whose time is taken apart from that of what calls it."""

    def __init__(self, hierarchy: Hierarchy, runtime: Runtime, meter: Meter) -> None:
        super().__init__(hierarchy, runtime)
        self._meter = meter

    def apply(self, r: Array, z: Array) -> None:
        """Write the cycle's answer to r into z."""
        with self._meter.stage("cycle"):
            super().apply(r, z)


@dataclass(frozen=True, eq=False)
class Workspace:
    """Levels, vectors and columns of a batch of systems on a device.

    Parameters
    ----------
    hierarchy
        Levels of the systems.
    blocks
        The basis.
    krylov
        Conjugate gradients, with the vectors x, r, z, p and q.
    u
        ``(n_rows + 1, LANES)`` float64 predictions, in the memory of p and q: they are never needed at the
        same time.
    """

    hierarchy: Hierarchy
    blocks: Blocks
    krylov: Krylov
    u: Array

    @classmethod
    def of(
        cls, systems: Sequence[System], dtype: type[np.floating[Any]], runtime: Runtime, meter: Meter
    ) -> Workspace:
        """Make all that does not grow."""
        hierarchy = Hierarchy.of(systems, runtime)
        blocks = Blocks(hierarchy, dtype, runtime)
        rows = blocks.shape[0]
        work = runtime.empty((2 * rows, LANES), np.float32)
        x, r, z = (runtime.zeros(blocks.shape, np.float32) for _ in range(3))
        vectors = Vectors(x, r, z, work[:rows], work[rows:])
        cycle = MeteredCycle(hierarchy, runtime, meter)
        return cls(
            hierarchy,
            blocks,
            Krylov(cycle, hierarchy, runtime, vectors),
            work.view(np.float64).reshape(rows, LANES),
        )


def engine_bytes(systems: Sequence[System], dtype: type[np.floating[Any]], n_blocks: int) -> int:
    """Estimate the memory of a device that an engine takes with so many blocks of columns.

    Coarse levels are taken to be as large as those of a solid shape.

    Examples
    --------
    >>> from spem.fields.operator import assemble
    >>> from spem.shapes.shape import Shape
    >>> cube = assemble(Shape.from_mask(np.ones((40, 40, 40))), "voxel")
    >>> 200 < engine_bytes([cube], np.float32, 3) / cube.n_nodes < 500
    True
    """
    rows, d = count_rows([system.n_nodes for system in systems]), systems[0].shape.ndim
    levels = hierarchy_bytes(systems)
    coarse = rows // (2**d - 1)
    # x, r and z, then u in double precision; r and z of coarser levels
    vectors = 4 * LANES * (5 * rows + 2 * coarse)
    inverses = 4 * LANES * COARSEST**2 * len(systems)
    columns = n_blocks * LANES * np.dtype(dtype).itemsize * rows
    return int(max(levels.peak, levels.held + vectors + inverses + columns))


def count_rows(counts: Sequence[int] | NDArray[np.int64]) -> int:
    """Most rows that systems of so many nodes can take: each colour fills whole tiles."""
    return int(np.sum(np.asarray(counts, np.int64) + 2 * (TILE - 1)))


def require_batch(systems: Sequence[System]) -> None:
    """Refuse what no batch can be made of, and more rows, or cells of grids, than can be numbered."""
    dimensions = sorted({system.shape.ndim for system in systems})
    if len(dimensions) != 1:
        msg = f"a batch of shapes of dimensions {dimensions}: expected shapes, all of one dimension"
        raise ParameterError(msg)
    d, n_nodes = dimensions[0], sum(system.n_nodes for system in systems)
    most = _MOST_ENTRIES // max(2 * d, 2**d)
    if count_rows([system.n_nodes for system in systems]) >= most:
        msg = (
            f"{told(len(systems), n_nodes)}: a device takes at most {most:,} in {d}-D; "
            "sweep fewer shapes at a time, or coarser ones"
        )
        raise SizeError(msg)
    grid = np.array([system.shape.mask.shape for system in systems])
    cells = int(first_cells(grid, np.ones(len(grid), np.bool_))[-1])
    if cells >= _MOST_CELLS:
        msg = (
            f"{told(len(systems), n_nodes)} in grids of {cells:,} voxels: a device takes fewer than "
            f"{_MOST_CELLS:,}; sweep fewer shapes at a time, or coarser ones"
        )
        raise SizeError(msg)


def told(n_systems: int, n_nodes: int) -> str:
    """Say how large a batch is."""
    return f"{n_systems} shape{'s' if n_systems > 1 else ''} of {n_nodes:,} nodes"
