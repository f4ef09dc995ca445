"""The boundary divided into connected patches of nearly equal area, each one source (5.1)."""

from __future__ import annotations

import heapq
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spem.errors import ParameterError
from spem.fields.boundary.cells import equal_cells
from spem.fields.boundary.sources import Sources, point_sources
from spem.fields.operator import System


def patch_sources(system: System, count: int, rng: np.random.Generator | None = None) -> Sources:
    """Divide the boundary of a system into patches of nearly equal area, each one source (5.1).

    In 2-D a patch is an arc of a contour. On surfaces patches are the cells of a power diagram, grown over
    the surface from their seeds, so that none jumps through space from one limb to another; seeds move to
    the centroids of their cells, and weights make the areas equal. Each connected piece of boundary has
    patches of its own. Where pieces are larger than a patch and a patch has ten points or more, the largest
    is at most 1.3 times the mean.

    Parameters
    ----------
    system
        The system whose boundary is divided.
    count
        Number of patches: at least one for each connected piece, at most the number of boundary points.
    rng
        Draws where the first seed of each piece lies, or the first arc of a contour begins: by default at
        its first point.

    Returns
    -------
    patches
        Every boundary point is in one of them; numbered by their first point.

    Raises
    ------
    ParameterError
        When there are fewer points, or more connected pieces of boundary, than patches.

    Examples
    --------
    >>> from spem.fields.operator import assemble
    >>> from spem.shapes.synthetic import ball
    >>> patches = patch_sources(assemble(ball(1.0, 0.1)), 20)
    >>> bool(patches.measure.max() / patches.measure.mean() < 1.1)
    True
    """
    return divide_points(point_sources(system), count, rng)


def divide_points(single: Sources, count: int, rng: np.random.Generator | None = None) -> Sources:
    """Divide the boundary as `patch_sources` does, by its points that are known already.

    Parameters
    ----------
    single
        Sources of one point each, from `spem.fields.boundary.sources.point_sources`.
    count, rng
        As for `patch_sources`.

    Raises
    ------
    ParameterError
        As `patch_sources` does.

    Examples
    --------
    >>> from spem.fields.operator import assemble
    >>> from spem.shapes.synthetic import disk
    >>> divide_points(point_sources(assemble(disk(1.0, 0.1))), 12).n_sources
    12
    """
    contour, measure = single.points.contour, single.points.measure
    _check_count(count, single)
    area = np.bincount(contour, measure).astype(np.float64)
    shares = _apportion(area, np.bincount(contour), int(count))
    offsets = np.zeros(shares.size, np.int64) if rng is None else rng.integers(np.bincount(contour))
    divide = _arcs if single.system.shape.ndim == 2 else equal_cells
    group = divide(single, shares, offsets)
    _, first, inverse = np.unique(group, return_index=True, return_inverse=True)
    return replace(single, group=np.argsort(np.argsort(first)).astype(np.int32)[inverse])


def _check_count(count: Any, single: Sources) -> None:
    """Refuse a number of patches that the boundary does not have."""
    name, n, pieces = single.system.shape.name, single.points.n_points, single.points.n_contours
    if isinstance(count, bool) or not isinstance(count, int | np.integer) or count < 1:
        msg = f"{name}: the number of patches must be a whole number from {pieces} to {n}, got {count!r}"
        raise ParameterError(msg)
    if count > n:
        msg = f"{name}: the boundary has {n} points, too few for {count} patches; ask for at most {n}"
        raise ParameterError(msg)
    if count < pieces:
        msg = (
            f"{name}: the boundary has {pieces} separate pieces, too many for {count} patches; ask for at "
            f"least {pieces}"
        )
        raise ParameterError(msg)


def _apportion(area: NDArray[np.float64], points: NDArray[np.int64], count: int) -> NDArray[np.int64]:
    """Share patches out to pieces: one each, then to that whose patches are largest, while it has points."""
    shares = np.ones(area.size, np.int64)
    queue = [(-a, piece) for piece, a in enumerate(area.tolist()) if points[piece] > 1]
    heapq.heapify(queue)
    for _ in range(count - area.size):
        piece = queue[0][1]
        shares[piece] += 1
        if shares[piece] < points[piece]:
            heapq.heapreplace(queue, (-float(area[piece]) / int(shares[piece]), piece))
        else:
            heapq.heappop(queue)
    return shares


def _arcs(single: Sources, shares: NDArray[np.int64], offsets: NDArray[np.int64]) -> NDArray[np.int64]:
    """Cut each contour, from its offset on, into arcs of nearly equal length."""
    contour, measure = single.points.contour, single.points.measure
    group = np.empty(contour.size, np.int64)
    before = 0
    for piece, (share, offset) in enumerate(zip(shares.tolist(), offsets, strict=True)):
        along = np.roll(np.flatnonzero(contour == piece), -offset)
        length = np.cumsum(measure[along])
        ends = length[-1] / share * np.arange(1, share)
        cuts = np.searchsorted(length - measure[along] / 2, ends)
        # no arc is empty
        rank = np.arange(1, share)
        cuts = np.maximum.accumulate(np.maximum(cuts, rank) - rank) + rank
        cuts = np.minimum(cuts, along.size - share + rank)
        group[along] = before + np.searchsorted(cuts, np.arange(along.size), side="right")
        before += share
    return group
