"""Block conjugate gradients on a device, preconditioned by a cycle: eight shifts of each system at once."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from spem.fields.solvers.cuda.cycle import Cycle, Flags, cycle_bytes, upload_lists
from spem.fields.solvers.cuda.levels import Hierarchy
from spem.fields.solvers.cuda.runtime import TILE, Array, Runtime
from spem.fields.solvers.engine import LANES, Small

# Tiles that one block of threads adds up; the host adds these sums. Their runs depend on a system alone.
_RUN_TILES = 1024

_ROW_BYTES = 4 * LANES


class Vectors(NamedTuple):
    """Vectors ``(n_rows + 1, LANES)``, float32 on the device, zero in the dummy row and in padding.

    Parameters
    ----------
    x, r, z
        Solutions, residuals, and a cycle's answers to these.
    p, q
        Search directions, and their products with A + s M.
    """

    x: Array
    r: Array
    z: Array
    p: Array
    q: Array


class Krylov:
    """Conjugate gradients for (A + s M) x = r on all active systems.

    Answers are ``(n_systems, LANES)``, zero for systems that are not active, and those for a system do not
    depend on what else is in the batch. x is a step late: `finish` before it is read, or p overwritten.

    Parameters
    ----------
    cycle
        The preconditioner.
    hierarchy
        Levels of the systems.
    runtime
        The device.
    vectors
        What it works on; the caller writes r.
    """

    def __init__(self, cycle: Cycle, hierarchy: Hierarchy, runtime: Runtime, vectors: Vectors) -> None:
        self.cycle, self.runtime, self.vectors = cycle, runtime, vectors
        self._level = hierarchy.levels[0]
        self._layout = self._level.layout
        self._program = runtime.program("krylov.cu", DIM=self._level.neighbours.shape[1] // 2)
        self._count = len(hierarchy.depth)
        self._partial = runtime.empty((self._layout.n_rows // TILE, LANES), np.float64)
        self._still = runtime.zeros(self._count * LANES, np.float32)
        self._step = self._still
        self._active: Flags | None = None

    def prepare(self, shifts: Small, active: Flags) -> None:
        """Take the shifts ``(n_systems, LANES)`` and the active systems ``(n_systems,)`` of a round."""
        self.finish()
        self._choose(active)
        self.cycle.prepare(shifts, active)

    def select(self, active: Flags) -> None:
        """Work on these systems only; they have been active in the last `prepare`."""
        self.finish()
        self._choose(active)
        self.cycle.select(active)

    def precondition(self) -> Small:
        """Set z to the cycle's answer to r, and return r·z."""
        self.cycle.apply(self.vectors.r, self.vectors.z)
        return self._total("sum_tiles", self.cycle.partial)

    def peak(self) -> Small:
        """Return the largest magnitude of z."""
        self._run("peak", self._tiles, self.vectors.z, self._partial)
        return self._total("max_tiles", self._partial)

    def search(self, beta: Small | None) -> Small:
        """Turn p ← z + β p, set q = (A + s M) p, and return p·q; with None start afresh, x = 0 and p = z."""
        x, _, z, p, q = self.vectors
        level = self._level
        if beta is None:
            self._run("search_start", self._tiles, z, x, p)
        else:
            self._run("search_turn", *self._where, self._step, self._upload(beta), z, x, p)
        self._step = self._still
        graph = level.neighbours, level.weight, level.diagonal, level.mass
        self._run("search_multiply", *self._where, *graph, self.cycle.shift, p, q, self._partial)
        return self._total("sum_tiles", self._partial)

    def improve(self, alpha: Small) -> Small:
        """Advance r ← r − α q, and x ← x + α p in time, set z to the cycle's answer, and return r·z."""
        self._step = self._upload(alpha)
        self._run("improve_residual", *self._where, self._step, self.vectors.q, self.vectors.r)
        return self.precondition()

    def finish(self) -> None:
        """Take the step of x that is left, if any."""
        if self._step is not self._still:
            self._run("search_finish", *self._where, self._step, self.vectors.p, self.vectors.x)
            self._step = self._still

    def _choose(self, active: Flags) -> None:
        """Upload the tiles of systems, and the runs that are added up together, unless they are there."""
        if self._active is not None and np.array_equal(active, self._active):
            return
        self._active = active.copy()
        tiles = self._layout.tiles(active)
        first, end = self._layout.first_tile[:-1][active], self._layout.first_tile[1:][active]
        starts = [np.arange(a, b, _RUN_TILES) for a, b in zip(first, end, strict=True)]
        ends = [np.minimum(start + _RUN_TILES, b) for start, b in zip(starts, end, strict=True)]
        self._owner = np.repeat(np.flatnonzero(active), [start.size for start in starts])
        runs = np.stack([_joined(starts), _joined(ends)], axis=1).astype(np.int32)
        self._tiles, self._runs = upload_lists(self.runtime, [tiles, runs.ravel()])
        self._where = self._tiles, self._layout.tile_system

    def _run(self, kernel: str, tiles: Array, *arguments: Array) -> None:
        """Launch a kernel on a list of tiles."""
        self._program.launch(kernel, tiles.size, tiles, *arguments)

    def _total(self, kernel: str, partial: Array) -> Small:
        """Join what a kernel left of each tile, by system."""
        found = self.runtime.empty((self._owner.size, LANES), np.float64)
        self._program.launch(kernel, self._owner.size, self._runs, partial, found)
        total = np.zeros((self._count, LANES))
        join = np.add if kernel == "sum_tiles" else np.maximum
        join.at(total, self._owner, self.runtime.download(found))
        return total

    def _upload(self, factors: Small) -> Array:
        return self.runtime.upload(factors.astype(np.float32).ravel())


def bytes_per_iteration(hierarchy: Hierarchy) -> int:
    """Bytes that one iteration for all systems must move: each pass reads its inputs, and writes, once.

    Padding counts for nothing, neither do sums over tiles, half a byte a row.
    """
    nodes = int(hierarchy.counts.sum())
    directions = int(hierarchy.levels[0].neighbours.shape[1])
    turn = 5 * _ROW_BYTES  # x, z, p; x, p
    multiply = 2 * _ROW_BYTES + 4 * directions + 8  # p, neighbours, diagonal, mass; q
    improve = 3 * _ROW_BYTES  # r, q; r
    return nodes * (turn + multiply + improve) + cycle_bytes(hierarchy)


def _joined(parts: list[NDArray[np.int64]]) -> NDArray[np.int64]:
    return np.concatenate([np.zeros(0, np.int64), *parts])
