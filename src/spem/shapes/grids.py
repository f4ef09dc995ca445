"""What may be asked of a grid: a spacing, a number of voxels, an inner distance."""

from __future__ import annotations

import math
from numbers import Real
from typing import Any

import numpy as np

from spem.errors import ParameterError

# So that the volume of a voxel and the inverse of its square are numbers, in up to six dimensions.
_LEAST, _LARGEST = 1e-50, 1e50


def spacing_per_axis(spacing: Any, ndim: int, name: str) -> tuple[float, ...]:
    """Return one checked spacing per axis.

    Parameters
    ----------
    spacing
        One number for all axes, or one per axis.
    ndim
        Number of axes.
    name
        What the spacing is of, for the message.

    Raises
    ------
    ParameterError
        When it is not one positive finite number, or `ndim` of them.

    Examples
    --------
    >>> spacing_per_axis(0.5, 2, "hand")
    (0.5, 0.5)
    """
    try:
        steps = np.asarray(spacing, np.float64)
    except (TypeError, ValueError):
        steps = np.full(1, np.nan)
    if steps.shape not in ((), (ndim,)) or not (np.isfinite(steps) & (steps > 0)).all():
        msg = f"{name}: spacing={spacing}: expected one positive number, or {ndim} of them, one per axis"
        raise ParameterError(msg)
    return tuple(np.broadcast_to(steps, (ndim,)).tolist())


def declared_spacing(spacing: Any, ndim: int, name: str) -> tuple[float, ...]:
    """Return one checked spacing per axis, of a grid that is there already.

    Parameters
    ----------
    spacing, ndim, name
        As `spacing_per_axis`.

    Raises
    ------
    ParameterError
        As `spacing_per_axis`, and when a volume or a field on such a grid is no number.

    Examples
    --------
    >>> declared_spacing(0.5, 2, "hand")
    (0.5, 0.5)
    """
    steps = spacing_per_axis(spacing, ndim, name)
    if min(steps) < _LEAST or max(steps) > _LARGEST:
        msg = f"{name}: spacing={spacing}: expected numbers of {_LEAST:g} to {_LARGEST:g}; take another unit"
        raise ParameterError(msg)
    return steps


def voxel_count(voxels: Any, name: str) -> int:
    """Return a checked number of voxels.

    Parameters
    ----------
    voxels
        Voxels wanted inside a shape.
    name
        What they are of, for the message.

    Raises
    ------
    ParameterError
        When it is not a whole number of at least 1.

    Examples
    --------
    >>> voxel_count(1e4, "hand")
    10000
    """
    count = _number(voxels)
    if not 1 <= count < math.inf or not count.is_integer():
        msg = f"{name}: voxels={voxels!r}: expected a whole number of at least 1"
        raise ParameterError(msg)
    return int(count)


def inner_distance(distance: Any, name: str) -> float:
    """Return a checked distance from the deepest node to the surface, in voxels.

    Parameters
    ----------
    distance
        The distance wanted.
    name
        What it is of, for the message.

    Raises
    ------
    ParameterError
        When it is not a finite number of at least 1: below that, nodes see no more of a shape.

    Examples
    --------
    >>> inner_distance(20, "hand")
    20.0
    """
    found = _number(distance)
    if not 1 <= found < math.inf:
        msg = f"{name}: inner_radius={distance!r}: expected a number of at least 1, in voxels"
        raise ParameterError(msg)
    return found


def _number(value: Any) -> float:
    """Return a number as such, and NaN for anything else."""
    return math.nan if isinstance(value, bool) or not isinstance(value, Real) else float(value)
