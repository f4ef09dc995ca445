"""Logarithms of fields that leave the range of float64: scaled right-hand sides, and tails solved apart.

A field of one source falls like e^(-πd/w) along a part of width w, and faster under screening. Where it is
below about 1e-270, numbers of the factor may have underflowed, so it is solved again on the nodes where it is
that small: the nodes around them are the boundary there, with known values, scaled up.
"""

from __future__ import annotations

import numpy as np
import scipy.sparse
from numpy.typing import NDArray

from spem.fields.operator import System, assemble
from spem.fields.solvers.protocol import SourceSolver
from spem.shapes.shape import Cuts, Shape

# Right-hand sides are scaled to this power of two: what a solve adds up stays below 2^1024, and what it
# drops by underflow is far below the smallest value that is trusted.
_TOP = 1000
# A number of the factor that underflowed, so below 2^-1022, adds nothing to a value above this.
_TRUSTED = -900
# Fields share the solve of their tails when the nodes of all are at most so many times those of the smallest.
_ALIKE = 1.25
_LN2 = float(np.log(2.0))


def scaled(rhs: NDArray[np.float64]) -> tuple[NDArray[np.float64], int]:
    """Scale right-hand sides ``(n_nodes, k)`` ≥ 0 by 2^exponent: then small solutions are normal numbers."""
    largest = float(rhs.sum(axis=0).max(initial=0.0))
    exponent = _TOP - max(int(np.frexp(largest)[1]), 0)
    return np.ldexp(rhs, exponent), exponent


def logs(solution: NDArray[np.float64], exponent: int) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    """Logarithms ``(k, n_nodes)`` of a scaled solution ``(n_nodes, k)``, and which are too small to trust."""
    log = np.array(solution.T, order="C")
    with np.errstate(divide="ignore", under="ignore"):
        np.ldexp(log, -exponent, out=log)
        np.log(log, out=log)
    return log, log < _TRUSTED * _LN2


def solve_tails(
    system: System,
    shift: float,
    solver: SourceSolver,
    rhs: scipy.sparse.csc_array,
    log: NDArray[np.float64],
    low: NDArray[np.bool_],
) -> None:
    """Replace the marked logarithms by right ones.

    Parameters
    ----------
    system
        The system.
    shift
        1/ρ².
    solver
        One that is right in every entry.
    rhs
        ``(n_nodes, k)`` right-hand sides.
    log
        ``(k, n_nodes)`` logarithms of the solutions, written to where `low` says.
    low
        ``(k, n_nodes)`` True where they are too small to trust; the solution is positive there.
    """
    waiting = [np.flatnonzero(low.any(axis=1))]
    while waiting:
        group = waiting.pop()
        far = np.asarray(low[group].any(axis=0))
        if group.size > 1 and not _alike(rhs[:, group], low[group], far):
            waiting += [group[: group.size // 2], group[group.size // 2 :]]
        elif group.size:
            wanted = low[group][:, far]
            tails = _tails(system, shift, solver, log[group], far, wanted)
            log[np.ix_(group, far)] = np.where(wanted, tails, log[group][:, far])


def _alike(rhs: scipy.sparse.csc_array, low: NDArray[np.bool_], far: NDArray[np.bool_]) -> bool:
    """Whether fields can share a solve on the far nodes: none has its source there, and most want most."""
    return not far[rhs.indices].any() and bool(far.sum() <= _ALIKE * low.sum(axis=1).min())


def _tails(
    system: System,
    shift: float,
    solver: SourceSolver,
    log: NDArray[np.float64],
    far: NDArray[np.bool_],
    wanted: NDArray[np.bool_],
) -> NDArray[np.float64]:
    """Logarithms ``(k, n_far)`` on the far nodes, from those on the nodes around them."""
    nodes = np.flatnonzero(far)
    rows = system.matrix().tocsr()[nodes]
    near = np.setdiff1d(rows.indices, nodes)
    known = log[:, near]
    top = known.max(axis=1, keepdims=True)
    with np.errstate(under="ignore"):
        data = -rows[:, near] @ np.exp(known - top).T
    part = far_system(system, far)
    dense, exponent = scaled(data)
    found, low = logs(solver.prepare(part, shift).solve(dense), exponent)
    low &= wanted
    if low.any():
        solve_tails(part, shift, solver, scipy.sparse.csc_array(data), found, low)
    return np.asarray(found + top)


def far_system(system: System, far: NDArray[np.bool_]) -> System:
    """Return the system on some of the nodes: the others around them become boundary.

    Its matrix is the block of A + M/ρ² of these nodes: an edge to another node counts as cut at its end.
    """
    domain, d = system.domain, system.shape.ndim
    fraction = np.ones((system.n_nodes, 2 * d))
    fraction[domain.neighbours == system.n_nodes] = domain.fraction
    leaves = np.append(~far, True)[domain.neighbours[far]]
    node, direction = np.nonzero(leaves)
    mask = np.zeros(system.shape.mask.shape, bool)
    voxels = system.shape.voxels[far]
    mask.flat[voxels] = True
    cuts = Cuts(voxels[node], direction.astype(np.uint8), fraction[far][leaves])
    part = Shape.from_mask(mask, system.shape.spacing, name=system.shape.name, cuts=cuts)
    return assemble(part, "surface")
