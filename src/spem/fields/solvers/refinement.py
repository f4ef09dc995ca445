"""Iterative refinement: conjugate gradients of an engine, in single precision, added up in double."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from spem.fields.solvers.engine import LANES, Small, SourceEngine

# Gradients are stopped on √(r·z), which is not the norm of r; a miss costs another refinement.
_MARGIN = 0.3
# What a refinement leaves of a residual: at least what single precision ends at, at most what is worth one.
_ROUND = (1e-5, 0.1)
# A refinement that leaves more than this of a residual, in both norms, has met the rounding of double
# precision. One alone may stay: of long shapes r·z holds the slow part of a residual, r·r the fast.
_STALLED = 0.5

Counts = NDArray[np.int64]
Mask = NDArray[np.bool_]


class Refined(NamedTuple):
    """Solutions for several right-hand sides.

    Parameters
    ----------
    values
        ``(n_nodes, k)`` solutions.
    residual
        ``(k,)`` ‖b - (A + s M) v‖ / ‖b‖, in double precision; 0 where b is zero.
    spent
        ``(k,)`` iterations spent on each.
    """

    values: NDArray[np.float64]
    residual: NDArray[np.float64]
    spent: Counts


def refine(
    engine: SourceEngine, rhs: NDArray[np.float64], shifts: NDArray[np.float64], *, rtol: float, limit: int
) -> Refined:
    """Solve (A + s M) v = b for several b, each with its s, on an engine of copies of one system.

    An answer does not depend on what else is solved for, or where, bit by bit.

    Parameters
    ----------
    engine
        It holds one or more copies of the system, each good for `LANES` right-hand sides.
    rhs
        ``(n_nodes, k)`` right-hand sides, no more than the engine has lanes.
    shifts
        ``(k,)`` s of each, in 1/length².
    rtol
        Tolerance on the residual, relative to b.
    limit
        Most iterations for each right-hand side.
    """
    copies, count, square = engine.counts.size, rhs.shape[1], float(engine.units[0]) ** 2
    # Powers of two change no digit, and keep single precision in its range.
    exponent = np.frexp(np.abs(rhs).max(axis=0, initial=0.0) * square)[1]
    columns = np.zeros((copies * LANES, rhs.shape[0]))
    columns[:count] = np.ldexp(rhs * square, -exponent).T
    lanes = np.full(copies * LANES, shifts[-1] * square)
    lanes[:count] = shifts * square
    groups = [np.ascontiguousarray(group.T) for group in columns.reshape(copies, LANES, -1)]
    residual, spent = _refine(engine, groups, lanes.reshape(copies, LANES), rtol, limit)
    values = np.concatenate(engine.solution(), axis=1)[:, :count]
    return Refined(np.ldexp(values, exponent), residual.ravel()[:count], spent.ravel()[:count])


def _refine(
    engine: SourceEngine, groups: list[NDArray[np.float64]], shifts: Small, rtol: float, limit: int
) -> tuple[Small, Counts]:
    """Go on with each lane until it meets the tolerance, stalls, or has had enough.

    That depends on the lane alone, so its answer does not depend on its neighbours'.
    """
    square = engine.load(groups)
    going = square != 0
    residual, spent = np.where(going, np.inf, 0.0), np.zeros(square.shape, np.int64)
    product = residual
    while going.any():
        before, last = residual.copy(), product
        product, rest = engine.refine(shifts, going.any(axis=1))
        residual[going] = np.sqrt(rest[going] / square[going])
        better = (residual <= _STALLED * before) | (product <= _STALLED**2 * last)
        going &= (residual > rtol) & better & (spent < limit)
        if going.any():
            goal = np.ones_like(residual)
            goal[going] = np.clip(_MARGIN * rtol / residual[going], *_ROUND)
            _iterate(engine, product, goal**2 * product, going, spent, limit)
    return residual, spent


def _iterate(
    engine: SourceEngine, product: Small, goal: Small, going: Mask, spent: NDArray[np.int64], limit: int
) -> None:
    """Conjugate gradients until r·z of every lane is down to its goal; lanes at rest take steps of zero."""
    moving, beta = going.copy(), None
    while moving.any():
        engine.select(np.asarray(moving.any(axis=1)))
        alpha = _ratio(product, engine.search(beta), moving)
        new = engine.improve(alpha)
        spent += moving
        beta = _ratio(new, product, moving)
        product = new
        moving &= (new > goal) & (alpha > 0) & (spent < limit)


def _ratio(numerator: Small, denominator: Small, wanted: Mask) -> Small:
    """Quotient by lane, zero where it is not wanted or has nothing to divide."""
    return np.divide(numerator, denominator, out=np.zeros_like(numerator), where=wanted & (denominator > 0))
