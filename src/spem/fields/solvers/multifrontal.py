"""Multifrontal Cholesky factorisation of a screened operator: dense blocks along a nested dissection."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray
from scipy.linalg.blas import dsyrk, dtrsm
from scipy.linalg.lapack import dpotrf

from spem.errors import ParameterError, SizeError
from spem.fields.operator import System
from spem.fields.solvers.blas import one_thread
from spem.fields.solvers.dissection import Dissection, dissect
from spem.shapes.limits import memory_limit_bytes

# Rows, ascending, and the lower part of the matrix that a front adds to its parent.
_Update = tuple[NDArray[np.int32], NDArray[np.float64]]


@dataclass(frozen=True, eq=False)
class Factor:
    """L of L Lᵀ = A + s M, with the nodes in the order of a dissection.

    L has a positive diagonal and no positive entry off it, so for a right-hand side without negative entries
    the solution is made of sums of non-negative terms only: each entry is right in relative terms.

    Parameters
    ----------
    dissection
        The order of elimination and its fronts.
    diagonal
        Lower triangular block of each front, ``(columns, columns)``.
    below
        Block that couples each front to its rows, ``(rows, columns)``.
    """

    dissection: Dissection
    diagonal: list[NDArray[np.float64]]
    below: list[NDArray[np.float64]]

    @property
    def nbytes(self) -> int:
        """Bytes that the factor holds."""
        return 8 * self.dissection.n_entries

    def solve(self, rhs: NDArray[np.float64]) -> NDArray[np.float64]:
        """Solve for right-hand sides ``(n_nodes,)`` or ``(n_nodes, k)``; the result has their shape."""
        d = self.dissection
        x = np.array(rhs.reshape(d.order.size, -1)[d.order], np.float64, order="C")
        with one_thread():
            self._forward(x)
            self._backward(x)
        solution = np.empty_like(x)
        solution[d.order] = x
        return solution.reshape(rhs.shape)

    def _forward(self, x: NDArray[np.float64]) -> None:
        """Overwrite x with L⁻¹ x, skipping the fronts below which every right-hand side is zero."""
        d = self.dissection
        used = np.add.reduceat(np.any(x != 0, axis=1), d.start[:-1]) > 0
        for f in range(d.n_fronts):
            if not used[f]:
                continue
            own = x[d.start[f] : d.start[f + 1]]
            own[:] = dtrsm(1.0, self.diagonal[f], own.T, side=1, lower=1, trans_a=1, overwrite_b=1).T
            if d.parent[f] >= 0:
                used[d.parent[f]] = True
                rows = d.rows[d.row_start[f] : d.row_start[f + 1]]
                x[rows] -= self.below[f] @ own

    def _backward(self, x: NDArray[np.float64]) -> None:
        """Overwrite x with L⁻ᵀ x."""
        d = self.dissection
        for f in reversed(range(d.n_fronts)):
            own = x[d.start[f] : d.start[f + 1]]
            if d.parent[f] >= 0:
                rows = d.rows[d.row_start[f] : d.row_start[f + 1]]
                own -= self.below[f].T @ x[rows]
            own[:] = dtrsm(1.0, self.diagonal[f], own.T, side=1, lower=1, overwrite_b=1).T


def factorize(system: System, shift: float, *, memory_limit: int | None = None) -> Factor:
    """Factor A + shift·M.

    Parameters
    ----------
    system
        The screened operator of a shape.
    shift
        1/ρ², at least 0.
    memory_limit
        Most bytes to take; SPEM_MEMORY_LIMIT or 2 GiB by default.

    Raises
    ------
    SizeError
        When the factor and what it needs on the way would take more.
    ParameterError
        When the shift is too large for a number.

    Examples
    --------
    >>> import numpy as np
    >>> from spem.fields.operator import assemble
    >>> from spem.shapes.shape import Shape
    >>> system = assemble(Shape.from_mask(np.ones(3)), "voxel")
    >>> factorize(system, 0.0).solve(np.array([1.0, 0.0, 0.0]))
    array([0.75, 0.5 , 0.25])
    """
    index = np.stack(np.unravel_index(system.shape.voxels, system.shape.mask.shape), axis=1)
    d = dissect(system.domain, index.astype(np.int32))
    _check_memory(system, d, memory_limit)
    values = system.diagonal + shift * system.mass
    if not np.isfinite(values).all():
        msg = f"{system.shape.name}: 1/rho² = {shift:g} is beyond what numbers hold; use a larger rho"
        raise ParameterError(msg)
    with one_thread():
        return Factor(d, *_eliminate(system, values, d))


def _eliminate(
    system: System, values: NDArray[np.float64], d: Dissection
) -> tuple[list[NDArray[np.float64]], list[NDArray[np.float64]]]:
    """Eliminate front after front; each hands its update to its parent."""
    diagonal: list[NDArray[np.float64]] = []
    below: list[NDArray[np.float64]] = []
    waiting: dict[int, list[_Update]] = {}
    for f in range(d.n_fronts):
        rows = d.rows[d.row_start[f] : d.row_start[f + 1]]
        own, coupling, update = _front(system, values, d, f, waiting.pop(f, []))
        own, _ = dpotrf(own, lower=1, clean=0, overwrite_a=1)  # no pivot of an M-matrix fails
        if rows.size:
            coupling = dtrsm(1.0, own, coupling, side=1, lower=1, trans_a=1, overwrite_b=1)
            update = dsyrk(-1.0, coupling, beta=1.0, c=update, lower=1, overwrite_c=1)
            waiting.setdefault(int(d.parent[f]), []).append((rows, update))
        diagonal.append(own)
        below.append(coupling)
    return diagonal, below


def _check_memory(system: System, d: Dissection, memory_limit: int | None) -> None:
    """Refuse a factorisation that would take more memory than the limit."""
    needed, limit = 8 * d.peak_entries, memory_limit_bytes(memory_limit)
    if needed > limit:
        msg = (
            f"{system.shape.name}: factoring {system.n_nodes} nodes takes {needed / 2**30:.1f} GiB, "
            f"the limit is {limit / 2**30:.1f} GiB; use fewer voxels, or raise SPEM_MEMORY_LIMIT"
        )
        raise SizeError(msg)


def _front(
    system: System, values: NDArray[np.float64], d: Dissection, f: int, children: list[_Update]
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Lower part of a front to be eliminated: own block, coupling to its rows, update of the rows."""
    start, end = d.start[f], d.start[f + 1]
    rows = d.rows[d.row_start[f] : d.row_start[f + 1]]
    own = np.zeros((end - start, end - start), order="F")
    coupling = np.zeros((rows.size, end - start), order="F")
    update = np.zeros((rows.size, rows.size), order="F")
    neighbours = system.domain.neighbours
    _assemble(own, coupling, d.order, d.rank, start, end, rows, neighbours, values, system.weights)
    for child_rows, child in children:
        _extend_add(own, coupling, update, start, end, rows, child_rows, child)
    return own, coupling, update


@njit(cache=True, nogil=True)
def _assemble(
    own: NDArray[np.float64],
    coupling: NDArray[np.float64],
    order: NDArray[np.int32],
    rank: NDArray[np.int32],
    start: int,
    end: int,
    rows: NDArray[np.int32],
    neighbours: NDArray[np.int32],
    values: NDArray[np.float64],
    weights: NDArray[np.float64],
) -> None:
    """Enter the operator's own coefficients of one front, lower part."""
    n = order.size
    for p in range(start, end):
        node = order[p]
        own[p - start, p - start] = values[node]
        for k in range(neighbours.shape[1]):
            j = neighbours[node, k]
            if j == n or rank[j] < p:
                continue
            if rank[j] < end:
                own[rank[j] - start, p - start] = -weights[k // 2]
            else:
                coupling[np.searchsorted(rows, rank[j]), p - start] = -weights[k // 2]


@njit(cache=True, nogil=True)
def _extend_add(
    own: NDArray[np.float64],
    coupling: NDArray[np.float64],
    update: NDArray[np.float64],
    start: int,
    end: int,
    rows: NDArray[np.int32],
    child_rows: NDArray[np.int32],
    child: NDArray[np.float64],
) -> None:
    """Add the update of a child to the lower part of its parent's front."""
    m = child_rows.size
    place = np.empty(m, np.int64)
    split = np.searchsorted(child_rows, end)
    place[:split] = child_rows[:split] - start
    place[split:] = np.searchsorted(rows, child_rows[split:])
    for j in range(split):
        for i in range(j, split):
            own[place[i], place[j]] += child[i, j]
        for i in range(split, m):
            coupling[place[i], place[j]] += child[i, j]
    for j in range(split, m):
        for i in range(j, m):
            update[place[i], place[j]] += child[i, j]
