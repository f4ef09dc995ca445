"""The sweep's engine on the processor: Numba kernels over slabs of nodes, shared by threads."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spem.fields.operator import System
from spem.fields.solvers import kernels, reduced_kernels
from spem.fields.solvers.engine import LANES, Products, Small
from spem.fields.solvers.multigrid import Cycle, Hierarchy, rows
from spem.fields.solvers.team import Team


@dataclass(frozen=True)
class Host:
    """The backend that runs on this machine's processor.

    Parameters
    ----------
    threads
        Threads for large shapes; as many as the process may use when None. Results do not depend on it.
    """

    threads: int | None = None

    def open(self, systems: Sequence[System], dtype: type[np.floating[Any]]) -> HostEngine:
        """Make an engine; see `spem.fields.solvers.engine.Backend`."""
        return HostEngine(systems, dtype, self.threads)


class HostEngine:
    """`spem.fields.solvers.engine.SourceEngine` on the processor, one system after the other.

    Parameters
    ----------
    systems
        The systems of the batch.
    dtype
        Precision of the basis' columns.
    threads
        As for `Host`.
    """

    def __init__(
        self, systems: Sequence[System], dtype: type[np.floating[Any]], threads: int | None = None
    ) -> None:
        self.team = Team(threads)
        self.dtype = dtype
        self.each = [_Vectors(system, dtype, self.team) for system in systems]
        self.counts = np.array([system.n_nodes for system in systems], np.int64)
        self.units = np.array([vectors.hierarchy.unit for vectors in self.each])
        self.active = np.ones(len(self.each), bool)

    def measure(self, mix: Small, shifts: Small, active: NDArray[np.bool_]) -> tuple[Small, Small]:
        """Set u, r and z from the bases."""
        self.active = active
        product, peak = self._all(lambda b, vectors: vectors.measure(mix[b], shifts[b]), (LANES,), (LANES,))
        return product, peak

    def select(self, active: NDArray[np.bool_]) -> None:
        """Narrow or widen the active systems."""
        self.active = active

    def search(self, beta: Small | None) -> Small:
        """Turn p, set q and return p·q."""
        [product] = self._all(
            lambda b, vectors: (vectors.search(None if beta is None else beta[b]),), (LANES,)
        )
        return product

    def improve(self, alpha: Small) -> Small:
        """Advance x and r, set z and return r·z."""
        [product] = self._all(lambda b, vectors: (vectors.improve(alpha[b]),), (LANES,))
        return product

    def overlaps(self) -> Small:
        """Return inner products of the bases and x with x."""
        [products] = self._all(lambda _, vectors: (vectors.overlaps(),), (self._width + LANES, LANES))
        return products

    def append(self, mix: Small, remove: Small) -> Products:
        """Append x·mix + B·remove to the bases."""
        wide, narrow = (self._width + LANES, LANES), (LANES,)
        for b, vectors in enumerate(self.each):
            vectors.append(mix[b], remove[b])
        return Products(*self._all(lambda _, vectors: vectors.products(), wide, wide, wide, narrow, narrow))

    def columns(self, turn: Sequence[Small]) -> list[NDArray[np.floating[Any]]]:
        """Return B·turn of each system."""
        return [vectors.columns(y) for vectors, y in zip(self.each, turn, strict=True)]

    def load(self, rhs: Sequence[NDArray[np.float64]]) -> Small:
        """Take right-hand sides and return b·b."""
        return np.stack([vectors.load(b) for vectors, b in zip(self.each, rhs, strict=True)])

    def refine(self, shifts: Small, active: NDArray[np.bool_]) -> tuple[Small, Small]:
        """Advance v, set r and z, and return r·z and r·r."""
        self.active = active
        product, square = self._all(lambda b, vectors: vectors.refine(shifts[b]), (LANES,), (LANES,))
        return product, square

    def solution(self) -> list[NDArray[np.float64]]:
        """Return v of each system."""
        return [vectors.v[:-1].copy() for vectors in self.each]

    def close(self) -> None:
        """End the threads and forget the vectors."""
        self.each = []
        self.team.close()

    @property
    def _width(self) -> int:
        return LANES * len(self.each[0].blocks)

    def _all(self, work: Callable[[int, _Vectors], Sequence[Small]], *shapes: tuple[int, ...]) -> list[Small]:
        """Do the active systems; zeros for the others."""
        found = [np.zeros((len(self.each), *shape)) for shape in shapes]
        for b in np.flatnonzero(self.active):
            for whole, part in zip(found, work(int(b), self.each[b]), strict=True):
                whole[b] = part
        return found


class _Vectors:
    """The vectors of one system; methods as those of the engine."""

    def __init__(self, system: System, dtype: type[np.floating[Any]], team: Team) -> None:
        self.hierarchy = hierarchy = Hierarchy.of(system)
        self.team, self.dtype = team, dtype
        self.graph, self.slabs = hierarchy.levels[0].graph, hierarchy.levels[0].slabs
        self.exact = (
            system.domain.neighbours,
            np.repeat(system.weights * hierarchy.unit**2, 2),
            system.diagonal * hierarchy.unit**2,
            system.mass,
        )
        self.blocks: list[NDArray[Any]] = []
        n = system.n_nodes
        self.partial = np.zeros((self.slabs.size - 1, LANES))
        self.x, self.r, self.z = rows(n), rows(n), rows(n)
        # The prediction and the search directions are never needed at the same time.
        self.u = np.zeros((n + 1, LANES))
        self.p, self.q = (
            half.reshape(n + 1, LANES) for half in self.u.reshape(-1).view(np.float32).reshape(2, -1)
        )
        self.b = self.v = np.zeros((0, LANES))

    def measure(self, mix: Small, shifts: Small) -> tuple[Small, Small]:
        self.u[-1 if self.blocks else slice(None)] = 0
        for k, block in enumerate(self.blocks):
            part = np.ascontiguousarray(mix[k * LANES : (k + 1) * LANES])
            self._run(reduced_kernels.combine, block, part, self.u, k > 0)
        self._run(reduced_kernels.true_residual, self.u, self.r, *self.exact, shifts[None])
        product = self._cycle_at(shifts)
        self._run(kernels.peak, self.z, self.partial)
        return product, self.partial.max(axis=0)

    def search(self, beta: Small | None) -> Small:
        if beta is None:
            self.x[:] = 0
            self.p[:] = self.z
        else:
            self._run(kernels.turn, self.z, self.p, beta.astype(np.float32)[None])
        self._run(kernels.multiply, self.p, self.q, self.partial, self.graph, self.cycle.shift)
        return np.asarray(self.partial.sum(axis=0))

    def improve(self, alpha: Small) -> Small:
        self._run(kernels.advance, self.x, self.r, self.p, self.q, alpha.astype(np.float32)[None])
        return np.asarray(self.cycle.apply(self.r)[0])

    def overlaps(self) -> Small:
        return np.concatenate([self._cross(block, self.x)[:LANES] for block in (*self.blocks, self.x)])

    def append(self, mix: Small, remove: Small) -> None:
        new = np.zeros((self.x.shape[0], LANES), self.dtype)
        self._run(reduced_kernels.combine, self.x, np.ascontiguousarray(mix), new, False)
        for k, old in enumerate(self.blocks):
            part = np.ascontiguousarray(remove[k * LANES : (k + 1) * LANES])
            self._run(reduced_kernels.combine, old, part, new, True)
        self.blocks.append(new)

    def products(self) -> Products:
        """Products of the last block with all."""
        new = self.blocks[-1]
        gram = [self._cross(old, new) for old in self.blocks]
        pairs = [self._cross_operator(old, new) for old in self.blocks]
        stiffness, mass = zip(*pairs, strict=True)
        wide = [np.concatenate([each[:LANES] for each in part]) for part in (gram, stiffness, mass)]
        return Products(wide[0], wide[1], wide[2], gram[0][LANES], mass[0][LANES])

    def columns(self, turn: Small) -> NDArray[np.floating[Any]]:
        rank = turn.shape[1]
        columns = np.empty((self.x.shape[0] - 1, rank), self.dtype)
        out = np.zeros((self.x.shape[0], LANES), self.dtype)
        for start in range(0, rank, LANES):
            width = min(LANES, rank - start)
            y = np.zeros((turn.shape[0], LANES))
            y[:, :width] = turn[:, start : start + width]
            for k, block in enumerate(self.blocks):
                self._run(reduced_kernels.combine, block, y[k * LANES : (k + 1) * LANES], out, k > 0)
            columns[:, start : start + width] = out[:-1, :width]
        return columns

    def load(self, rhs: NDArray[np.float64]) -> Small:
        self.b, self.v = np.ascontiguousarray(rhs, np.float64), np.zeros((rhs.shape[0] + 1, LANES))
        self.x[:] = 0
        return _square(self.b)

    def refine(self, shifts: Small) -> tuple[Small, Small]:
        self.v += self.x
        self._run(reduced_kernels.source_residual, self.b, self.v, self.r, *self.exact, shifts[None])
        return self._cycle_at(shifts), _square(self.r)

    def _cycle_at(self, shifts: Small) -> Small:
        """Make the cycle of the shifts, and apply it to r."""
        self.cycle = Cycle(self.hierarchy, shifts, self.z, self.team)
        return np.asarray(self.cycle.apply(self.r)[0])

    def _run(self, kernel: Any, *arguments: Any) -> None:
        self.team.all(kernel, self.slabs, *arguments)

    def _cross(self, block: NDArray[Any], other: NDArray[Any]) -> Small:
        found = np.empty((self.slabs.size - 1, LANES + 1, LANES))
        self._run(reduced_kernels.cross, block, other, found)
        return np.asarray(found.sum(axis=0))

    def _cross_operator(self, block: NDArray[Any], other: NDArray[Any]) -> Small:
        found = np.empty((self.slabs.size - 1, 2, LANES + 1, LANES))
        self._run(reduced_kernels.cross_operator, block, other, found, *self.exact)
        return np.asarray(found.sum(axis=0))


def _square(values: NDArray[Any]) -> Small:
    """Inner product of each lane with itself, in double precision."""
    return np.asarray(np.einsum("il,il->l", values, values, dtype=np.float64))
