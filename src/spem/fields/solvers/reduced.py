"""Galerkin reduced bases of the deficits u = 1 - v of a batch of systems: all ρ from a few solves.

Every u(s) solves (A + s M) u = s M·1, s = 1/ρ². In a basis B of solutions at a few s, the Galerkin solution,
of the same equation with BᵀAB for A and BᵀMB for M, is the best approximation of u(s) in the energy norm, at
the price of a small dense solve. All columns vanish toward the boundary as the deficits do; a constant among
them would bring in the 1/θ of edges that are cut short, and cancellation with it.

The columns lie in the engine; here are the small matrices, with the system first. A column of zeros, of a
block of dependent vectors or of a system that was done, stands in them as one apart from all others.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from spem.fields.solvers.engine import LANES, Engine, Small

# Directions of a new block below this fraction of its largest are rounding noise of single precision.
_DEPENDENT = 1e-13


class Reduced(NamedTuple):
    """What is left of a basis: columns B·turn, and the rest as `spem.fields.hyperfield.Hyperfield` has it.

    A is in units of 1/`Engine.units`².
    """

    turn: Small
    gram: Small
    mass: Small
    stiffness: Small
    source: Small


class ReducedBases:
    """Blocks of nearly orthonormal columns of each system, and its operator restricted to them.

    Parameters
    ----------
    engine
        The engine that holds the columns.
    """

    def __init__(self, engine: Engine) -> None:
        self.engine = engine
        count = len(engine.counts)
        self.gram = self.mass = self.stiffness = np.zeros((count, 0, 0))
        self.source = self.sums = np.zeros((count, 0))

    @property
    def used(self) -> NDArray[np.bool_]:
        """``(n_systems, K)`` columns that are not zero."""
        return np.diagonal(self.gram, axis1=1, axis2=2) > 0

    def solve(self, shifts: Small) -> Small:
        """Coefficients ``(n_systems, K, n_shifts)`` of the deficits of shifts ``(n_systems, n_shifts)``."""
        return _galerkin(self.stiffness, self._filled(self.mass), self.source, shifts)

    def lowest(self) -> Small:
        """``(n_systems,)`` lowest eigenvalue of the operator on each basis, an upper bound of that of A."""
        half = np.linalg.inv(np.linalg.cholesky(self._filled(self.mass)))
        turned = half @ self.stiffness @ half.transpose(0, 2, 1)
        # what stands for a column of zeros is above all others
        top = 2 * np.abs(turned).sum(axis=(1, 2))[:, None] + 1.0
        turned += np.where(self.used, 0.0, top)[:, None] * np.eye(turned.shape[1])
        return np.asarray(np.linalg.eigvalsh(turned)[:, 0])

    def extend(self, active: NDArray[np.bool_]) -> None:
        """Orthonormalise the solutions that the engine has in x against the bases, and append them."""
        overlaps = self.engine.overlaps()
        inside, gram = overlaps[:, :-LANES], overlaps[:, -LANES:]
        scale = np.sqrt(np.diagonal(gram, axis1=1, axis2=2))
        scale = np.divide(1.0, scale, out=np.zeros_like(scale), where=scale > 0)
        project = np.linalg.solve(self._filled(self.gram), inside)
        left = gram - inside.transpose(0, 2, 1) @ project
        size, direction = np.linalg.eigh(left * scale[:, :, None] * scale[:, None, :])
        keep = (size > _DEPENDENT) & active[:, None]
        length = np.sqrt(np.where(keep, size, np.inf))
        mix = scale[:, :, None] * direction / length[:, None, :]
        products = self.engine.append(mix, -project @ mix)
        self.gram, self.stiffness, self.mass = (
            _bordered(matrix, new)
            for matrix, new in zip((self.gram, self.stiffness, self.mass), products[:3], strict=True)
        )
        self.sums = np.concatenate([self.sums, products.sums], axis=1)
        self.source = np.concatenate([self.source, products.source], axis=1)

    def compress(self, index: int, shifts: Small, tolerance: float) -> Reduced:
        """Rotate one basis to the fewest orthonormal columns that carry the deficits of `shifts`.

        What is dropped changes no deficit by more than `tolerance` in the root mean square.
        """
        used, count = self.used[index], int(self.engine.counts[index])
        block = np.ix_(used, used)
        gram, mass, stiffness = (matrix[index][block] for matrix in (self.gram, self.mass, self.stiffness))
        sums, source = self.sums[index, used], self.source[index, used]
        upper = np.linalg.cholesky(gram).T
        left, size, _ = np.linalg.svd(upper @ _galerkin(stiffness, mass, source, shifts), full_matrices=False)
        rank = int(np.sum(size > tolerance * np.sqrt(count)))
        turn = np.linalg.solve(upper, left[:, :rank])
        whole = np.eye(rank + 1) * count
        whole[1:, 1:] = turn.T @ gram @ turn
        whole[0, 1:] = whole[1:, 0] = turn.T @ sums
        spread = np.zeros((used.size, rank))
        spread[used] = turn
        return Reduced(spread, whole, turn.T @ mass @ turn, turn.T @ stiffness @ turn, turn.T @ source)

    def _filled(self, matrix: Small) -> Small:
        """Put ones on the diagonal for columns of zeros."""
        return np.asarray(matrix + ~self.used[:, None] * np.eye(matrix.shape[1]))


def _galerkin(stiffness: Small, mass: Small, source: Small, shifts: Small) -> Small:
    """Solve (A + s M) y = s M·1 for each s of each system: the coefficients of 1 - v, one column each."""
    s = shifts[..., :, None, None]
    matrix = stiffness[..., None, :, :] + s * mass[..., None, :, :]
    return np.asarray(np.linalg.solve(matrix, s * source[..., None, :, None])[..., 0].swapaxes(-1, -2))


def _bordered(matrix: Small, products: Small) -> Small:
    """Append the rows and columns of a new block to symmetric reduced matrices."""
    old = matrix.shape[1]
    grown = np.zeros((matrix.shape[0], old + LANES, old + LANES))
    grown[:, :old, :old] = matrix
    grown[:, :, old:] = products
    grown[:, old:, :old] = products[:, :old].transpose(0, 2, 1)
    corner = grown[:, old:, old:]
    grown[:, old:, old:] = (corner + corner.transpose(0, 2, 1)) / 2
    return grown
