"""Galerkin reduced basis of the deficits u = 1 - v: all ρ from a few solves.

Every u(s) solves (A + s M) u = s M·1, s = 1/ρ². In a basis B of solutions at a few s, the constant among
them, the Galerkin solution, of the same equation with BᵀAB for A and BᵀMB for M, is the best approximation
of u(s) in the energy norm, at the price of a small dense solve.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

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


class ReducedBasis:
    """Blocks of nearly orthonormal columns, the constant first, and the operator restricted to them.

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
        self.gram = np.array([[float(self.n_nodes)]])
        self.mass = np.array([[float(system.mass.sum())]])
        self.stiffness = np.array([[float(system.rhs.sum() * unit**2)]])

    def solve(self, shifts: Small) -> Small:
        """Coefficients ``(1 + LANES * n_blocks, n_shifts)`` of u in the constant and the columns."""
        y = np.zeros((self.mass.shape[0], shifts.size))
        used = np.diag(self.gram) > 0
        stiffness, mass = self.stiffness[np.ix_(used, used)], self.mass[np.ix_(used, used)]
        y[used] = galerkin(stiffness, mass, shifts)
        return y

    def lowest(self) -> float:
        """Lowest eigenvalue of the operator on the basis, an upper bound of its lowest of all."""
        used = np.diag(self.gram) > 0
        block = np.ix_(used, used)
        return float(scipy.linalg.eigh(self.stiffness[block], self.mass[block], eigvals_only=True)[0])

    def combine(self, y: Small, out: NDArray[Any]) -> None:
        """Write the `LANES` vectors with coefficients `y` to the first n rows of `out`."""
        if not self.blocks:
            out[: self.n_nodes] = y[0]
        for k, block in enumerate(self.blocks):
            mix = np.ascontiguousarray(y[1 + k * LANES : 1 + (k + 1) * LANES])
            constant = np.ascontiguousarray(y[:1])
            self.team.all(kernels.combine, self.slabs, block, mix, constant, out, k > 0)

    def residual(self, u: NDArray[np.float64], r: NDArray[np.float32], shifts: Small) -> None:
        """Write s M (1 - u) - A u to r, computed in double precision."""
        graph = self.neighbours, self.weights, self.diagonal, self.weight
        self.team.all(kernels.true_residual, self.slabs, u, r, *graph, shifts[None])

    def extend(self, vectors: NDArray[np.float32]) -> None:
        """Orthonormalise a block of `LANES` vectors against the basis and append it."""
        gram = self._cross(vectors, vectors)
        inner = [gram[LANES:]] + [self._cross(block, vectors)[:LANES] for block in self.blocks]
        inside = np.concatenate(inner)
        scale = np.sqrt(np.diag(gram[:LANES]))
        scale = np.divide(1.0, scale, out=np.zeros(LANES), where=scale > 0)
        used = np.diag(self.gram) > 0
        project = np.zeros_like(inside)
        project[used] = np.linalg.solve(self.gram[np.ix_(used, used)], inside[used])
        rest = (gram[:LANES] - inside.T @ project) * np.outer(scale, scale)
        size, direction = np.linalg.eigh(rest)
        keep = size > _DEPENDENT
        mix = np.zeros((LANES, LANES))
        mix[:, keep] = scale[:, None] * direction[:, keep] / np.sqrt(size[keep])
        remove = -project @ mix
        block = np.zeros((self.n_nodes + 1, LANES), self.dtype)
        combine, constant = kernels.combine, np.ascontiguousarray(remove[:1])
        self.team.all(combine, self.slabs, vectors, mix, constant, block, False)
        for k, old in enumerate(self.blocks):
            part = np.ascontiguousarray(remove[1 + k * LANES :][:LANES])
            self.team.all(combine, self.slabs, old, part, constant, block, True)
        self._append(block)

    def compress(self, shifts: Small, tolerance: float) -> tuple[NDArray[Any], Small, Small, Small]:
        """Rotate to the fewest columns that carry the deficits of `shifts`, orthogonal to the constant.

        Returns the columns ``(n_nodes, rank)``, and gram, mass and stiffness of the constant and the columns.
        What is dropped changes no deficit by more than `tolerance` in the root mean square.
        """
        used = np.flatnonzero(np.diag(self.gram) > 0)
        upper = np.linalg.cholesky(self.gram[np.ix_(used, used)]).T
        left, size, _ = np.linalg.svd((upper @ self.solve(shifts)[used])[1:], full_matrices=False)
        rank = int(np.sum(size > tolerance * np.sqrt(self.n_nodes)))
        rotation = np.eye(used.size)[:, : rank + 1]
        rotation[1:, 1:] = left[:, :rank]
        turn = np.zeros((self.gram.shape[0], rank + 1))
        turn[used] = np.linalg.solve(upper, rotation)
        turn[:, 0] = np.eye(self.gram.shape[0])[0]
        columns = np.empty((self.n_nodes, rank), self.dtype)
        out = np.zeros((self.n_nodes + 1, LANES), self.dtype)
        for start in range(0, rank, LANES):
            width = min(LANES, rank - start)
            y = np.zeros((turn.shape[0], LANES))
            y[:, :width] = turn[:, 1 + start : 1 + start + width]
            self.combine(y, out)
            columns[:, start : start + width] = out[:-1, :width]
        small = (turn.T @ matrix @ turn for matrix in (self.gram, self.mass, self.stiffness))
        return columns, *small

    def _append(self, block: NDArray[Any]) -> None:
        self.blocks.append(block)
        self.gram = _border(self.gram, [self._cross(old, block) for old in self.blocks])
        stiffness, mass = zip(*(self._cross_operator(old, block) for old in self.blocks), strict=True)
        self.stiffness = _border(self.stiffness, stiffness)
        self.mass = _border(self.mass, mass)

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
    columns = np.concatenate([products[-1][LANES:]] + [product[:LANES] for product in products])
    old = matrix.shape[0]
    grown = np.zeros((old + LANES, old + LANES))
    grown[:old, :old] = matrix
    grown[:, old:] = columns
    grown[old:, :old] = columns[:old].T
    corner = grown[old:, old:]
    grown[old:, old:] = (corner + corner.T) / 2
    return grown
