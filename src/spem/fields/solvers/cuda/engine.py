"""The sweep's engine on a device: all systems of a batch in each launch."""

from __future__ import annotations

import traceback
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spem.errors import ParameterError, SizeError
from spem.fields.operator import System
from spem.fields.solvers.cuda.cycle import cycle_bytes
from spem.fields.solvers.cuda.krylov import bytes_per_iteration
from spem.fields.solvers.cuda.levels import Hierarchy
from spem.fields.solvers.cuda.meter import Meter
from spem.fields.solvers.cuda.runtime import Array, Runtime
from spem.fields.solvers.cuda.workspace import (
    EXPECTED_BLOCKS,
    Sources,
    Workspace,
    engine_bytes,
    require_batch,
    told,
)
from spem.fields.solvers.engine import LANES, Products, Small

# Bytes of a row of lanes in single precision.
_ROW = 4 * LANES

_ADVICE = "sweep fewer shapes at a time, or coarser ones, or on the processor"

Flags = NDArray[np.bool_]


class CudaEngine:
    """`spem.fields.solvers.engine.SourceEngine` on a device.

    Parameters
    ----------
    systems
        Systems of one dimension.
    dtype
        Precision of the columns of the basis.
    runtime
        The device.
    profile
        Whether to take the time of each stage.

    Attributes
    ----------
    counts, units, dtype
        As those of `spem.fields.solvers.engine.Engine`.

    Raises
    ------
    ParameterError
        When there is no system, or they differ in dimension.
    SizeError
        When the systems do not fit into the memory of the device; in any method, too.
    """

    def __init__(
        self,
        systems: Sequence[System],
        dtype: type[np.floating[Any]],
        runtime: Runtime,
        *,
        profile: bool = False,
    ) -> None:
        require_batch(systems)
        self.runtime, self.dtype = runtime, dtype
        self.counts = np.array([system.n_nodes for system in systems], np.int64)
        self.units = np.array([min(system.shape.spacing) for system in systems])
        self._dimension = systems[0].shape.ndim
        self._meter = Meter(runtime, timed=profile)
        self._workspace: Workspace | None = None
        self._sources: Sources | None = None
        self._active = np.ones(len(systems), bool)
        self._bytes_with = partial(engine_bytes, systems, dtype)
        self._free = runtime.free_bytes()
        if self._bytes_with(EXPECTED_BLOCKS) > self._free:
            free = f"{runtime.name}, which has {_told(self._free)} free"
            msg = f"{self._sizes(EXPECTED_BLOCKS)} on {free}; {_ADVICE}"
            raise SizeError(msg)
        with self._stage("hierarchy", self._bytes_with(0)):
            self._workspace = Workspace.of(systems, dtype, runtime, self._meter)
        hierarchy, n_nodes = self._workspace.hierarchy, int(self.counts.sum())
        self._cycle_bytes = cycle_bytes(hierarchy) / n_nodes
        self._iteration_bytes = bytes_per_iteration(hierarchy) / n_nodes - self._cycle_bytes

    @property
    def hierarchy(self) -> Hierarchy:
        """The levels; its ``rows`` tell where nodes are in tables of ``n_rows`` rows."""
        return self._open.hierarchy

    def measure(self, mix: Small, shifts: Small, active: Flags) -> tuple[Small, Small]:
        """Set u, r and z from the bases, and return r·z and the largest magnitude of z."""
        work = self._select(active)
        with self._stage("blocks", self._share * (self._basis_bytes + self._graph_bytes + 5 * _ROW)):
            work.blocks.predict(mix, work.u)
            work.blocks.residual(work.u, work.krylov.vectors.r, shifts)
        with self._stage("krylov", self._share * _ROW):
            work.krylov.prepare(shifts, active)
            return self._precondition(), work.krylov.peak()

    def select(self, active: Flags) -> None:
        """Narrow or widen the active systems."""
        with self._stage("krylov"):
            self._open.krylov.select(active)
            self._active = active.copy()

    def search(self, beta: Small | None) -> Small:
        """Turn p, set q and return p·q."""
        krylov = self._open.krylov
        with self._stage("krylov", self._share * self._iteration_bytes):
            if beta is None:
                # u was here
                krylov.vectors.p[-1] = 0
            return krylov.search(beta)

    def improve(self, alpha: Small) -> Small:
        """Advance x and r, set z and return r·z."""
        with self._stage("krylov"):
            self._count_cycle()
            return self._open.krylov.improve(alpha)

    def overlaps(self) -> Small:
        """Return inner products of the bases and x with x."""
        work = self._select(self._active)
        with self._stage("blocks", self._share * (self._basis_bytes + _ROW)):
            return work.blocks.overlaps(work.krylov.vectors.x)

    def append(self, mix: Small, remove: Small) -> Products:
        """Append x·mix + B·remove to the bases, and return what it has with all."""
        work = self._select(self._active)
        n_bytes = 2 * self._basis_bytes + 2 * self._width * LANES + self._graph_bytes + _ROW
        with self._stage("blocks", self._share * n_bytes):
            return work.blocks.append(work.krylov.vectors.x, mix, remove)

    def columns(self, turn: Sequence[Small]) -> list[NDArray[np.floating[Any]]]:
        """Return B·turn of each system, in one transfer."""
        ranks = [part.shape[1] for part in turn]
        mix = np.zeros((len(turn), turn[0].shape[0], max(ranks)))
        for whole, part in zip(mix, turn, strict=True):
            whole[:, : part.shape[1]] = part
        n_nodes, size = int(self.counts.sum()), self._width * max(ranks)
        with self._stage("project", n_nodes * (self._basis_bytes + size)):
            table = self._open.blocks.columns(mix)
        with self._stage("transfers", n_nodes * size):
            values = self.runtime.download(table)
        parts = zip(self._split(values), ranks, strict=True)
        return [np.ascontiguousarray(part[:, :rank]) for part, rank in parts]

    def project(self, constant: Small, mix: Small) -> Array:
        """Make constant + B·mix on the device: fields, or maps.

        Parameters
        ----------
        constant
            ``(n_systems, k)``.
        mix
            ``(n_systems, K, k)``.

        Returns
        -------
        ``(n_rows, k)`` float32 on the device, which `to_nodes` brings to the host. Padding rows hold the
        constant.
        """
        with self._stage("project", int(self.counts.sum()) * (self._basis_bytes + 4 * mix.shape[2])):
            return self._open.blocks.project(constant, mix)

    def to_nodes(self, table: Array) -> list[NDArray[Any]]:
        """Bring a table of rows to the host in one transfer: each system's ``(n_nodes, k)``, by node."""
        rows = self._open.hierarchy.rows
        with self._stage("transfers", 3 * table.dtype.itemsize * rows.size * table.shape[1]):
            values = self.runtime.download(table[rows])
        return self._split(values)

    def load(self, rhs: Sequence[NDArray[np.float64]]) -> Small:
        """Take right-hand sides and return b·b."""
        work = self._select(np.ones(self.counts.size, bool))
        with self._stage("transfers", self._share * 8 * _ROW):
            b, v = (self.runtime.zeros(work.blocks.shape, np.float64) for _ in range(2))
            b[work.hierarchy.rows] = self.runtime.upload(np.concatenate(rhs).astype(np.float64, copy=False))
            self._sources = Sources(b, v)
        with self._stage("blocks", self._share * (self._graph_bytes + 5 * _ROW)):
            _, r, *_ = vectors = work.krylov.vectors
            vectors.x[...] = 0
            return work.blocks.source_residual(b, v, r, np.zeros((self.counts.size, LANES)))

    def refine(self, shifts: Small, active: Flags) -> tuple[Small, Small]:
        """Advance v, set r and z, and return r·z and r·r."""
        work, (b, v) = self._select(active), self._loaded
        with self._stage("blocks", self._share * (self._graph_bytes + 10 * _ROW)):
            x, r, *_ = work.krylov.vectors
            work.blocks.advance(x, v)
            square = work.blocks.source_residual(b, v, r, shifts)
        with self._stage("krylov"):
            work.krylov.prepare(shifts, active)
            return self._precondition(), square

    def solution(self) -> list[NDArray[np.float64]]:
        """Return v of each system."""
        return self.to_nodes(self._loaded.v)

    def close(self) -> None:
        """Let go of all arrays, for the next engine to use; what is asked for afterwards is refused."""
        self._workspace = self._sources = None

    @property
    def seconds(self) -> dict[str, float]:
        """Seconds of each stage so far; none unless a profile was asked for."""
        return self._meter.seconds

    @property
    def bytes(self) -> dict[str, int]:
        """Fewest bytes that each stage so far had to move: each input read once, each result written once."""
        return dict(self._meter.bytes)

    @property
    def _open(self) -> Workspace:
        if self._workspace is None:
            msg = "this engine is closed and its memory given back; ask before it is closed, or open another"
            raise ParameterError(msg)
        return self._workspace

    @property
    def _loaded(self) -> Sources:
        if self._sources is None:
            msg = "this engine has no right-hand sides: load them first"
            raise ParameterError(msg)
        return self._sources

    def _select(self, active: Flags) -> Workspace:
        """Bring x up to date and let the basis work on these systems."""
        work = self._open
        with self._stage("krylov"):
            work.krylov.finish()
            self._active = active.copy()
            if not np.array_equal(active, work.blocks.active):
                work.blocks.select(self._active)
        return work

    def _precondition(self) -> Small:
        self._count_cycle()
        return self._open.krylov.precondition()

    def _count_cycle(self) -> None:
        self._meter.count("cycle", self._share * self._cycle_bytes)

    def _split(self, values: NDArray[Any]) -> list[NDArray[Any]]:
        """Part the values of all nodes: copies, so that one does not keep the others in memory."""
        if self.counts.size == 1:
            return [values]
        return [part.copy() for part in np.split(values, np.cumsum(self.counts[:-1]))]

    @property
    def _share(self) -> int:
        """Number of nodes of the active systems."""
        return int(self.counts[self._active].sum())

    @property
    def _width(self) -> int:
        return np.dtype(self.dtype).itemsize

    @property
    def _basis_bytes(self) -> int:
        """Bytes of a row of all blocks."""
        return self._width * self._open.blocks.n_columns

    @property
    def _graph_bytes(self) -> int:
        """Bytes of a row of the graph in double precision: neighbours, diagonal and mass."""
        return 8 * self._dimension + 16

    @contextmanager
    def _stage(self, name: str, n_bytes: float = 0) -> Iterator[None]:
        """Time and count what is done within; a device out of memory gives back what it has."""
        # Asking for the array functions makes the device this thread's.
        _ = self.runtime.xp
        try:
            with self._meter.stage(name, n_bytes):
                yield
        except self.runtime.memory_errors as error:
            # The frames that failed hold arrays of their own.
            traceback.clear_frames(error.__traceback__)
            n_blocks = len(self._workspace.blocks.arrays) + 1 if self._workspace is not None else 0
            self.close()
            # What is left of arrays of other sizes goes back, so that a smaller batch has all there is.
            self.runtime.release()
            msg = (
                f"{self.runtime.name} ran out of memory, with {_told(self._free)} free at first: "
                f"{self._sizes(n_blocks)}; {_ADVICE}"
            )
            raise SizeError(msg) from error

    def _sizes(self, n_blocks: int) -> str:
        """Say how large the batch is."""
        batch = told(self.counts.size, int(self.counts.sum()))
        return f"{batch} with {LANES * n_blocks} columns would take about {_told(self._bytes_with(n_blocks))}"


def _told(n_bytes: int) -> str:
    return f"{n_bytes / 2**30:.1f} GiB" if n_bytes >= 2**30 else f"{n_bytes / 2**20:.1f} MiB"
