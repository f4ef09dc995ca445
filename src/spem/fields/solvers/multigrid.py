"""Block multigrid on the nodes of a shape: the preconditioner of the sweep over ρ.

Unsmoothed aggregation of 2^d blocks keeps the 2d+1-point structure on every level, so one set of kernels
serves all levels and dimensions; one Gauss-Seidel sweep goes down and one, in reverse order, up, which makes
the cycle symmetric.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spem.fields.operator import System
from spem.fields.solvers import kernels
from spem.fields.solvers.engine import LANES
from spem.fields.solvers.team import Team, cut_slabs

# The coarsest level is inverted densely, lane by lane.
COARSEST = 48


@dataclass(frozen=True, eq=False)
class Level:
    """One graph of the hierarchy and the map to the next."""

    graph: tuple[Any, ...]  # neighbours, weight, step, diagonal, mass: what the kernels take
    aggregate: NDArray[np.int32] | None  # (n,) node of the next level, None on the coarsest
    slabs: NDArray[np.int64]  # first node of each slab, and n

    @property
    def n_nodes(self) -> int:
        """Number of nodes of the level."""
        return int(self.graph[0].shape[0])


@dataclass(frozen=True, eq=False)
class Hierarchy:
    """Levels from fine to coarse, in units of the smallest spacing."""

    levels: tuple[Level, ...]
    unit: float  # the length that the finest weights are scaled by

    @classmethod
    def of(cls, system: System) -> Hierarchy:
        """Coarsen a system until `COARSEST` nodes are left; where no block merges, a coarser one will."""
        unit = min(system.shape.spacing)
        graph: tuple[Any, ...] = (
            system.domain.neighbours,
            np.repeat(system.weights * unit**2, 2)[None].astype(np.float32),
            0,
            (system.diagonal * unit**2).astype(np.float32),
            system.mass.astype(np.float32),
        )
        voxels, shape = system.shape.voxels, np.array(system.shape.mask.shape)
        levels = []
        while graph[0].shape[0] > COARSEST:
            coarse_shape = (shape + 1) // 2
            blocks, aggregate = kernels.aggregate_voxels(voxels, shape, coarse_shape)
            levels.append(Level(graph, aggregate, cut_slabs(voxels, tuple(shape))))
            table, weight, diagonal, mass = kernels.coarsen(aggregate, blocks.size, graph)
            graph = (table, weight, 1, diagonal, mass)
            voxels, shape = blocks, coarse_shape
        levels.append(Level(graph, None, np.array([0, graph[0].shape[0]])))
        return cls(tuple(levels), unit)


class Cycle:
    """One V-cycle for a block of shifts: an approximate inverse of A + shift, symmetric positive definite.

    Parameters
    ----------
    hierarchy
        Levels of the system.
    shifts
        ``(LANES,)`` shifts in units of the hierarchy.
    z
        ``(n_nodes + 1, LANES)`` array that takes the answers.
    team
        Threads.
    """

    def __init__(
        self, hierarchy: Hierarchy, shifts: NDArray[np.float64], z: NDArray[np.float32], team: Team
    ) -> None:
        self.levels = hierarchy.levels
        self.team = team
        self.shift = shifts.astype(np.float32)[None]
        self.r = [rows(level.n_nodes) for level in self.levels[1:]]
        self.z = [z, *(rows(level.n_nodes) for level in self.levels[1:])]
        self._inverse = _invert(self.levels[-1], shifts)

    def apply(self, r: NDArray[np.float32]) -> NDArray[np.float64]:
        """Write the cycle's answer to r into ``self.z[0]`` and return r·z, ``(1, LANES)``."""
        return self._descend(0, r)

    def _descend(self, depth: int, r: NDArray[np.float32]) -> NDArray[np.float64]:
        level, z, team = self.levels[depth], self.z[depth], self.team
        if level.aggregate is None:
            kernels.apply_dense(r, z, self._inverse)
            return np.asarray(np.einsum("il,il->l", r, z, dtype=np.float64))[None]
        if level.slabs.size > 2:
            z[:] = 0
        graph, shift, slabs = level.graph, self.shift, level.slabs
        team.even(kernels.relax_forward, slabs, r, z, graph, shift)
        team.odd(kernels.relax_forward, slabs, r, z, graph, shift)
        coarse_r, coarse_z = self.r[depth], self.z[depth + 1]
        coarse_r[:] = 0
        team.all(kernels.restrict, slabs, z, coarse_r, level.aggregate, graph)
        self._descend(depth + 1, coarse_r)
        team.all(kernels.correct, slabs, z, coarse_z, level.aggregate)
        partial = np.empty((slabs.size - 1, LANES))
        team.odd(kernels.relax_backward, slabs, r, z, partial, graph, shift)
        team.even(kernels.relax_backward, slabs, r, z, partial, graph, shift)
        return np.asarray(partial.sum(axis=0, keepdims=True))


def rows(n: int) -> NDArray[np.float32]:
    """Zeros for n nodes and the dummy row that missing neighbours point to."""
    return np.zeros((n + 1, LANES), np.float32)


def _invert(level: Level, shifts: NDArray[np.float64]) -> NDArray[np.float32]:
    """Dense inverses of the coarsest matrix, one per lane, laid out for `kernels.apply_dense`."""
    neighbours, weight, step, diagonal, mass = level.graph
    n = level.n_nodes
    matrix = np.zeros((n, n + 1))
    for k in range(neighbours.shape[1]):
        matrix[np.arange(n), neighbours[:, k]] -= weight[step * np.arange(n), k]
    matrix = matrix[:, :n]
    stiffness = matrix + np.diag(diagonal.astype(np.float64))
    masses = np.diag(mass.astype(np.float64))
    inverse = np.linalg.inv(stiffness + shifts[:, None, None] * masses)
    return np.ascontiguousarray(inverse.transpose(1, 2, 0).reshape(n * n, LANES), np.float32)
