"""Lowest eigenpairs of a screened operator: block Lanczos on its inverse, which a factorisation gives."""

from __future__ import annotations

from dataclasses import dataclass
from math import factorial

import numpy as np
import scipy.linalg
import scipy.sparse
import scipy.sparse.linalg
from numpy.typing import NDArray

from spem.errors import ConvergenceError, ParameterError, SizeError
from spem.fields.operator import System
from spem.fields.solvers.blas import one_thread
from spem.fields.solvers.direct import Direct
from spem.fields.solvers.protocol import Prepared
from spem.shapes.limits import memory_limit_bytes

Array = NDArray[np.float64]
# A block smaller than an eigenspace would see a part of it: reflections and swaps of axes, which maps of
# grids onto themselves are made of, make spaces of up to d! dimensions. SuperLU is quick with few vectors at
# a time, the multifrontal factor with more.
_PLANE_BLOCK, _BLOCK, _LARGEST_BLOCK = 4, 12, 24
# Below this many nodes for each pair a dense factorisation takes less time than the iteration.
_DENSE_SHARE, _DENSE_NODES = 4, 400
# The basis may grow to this many times the number of pairs; three to four times is what is needed.
_GROWTH = 10
# When to look at what has converged first, in pairs, and the share by which the basis grows for each decade
# that the residual has to fall.
_FIRST_LOOK, _PER_DECADE = 2.5, 0.04
_SEED = 0
# What rounding leaves of a residual, on grids of any size that fits.
_FINEST = 1e-12


@dataclass(frozen=True)
class BlockLanczos:
    """Shift-and-invert block Lanczos with full reorthogonalisation, from a fixed start.

    Parameters
    ----------
    rtol
        Tolerance on ‖A φ − λ M φ‖ / (λ_n ‖M φ‖) of each pair, in the norm of M⁻¹, λ_n being the largest value
        wanted; values are right to its square.
    memory_limit
        Most bytes for the basis, and for the factor; SPEM_MEMORY_LIMIT or 2 GiB by default.

    Raises
    ------
    ParameterError
        When the tolerance is finer than rounding leaves.

    Examples
    --------
    >>> from spem.fields.operator import assemble
    >>> from spem.shapes.shape import Shape
    >>> system = assemble(Shape.from_mask(np.ones(3)), "voxel")
    >>> BlockLanczos().lowest(system, 2, shift=0.0)[0].round(4)
    array([0.5858, 2.    ])
    """

    rtol: float = 1e-6
    memory_limit: int | None = None

    def __post_init__(self) -> None:
        if not _FINEST <= self.rtol < 1:
            msg = f"rtol={self.rtol!r}: expected {_FINEST:g} to 1"
            raise ParameterError(msg)

    def lowest(self, system: System, n_pairs: int, shift: float) -> tuple[Array, Array]:
        """Find the pairs A φ = λ M φ of least λ, on a connected domain.

        Parameters
        ----------
        system
            A and M.
        n_pairs
            How many, at most the number of nodes.
        shift
            What is added to the values for A + shift·M to be positive definite; small against the values
            wanted.

        Returns
        -------
        values, vectors
            ``(n_pairs,)`` ascending, and ``(n_nodes, n_pairs)`` with φᵀ M φ = 1.

        Raises
        ------
        SizeError
            When the basis or the factor would take more memory than the limit.
        ConvergenceError
            When the tolerance was missed.
        """
        n, root = system.n_nodes, np.sqrt(system.mass)
        with one_thread():
            if n <= max(_DENSE_NODES, _DENSE_SHARE * n_pairs):
                dense = system.matrix().toarray() / (root[:, None] * root)
                values, vectors = scipy.linalg.eigh(dense, subset_by_index=(0, n_pairs - 1))
            else:
                values, vectors = self._iterate(system, n_pairs, shift, root)
        return values, np.ascontiguousarray(vectors / root[:, None])

    def _iterate(self, system: System, n_pairs: int, shift: float, root: Array) -> tuple[Array, Array]:
        """Extend the basis by a block after the other until the wanted pairs of the inverse are in it."""
        plane = system.shape.ndim <= 2
        width = _PLANE_BLOCK if plane else min(max(_BLOCK, factorial(system.shape.ndim)), _LARGEST_BLOCK)
        capacity = min(system.n_nodes // width, _GROWTH * (n_pairs // width + 4)) * width
        self._check_memory(system, n_pairs, width)
        inverse = (
            _superlu(system, shift)
            if plane
            else Direct(memory_limit=self.memory_limit).prepare(system, shift)
        )
        krylov = _Krylov.start(inverse, root, width, capacity)
        matrix = system.matrix(shift)
        look = int(_FIRST_LOOK * n_pairs) + width
        while True:
            krylov.extend()
            if krylov.size < min(look, capacity):
                continue
            lifted, mix, residual = krylov.pairs(n_pairs, matrix)
            worst = float(residual.max() * lifted[-1])
            if worst <= self.rtol:
                return 1 / lifted - shift, krylov.basis[:, : len(mix)] @ mix
            look = int(krylov.size * (1 + _PER_DECADE * np.log10(worst / self.rtol)))
            if krylov.size >= capacity:
                msg = (
                    f"{system.shape.name}: {n_pairs} eigenpairs have a residual of {worst:.1e} from a basis "
                    f"of {capacity} vectors, expected {self.rtol:g}; raise rtol"
                )
                raise ConvergenceError(msg)

    def _check_memory(self, system: System, n_pairs: int, width: int) -> None:
        """Refuse a basis that would take more memory than the limit."""
        needed, limit = 8 * system.n_nodes * 5 * (n_pairs + width), memory_limit_bytes(self.memory_limit)
        if needed > limit:
            msg = (
                f"{system.shape.name}: {n_pairs} eigenpairs of {system.n_nodes} nodes take "
                f"{needed / 2**30:.1f} GiB, the limit is {limit / 2**30:.1f} GiB; use fewer voxels or pairs, "
                "or raise SPEM_MEMORY_LIMIT"
            )
            raise SizeError(msg)


def _superlu(system: System, shift: float) -> Prepared:
    """Factor by minimum degree: in the plane there is little to fill in."""
    factor: Prepared = scipy.sparse.linalg.splu(
        system.matrix(shift),
        permc_spec="MMD_AT_PLUS_A",
        diag_pivot_thresh=0.0,
        options={"SymmetricMode": True},
    )
    return factor


@dataclass
class _Krylov:
    """A growing orthonormal basis of blocks Q_j with K Q_j in the span of the next, and Qᵀ K Q."""

    inverse: Prepared
    root: Array
    basis: Array
    projected: Array
    block: Array
    size: int
    coupling: Array

    @classmethod
    def start(cls, inverse: Prepared, root: Array, width: int, capacity: int) -> _Krylov:
        """Start with random vectors, the same each time."""
        rng = np.random.default_rng(_SEED)
        block = np.linalg.qr(rng.standard_normal((root.size, width)))[0]
        basis = np.empty((root.size, capacity), order="F")
        return cls(inverse, root, basis, np.zeros((capacity, capacity)), block, 0, np.zeros((width, width)))

    def extend(self) -> None:
        """Add a block to the basis, and make the next of it."""
        m, p = self.size, self.block.shape[1]
        own = slice(m, m + p)
        self.basis[:, own] = self.block
        image = self.root[:, None] * self.inverse.solve(self.root[:, None] * self.block)
        if m:
            before = slice(m - p, m)
            image -= self.basis[:, before] @ self.coupling.T
            self.projected[before, own] = self.coupling.T
            self.projected[own, before] = self.coupling
        diagonal = self.block.T @ image
        self.projected[own, own] = (diagonal + diagonal.T) / 2
        image -= self.block @ diagonal
        known = self.basis[:, : m + p]
        image -= known @ (known.T @ image)  # what rounding leaves of the blocks before
        self.block, self.coupling = np.linalg.qr(image)
        self.size = m + p

    def pairs(self, count: int, matrix: scipy.sparse.csc_array) -> tuple[Array, Array, Array]:
        """Return the largest values θ of K in the basis, their coefficients, and residuals of K⁻¹.

        With K y = θ y + r, K⁻¹ y − y/θ = −K⁻¹ r/θ, and all r are in the next block.
        """
        m, p = self.size, self.block.shape[1]
        values, mix = np.linalg.eigh(self.projected[:m, :m])  # faster than a part of the values alone
        values, mix = values[::-1][:count], mix[:, ::-1][:, :count]
        applied = (matrix @ (self.block / self.root[:, None])) / self.root[:, None]
        ahead = np.linalg.qr(applied, mode="r") @ (self.coupling @ mix[m - p :])
        return values, mix, np.linalg.norm(ahead, axis=0) / values
