"""Shapes given by a level function, positive inside: the grid is cut where the function is zero."""

from __future__ import annotations

from collections.abc import Callable
from itertools import product

import numpy as np
from numpy.typing import ArrayLike, NDArray

from spem.errors import ParameterError, ShapeError
from spem.shapes.grids import spacing_per_axis
from spem.shapes.limits import check_size
from spem.shapes.shape import Cuts, Report, Shape

Level = Callable[[NDArray[np.float64]], NDArray[np.float64]]

# Points handed to a level function at a time: small blocks stay in cache and let the function
# leave out what is far away.
BLOCK_POINTS = 8192
# The level twice as float64 and masks: the most held for one voxel.
_BYTES_PER_VOXEL = 20
# So many voxels along an axis are over any limit, and still a whole number.
_MOST = 2.0**60
# Cuts are found to this fraction of an edge.
CUT_TOLERANCE = 1e-13
# Levels below this fraction of the largest are taken for zero.
ROUNDING = 1e-13
MAX_STEPS = 60


def implicit_shape(
    level: Level,
    low: ArrayLike,
    high: ArrayLike,
    spacing: float | tuple[float, ...],
    *,
    name: str = "shape",
    offset: float | tuple[float, ...] = 0.0,
) -> Shape:
    """Sample a level function on a grid and cut the grid's edges where the function is zero.

    Features thinner than the spacing are seen only where a voxel centre falls into them: an edge
    between two inside voxels, or between two outside ones, is not cut.

    Parameters
    ----------
    level
        Continuous function of points ``(n, d)`` with values ``(n,)``, positive inside.
    low, high
        ``(d,)`` corners of a box that holds the shape.
    spacing
        Distance between voxel centres, one for all axes or one per axis.
    name
        Short name.
    offset
        Shift of the grid in edges, one for all axes or one per axis; without it a voxel centre
        lies on `low`.

    Returns
    -------
    Shape
        Its cuts are exact to rounding.

    Raises
    ------
    ParameterError
        If the spacing is not positive, the offset is not finite or the box is empty.
    ShapeError
        If no voxel centre lies inside.
    SizeError
        If the grid would pass the memory limit, SPEM_MEMORY_LIMIT or 2 GiB.

    Examples
    --------
    >>> import numpy as np
    >>> disk = implicit_shape(lambda x: 1 - np.hypot(*x.T), (-1, -1), (1, 1), 0.25, name="disk")
    >>> disk.n_nodes, float(disk.cuts.fraction.max())
    (45, 1.0)
    """
    start, step, counts = _frame(low, high, spacing, offset, name)
    values = sample_level(level, start, step, counts)
    # A centre on the surface counts as outside on every side of the shape, whatever its rounding.
    values[np.abs(values) <= ROUNDING * values.max()] = 0.0
    inside = values > 0
    if not inside.any():
        msg = (
            f"{name}: no voxel centre lies inside the shape at spacing {step.max():.4g}; use a finer spacing"
        )
        raise ShapeError(msg)
    return Shape.from_mask(
        inside,
        tuple(step.tolist()),
        origin=tuple(start.tolist()),
        name=name,
        cuts=_cut(level, values, start, step),
        report=Report(source=name, method="sign of a level function, crossings by root finding"),
    )


def sample_level(
    level: Level, start: NDArray[np.float64], step: NDArray[np.float64], counts: tuple[int, ...]
) -> NDArray[np.float64]:
    """Return the level function on a grid, block by block.

    Parameters
    ----------
    level
        Function of points ``(m, d)`` with values ``(m,)``.
    start, step
        ``(d,)`` coordinates of the first voxel centre, and spacing.
    counts
        Number of voxels along each axis.

    Returns
    -------
    numpy.ndarray
        Array of shape `counts`.

    Examples
    --------
    >>> sample_level(lambda x: x[:, 0], np.zeros(2), np.ones(2), (3, 2)).tolist()
    [[0.0, 0.0], [1.0, 1.0], [2.0, 2.0]]
    """
    values = np.empty(counts)
    d = len(counts)
    side = max(1, round(BLOCK_POINTS ** (1 / d)))
    axes = [start[a] + step[a] * np.arange(counts[a]) for a in range(d)]
    for corner in product(*(range(0, count, side) for count in counts)):
        block = tuple(slice(i, i + side) for i in corner)
        grid = np.meshgrid(*(axis[part] for axis, part in zip(axes, block, strict=True)), indexing="ij")
        points = np.stack([g.ravel() for g in grid], axis=1)
        values[block] = level(points).reshape(grid[0].shape)
    return values


def _frame(
    low: ArrayLike,
    high: ArrayLike,
    spacing: float | tuple[float, ...],
    offset: float | tuple[float, ...],
    name: str,
) -> tuple[NDArray[np.float64], NDArray[np.float64], tuple[int, ...]]:
    """Return the first centre, the spacing and the number of voxels of a grid over a box."""
    lower, upper = np.atleast_1d(np.asarray(low, float)), np.atleast_1d(np.asarray(high, float))
    if lower.shape != upper.shape or lower.ndim != 1 or not lower.size or not np.all(upper > lower):
        msg = f"{name}: the box from {lower.tolist()} to {upper.tolist()} is empty"
        raise ParameterError(msg)
    step = np.array(spacing_per_axis(spacing, lower.size, name))
    # One layer outside the box on either side keeps the shape off the border whatever the offset.
    shift = _offsets(offset, lower.size, name) % 1.0
    start = lower + (shift - 1) * step
    counts = tuple(int(c) for c in np.minimum(np.ceil((upper - start) / step) + 2, _MOST))
    check_size(counts, _BYTES_PER_VOXEL, None, name)
    return start, step, counts


def _offsets(offset: float | tuple[float, ...], ndim: int, name: str) -> NDArray[np.float64]:
    """Return one checked shift of the grid per axis, in edges."""
    try:
        shift = np.asarray(offset, np.float64)
    except (TypeError, ValueError):
        shift = np.full(1, np.nan)
    if shift.shape not in ((), (ndim,)) or not np.isfinite(shift).all():
        msg = f"{name}: offset={offset}: expected one finite number, or {ndim} of them, one per axis"
        raise ParameterError(msg)
    return np.broadcast_to(shift, (ndim,))


def _cut(
    level: Level, values: NDArray[np.float64], start: NDArray[np.float64], step: NDArray[np.float64]
) -> Cuts:
    """Find the crossings on all edges from inside to outside."""
    inside = values > 0
    strides = np.array(inside.strides) // inside.itemsize
    flat = values.ravel()
    voxel, direction = [], []
    for axis in range(values.ndim):
        lower = inside.take(range(values.shape[axis] - 1), axis=axis)
        upper = inside.take(range(1, values.shape[axis]), axis=axis)
        for step_up, leaving in ((0, upper & ~lower), (1, lower & ~upper)):
            index = np.array(np.nonzero(leaving))
            index[axis] += 1 - step_up
            voxel.append(strides @ index)
            direction.append(np.full(index.shape[1], 2 * axis + step_up, np.uint8))
    nodes, toward = np.concatenate(voxel), np.concatenate(direction)
    axis_of, sign = toward // 2, np.where(toward % 2, 1, -1)
    origin = start + step * np.stack(np.unravel_index(nodes, values.shape), axis=1)
    edge = np.zeros_like(origin)
    edge[np.arange(nodes.size), axis_of] = sign * step[axis_of]
    fraction = _crossing(level, origin, edge, flat[nodes], flat[nodes + sign * strides[axis_of]])
    return Cuts(nodes, toward, fraction)


def _crossing(
    level: Level,
    origin: NDArray[np.float64],
    edge: NDArray[np.float64],
    inner: NDArray[np.float64],
    outer: NDArray[np.float64],
) -> NDArray[np.float64]:
    """Find zeros of the level along edges, by the Illinois method with bisection every third step."""
    near, far = np.zeros(inner.size), np.ones(inner.size)
    f_near, f_far = inner.copy(), outer.copy()
    fraction = np.where(outer == 0, 1.0, 0.5)
    last = np.zeros(inner.size, np.int8)
    live = np.flatnonzero(outer < 0)
    for count in range(MAX_STEPS):
        if not live.size:
            break
        a, b, fa, fb = near[live], far[live], f_near[live], f_far[live]
        # Bisection bounds the work where the level has a kink or is flat on one side.
        t = 0.5 * (a + b) if count % 3 == 2 else a + (b - a) * fa / (fa - fb)
        f = level(origin[live] + t[:, None] * edge[live])
        fraction[live] = t
        kept = f > 0
        side = np.where(kept, 1, -1).astype(np.int8)
        again = side == last[live]
        near[live], far[live] = np.where(kept, t, a), np.where(kept, b, t)
        f_near[live] = np.where(kept, f, np.where(again, 0.5 * fa, fa))
        f_far[live] = np.where(kept, np.where(again, 0.5 * fb, fb), f)
        last[live] = side
        done = (
            (f == 0)
            | (far[live] - near[live] <= CUT_TOLERANCE)
            | (np.abs(t - np.where(kept, a, b)) <= CUT_TOLERANCE)
        )
        live = live[~done]
    return np.maximum(fraction, np.finfo(float).tiny)
