"""Galerkin reduced basis of the deficits u = 1 - v: all ρ from a few solves.

Every u(s) solves (A + s M) u = s M·1, s = 1/ρ². In a basis B of solutions at a few s, the Galerkin solution,
of the same equation with BᵀAB for A and BᵀMB for M, is the best approximation of u(s) in the energy norm, at
the price of a small dense solve. All columns vanish toward the boundary as the deficits do; a constant among
them would bring in the 1/θ of edges that are cut short, and cancellation with it.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
import scipy.linalg
from numpy.typing import NDArray

from spem.fields.hyperfield import galerkin
from spem.fields.operator import System
from spem.fields.solvers import reduced_kernels as kernels
from spem.fields.solvers.lanes import LANES
from spem.fields.solvers.team import Slabs, Team

# Directions of a new block below this fraction of its largest are rounding noise of single precision.
_DEPENDENT = 1e-13

Small = NDArray[np.float64]


class Reduced(NamedTuple):
    """What is left of a basis: see `spem.fields.hyperfield.Hyperfield`."""

    columns: NDArray[Any]
    gram: Small
    mass: Small
    stiffness: Small
    source: Small


class ReducedBasis:
    """Blocks of nearly orthonormal columns, and the operator restricted to them.

    Parameters
    ----------
    system
        The system that the fields solve.
    unit
        Length that lengths are measured in, for scaling.
    dtype
        Precision that the columns are stored in.
    slabs
        First node of each slab, and the number of nodes.
    team
        Threads.
    """

    def __init__(
        self, system: System, unit: float, dtype: type[np.floating[Any]], slabs: Slabs, team: Team
    ) -> None:
        self.slabs, self.team = slabs, team
        self.n_nodes = system.n_nodes
        self.dtype = dtype
        self.blocks: list[NDArray[Any]] = []
        self.neighbours = system.domain.neighbours
        self.weights = np.repeat(system.weights * unit**2, 2)
        self.diagonal = system.diagonal * unit**2
        self.weight = system.mass
        self.gram = self.mass = self.stiffness = np.zeros((0, 0))
        self.source = self.sums = np.zeros(0)

    def solve(self, shifts: Small) -> Small:
        """Coefficients ``(LANES * n_blocks, n_shifts)`` of the deficits of `shifts`."""
        y = np.zeros((self.source.size, shifts.size))
        used = self._used
        block = np.ix_(used, used)
        y[used] = galerkin(self.stiffness[block], self.mass[block], self.source[used], shifts)
        return y

    def lowest(self) -> float:
        """Lowest eigenvalue of the operator on the basis, an upper bound of its lowest of all."""
        block = np.ix_(self._used, self._used)
        return float(scipy.linalg.eigh(self.stiffness[block], self.mass[block], eigvals_only=True)[0])

    @property
    def _used(self) -> NDArray[np.int64]:
        """Columns that are not zero: a block of dependent vectors has fewer than `LANES`."""
        return np.flatnonzero(np.diag(self.gram) > 0)

    def combine(self, y: Small, out: NDArray[Any]) -> None:
        """Write the `LANES` vectors with coefficients `y` to the first n rows of `out`."""
        if not self.blocks:
            out[: self.n_nodes] = 0
        for k, block in enumerate(self.blocks):
            mix = np.ascontiguousarray(y[k * LANES : (k + 1) * LANES])
            self.team.all(kernels.combine, self.slabs, block, mix, out, k > 0)

    def residual(self, u: NDArray[np.float64], r: NDArray[np.float32], shifts: Small) -> None:
        """Write s M (1 - u) - A u to r, computed in double precision."""
        graph = self.neighbours, self.weights, self.diagonal, self.weight
        self.team.all(kernels.true_residual, self.slabs, u, r, *graph, shifts[None])

    def extend(self, vectors: NDArray[np.float32]) -> None:
        """Orthonormalise a block of `LANES` vectors against the basis and append it."""
        gram = self._cross(vectors, vectors)[:LANES]
        inside = np.zeros((self.source.size, LANES))
        for k, old in enumerate(self.blocks):
            inside[k * LANES : (k + 1) * LANES] = self._cross(old, vectors)[:LANES]
        scale = np.sqrt(np.diag(gram))
        scale = np.divide(1.0, scale, out=np.zeros(LANES), where=scale > 0)
        used, project = self._used, np.zeros_like(inside)
        project[used] = np.linalg.solve(self.gram[np.ix_(used, used)], inside[used])
        size, direction = np.linalg.eigh((gram - inside.T @ project) * np.outer(scale, scale))
        keep = size > _DEPENDENT
        mix = np.zeros((LANES, LANES))
        mix[:, keep] = scale[:, None] * direction[:, keep] / np.sqrt(size[keep])
        remove = -project @ mix
        block = np.zeros((self.n_nodes + 1, LANES), self.dtype)
        self.team.all(kernels.combine, self.slabs, vectors, mix, block, False)
        for k, old in enumerate(self.blocks):
            part = np.ascontiguousarray(remove[k * LANES : (k + 1) * LANES])
            self.team.all(kernels.combine, self.slabs, old, part, block, True)
        self._append(block)

    def compress(self, shifts: Small, tolerance: float) -> Reduced:
        """Rotate to the fewest orthonormal columns that carry the deficits of `shifts`.

        What is dropped changes no deficit by more than `tolerance` in the root mean square.
        """
        used = self._used
        upper = np.linalg.cholesky(self.gram[np.ix_(used, used)]).T
        left, size, _ = np.linalg.svd(upper @ self.solve(shifts)[used], full_matrices=False)
        rank = int(np.sum(size > tolerance * np.sqrt(self.n_nodes)))
        turn = np.zeros((self.source.size, rank))
        turn[used] = np.linalg.solve(upper, left[:, :rank])
        columns = np.empty((self.n_nodes, rank), self.dtype)
        out = np.zeros((self.n_nodes + 1, LANES), self.dtype)
        for start in range(0, rank, LANES):
            width = min(LANES, rank - start)
            y = np.zeros((turn.shape[0], LANES))
            y[:, :width] = turn[:, start : start + width]
            self.combine(y, out)
            columns[:, start : start + width] = out[:-1, :width]
        gram = np.eye(rank + 1) * self.n_nodes
        gram[1:, 1:] = turn.T @ self.gram @ turn
        gram[0, 1:] = gram[1:, 0] = turn.T @ self.sums
        return Reduced(
            columns, gram, turn.T @ self.mass @ turn, turn.T @ self.stiffness @ turn, turn.T @ self.source
        )

    def _append(self, block: NDArray[Any]) -> None:
        self.blocks.append(block)
        gram = [self._cross(old, block) for old in self.blocks]
        stiffness, mass = zip(*(self._cross_operator(old, block) for old in self.blocks), strict=True)
        self.gram, self.stiffness, self.mass = (
            _border(matrix, products)
            for matrix, products in ((self.gram, gram), (self.stiffness, stiffness), (self.mass, mass))
        )
        self.sums = np.append(self.sums, gram[0][LANES])
        self.source = np.append(self.source, mass[0][LANES])

    def _cross(self, block: NDArray[Any], other: NDArray[Any]) -> Small:
        partial = np.empty((self.slabs.size - 1, LANES + 1, LANES))
        self.team.all(kernels.cross, self.slabs, block, other, partial)
        return np.asarray(partial.sum(axis=0))

    def _cross_operator(self, block: NDArray[Any], other: NDArray[Any]) -> Small:
        partial = np.empty((self.slabs.size - 1, 2, LANES + 1, LANES))
        graph = self.neighbours, self.weights, self.diagonal, self.weight
        self.team.all(kernels.cross_operator, self.slabs, block, other, partial, *graph)
        return np.asarray(partial.sum(axis=0))


def _border(matrix: Small, products: Sequence[Small]) -> Small:
    """Append the rows and columns of a new block to a symmetric reduced matrix."""
    columns = np.concatenate([product[:LANES] for product in products])
    old = matrix.shape[0]
    grown = np.zeros((old + LANES, old + LANES))
    grown[:old, :old] = matrix
    grown[:, old:] = columns
    grown[old:, :old] = columns[:old].T
    corner = grown[old:, old:]
    grown[old:, old:] = (corner + corner.T) / 2
    return grown
