"""From a level function on a grid to a shape whose surface is where the function crosses zero."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any, Literal, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from spem.errors import ParameterError, ShapeError
from spem.shapes.shape import Cuts, Report, Shape

# The sign that a signed distance has inside.
Side: TypeAlias = Literal["negative", "positive"]
# Bins of Otsu's method, and how many values are put into them at a time.
_BINS, _BLOCK = 256, 1 << 16


def level_shape(
    level: ArrayLike,
    spacing: float | tuple[float, ...] = 1.0,
    *,
    origin: tuple[float, ...] | None = None,
    name: str = "shape",
    report: Report | None = None,
    affine: NDArray[np.float64] | None = None,
) -> Shape:
    """Make a shape from a level function: positive inside, zero on the surface.

    An edge from an inside node of value a > 0 to an outside node of value b <= 0 is cut at the
    fraction a / (a - b), by linear interpolation.

    Parameters
    ----------
    level
        ``(n_0, ..., n_{d-1})`` values at the voxel centres, any d >= 1.
    spacing
        One spacing for all axes, or one per axis.
    origin
        Coordinates of the centre of ``level[0, ..., 0]``; zeros by default.
    name
        Short name for messages and pictures.
    report
        What was done so far; padding is added to it.
    affine
        Kept with the shape.

    Raises
    ------
    ShapeError
        When a value is NaN, infinite or masked, or none is positive.

    Examples
    --------
    >>> shape = level_shape([-0.5, 0.5, 1.5, 0.5, -1.5])
    >>> shape.cuts.fraction
    array([0.5 , 0.25])
    """
    refuse_masked(level, name)
    values = np.asarray(level)
    if not np.issubdtype(values.dtype, np.floating):
        values = values.astype(np.float64)
    refuse_non_finite(values, name)
    inside = values > 0
    return Shape.from_mask(
        inside,
        spacing,
        origin=origin,
        name=name,
        cuts=_linear_cuts(values, inside),
        report=(report or Report(method="level function")).with_repair(*border_repairs(inside)),
        affine=affine,
    )


def signed_distance_shape(
    array: ArrayLike,
    spacing: float | tuple[float, ...] = 1.0,
    *,
    inside: Side = "negative",
    origin: tuple[float, ...] | None = None,
    name: str = "shape",
    report: Report | None = None,
    affine: NDArray[np.float64] | None = None,
) -> Shape:
    """Make a shape from a signed distance to its surface, which is where it is zero.

    Parameters
    ----------
    array
        ``(n_0, ..., n_{d-1})`` signed distance at the voxel centres.
    spacing
        One spacing for all axes, or one per axis.
    inside
        The sign that the distance has inside.
    origin
        Coordinates of the centre of ``array[0, ..., 0]``; zeros by default.
    name
        Short name for messages and pictures.
    report
        What was done so far; padding is added to it.
    affine
        Kept with the shape.

    Raises
    ------
    ShapeError
        When a value is NaN, infinite or masked, or no value has the inside's sign.
    ParameterError
        When `inside` is neither word.

    Examples
    --------
    >>> x = np.linspace(-2, 2, 9)
    >>> signed_distance_shape(np.hypot(x[:, None], x) - 1.2, 0.5)
    Shape('shape', 2-D, 21 nodes, grid 7 x 7, spacing 0.5 x 0.5)
    """
    if inside not in ("negative", "positive"):
        msg = f"{name}: signed distance {inside!r} inside: expected 'negative' or 'positive'"
        raise ParameterError(msg)
    refuse_masked(array, name)
    values = np.asarray(array, dtype=np.float64)
    refuse_non_finite(values, name)
    level = values if inside == "positive" else -values
    if not (level > 0).any():
        other = "positive" if inside == "negative" else "negative"
        msg = (
            f"{name}: the signed distance is nowhere {inside}, so nothing is inside; "
            f"if it is {other} inside, say {other!r}"
        )
        raise ShapeError(msg)
    report = report or Report(method=f"signed distance, {inside} inside")
    return level_shape(level, spacing, origin=origin, name=name, report=report, affine=affine)


def otsu_level(values: NDArray[Any]) -> float:
    """Return the level that splits values into the two classes of greatest variance between them.

    Otsu's method on 256 bins; of levels that do equally well, as in a gap between two peaks, the
    middle one.

    Parameters
    ----------
    values
        Numbers, not all equal.

    Examples
    --------
    >>> round(otsu_level(np.array([0.0, 0.1, 0.2, 7.8, 7.9, 8.0])))
    4
    """
    low, high = float(values.min()), float(values.max())
    # scaled by a power of two, then to [0, 1]: neither overflows and neither rounds far
    exponent = math.frexp(max(abs(low), abs(high)))[1]
    start = math.ldexp(low, -exponent)
    span = math.ldexp(high, -exponent) - start
    counts = np.zeros(_BINS, np.int64)
    flat = values.reshape(-1)
    for first in range(0, flat.size, _BLOCK):
        scaled = (np.ldexp(flat[first : first + _BLOCK].astype(np.float64), -exponent) - start) / span
        counts += np.bincount(np.minimum((_BINS * scaled).astype(np.int64), _BINS - 1), minlength=_BINS)
    share = _otsu_share(counts)
    level = math.ldexp(start + share * span, exponent)
    # in the precision of the values themselves, the highest must stay above
    floating = np.issubdtype(values.dtype, np.floating)
    return level if not floating or float(values.dtype.type(level)) < high else low


def _otsu_share(counts: NDArray[np.int64]) -> float:
    """Return the part of the range at which two classes of a histogram over [0, 1] differ most."""
    centres = (np.arange(_BINS) + 0.5) / _BINS
    below = np.cumsum(counts)[:-1].astype(np.float64)
    above = counts.sum() - below
    first = np.cumsum(counts * centres)
    means = first[:-1] / below - (first[-1] - first[:-1]) / above
    between = below * above * means**2
    best = np.flatnonzero(between >= between.max() * (1 - 1e-9))
    return float((best[0] + best[-1] + 2) / (2 * _BINS))


def refuse_masked(values: Any, name: str) -> None:
    """Raise ShapeError with the count and the first place of masked entries of a NumPy array, if any."""
    if not np.ma.is_masked(values):
        return
    masked = np.ma.getmaskarray(values)
    first = ", ".join(map(str, np.unravel_index(int(np.argmax(masked)), masked.shape)))
    msg = (
        f"{name}: {np.count_nonzero(masked)} of {masked.size} values are masked, the first at [{first}]; "
        "give them a value that is outside, as array.filled(value) does"
    )
    raise ShapeError(msg)


def refuse_non_finite(values: NDArray[Any], name: str) -> None:
    """Raise ShapeError with the count and the first place of NaN or infinite values, if there are any."""
    if not np.issubdtype(values.dtype, np.floating):
        return
    # a sum is finite unless a term is not, or it overflows: one pass for the usual case
    with np.errstate(over="ignore", invalid="ignore"):
        total = values.sum(dtype=np.float64)
    if np.isfinite(total):
        return
    bad = ~np.isfinite(values)
    count = int(bad.sum())
    if count:
        first = ", ".join(map(str, np.unravel_index(int(np.argmax(bad)), bad.shape)))
        msg = (
            f"{name}: {count} of {bad.size} values are NaN or infinite, the first at [{first}]; replace them"
        )
        raise ShapeError(msg)


def border_repairs(inside: NDArray[np.bool_]) -> tuple[str, ...]:
    """Return the phrase of the report about padding, if inside voxels lie on the border of their array."""
    axes = [a for a in range(inside.ndim) if inside.size and inside.take([0, -1], axis=a).any()]
    if not axes:
        return ()
    where = ", ".join(map(str, axes))
    return (f"touched the border of the array on axis {where}: padded",)


def boundary_edges(
    inside: NDArray[np.bool_],
) -> Iterator[tuple[int, NDArray[np.int64], NDArray[np.int64]]]:
    """Yield, for each direction, the flat indices of the ends of the edges from inside to outside voxels."""
    for axis in range(inside.ndim):
        step = int(np.prod(inside.shape[axis + 1 :]))
        low = (slice(None),) * axis + (slice(None, -1),)
        high = (slice(None),) * axis + (slice(1, None),)
        changes = inside[low] != inside[high]
        # flat index in the array that is one shorter along the axis, to that in the whole array
        flat = np.flatnonzero(changes)
        flat += flat // (step * (inside.shape[axis] - 1) or 1) * step
        first = inside.ravel()[flat]
        yield 2 * axis, flat[~first] + step, flat[~first]
        yield 2 * axis + 1, flat[first], flat[first] + step


def _linear_cuts(values: NDArray[np.floating], inside: NDArray[np.bool_]) -> Cuts:
    """Cut every edge from inside to outside where the values, linear along it, are zero."""
    flat = values.ravel()
    parts = []
    for direction, start, end in boundary_edges(inside):
        a, b = flat[start].astype(np.float64), flat[end].astype(np.float64)
        # a - b may overflow where the values are huge, but not where they are scaled
        scale = np.maximum(a, -b)
        a, b = a / scale, b / scale
        # a tiny a against a large b underflows to zero, which is no fraction
        fraction = np.maximum(a / (a - b), np.finfo(np.float64).tiny)
        parts.append((start, np.full(start.size, direction, np.uint8), fraction))
    voxel, directions, fraction = (np.concatenate(column) for column in zip(*parts, strict=True))
    return Cuts(voxel, directions, fraction)
