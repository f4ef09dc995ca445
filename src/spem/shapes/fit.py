"""The spacing at which a shape has as many voxels as asked, or as many from its middle to its surface."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from spem.errors import ShapeError, SizeError
from spem.shapes.shape import Shape

_ROUNDS = 8
# What is measured jumps from grid to grid: a step is bounded, and shorter after each overshoot.
_LONGEST = 2.0
_SHORTER = 0.6


def fit_spacing(
    make: Callable[[float], Shape],
    step: float,
    measure: Callable[[Shape], float],
    wanted: float,
    *,
    power: int,
    tolerance: float,
    what: str,
) -> Shape:
    """Search for the spacing at which a shape measures what is wanted, and return the nearest found.

    Parameters
    ----------
    make
        Makes the shape at a spacing.
    step
        The first spacing tried.
    measure
        A positive number that goes about as the spacing to minus `power`.
    wanted
        What it shall be.
    power
        1 for lengths in voxels, d for numbers of voxels.
    tolerance
        Relative error that ends the search; a larger one is told in the report.
    what
        What is measured, for the report.

    Raises
    ------
    ShapeError, SizeError
        When the first shape cannot be made.

    Examples
    --------
    >>> import numpy as np
    >>> def rod(step: float) -> Shape:
    ...     return Shape.from_mask(np.ones(int(10 / step)), step)
    >>> def count(shape: Shape) -> int:
    ...     return shape.n_nodes
    >>> fit_spacing(rod, 1.0, count, 25, power=1, tolerance=0.01, what="voxels").n_nodes
    25
    """
    best = make(step)
    found = nearest = measure(best) / wanted
    gain = 1.0 / power
    for _ in range(_ROUNDS):
        if abs(nearest - 1) <= tolerance:
            return best
        step *= min(max(found**gain, 1 / _LONGEST), _LONGEST)
        try:
            made = make(step)
        except (ShapeError, SizeError):
            break
        before, found = found, measure(made) / wanted
        if (found > 1) != (before > 1):
            gain *= _SHORTER
        if abs(found - 1) < abs(nearest - 1):
            best, nearest = made, found
    if abs(nearest - 1) <= tolerance:
        return best
    phrase = f"{nearest * wanted:.4g} {what} instead of {wanted:.4g}, the nearest that was found"
    return replace(best, report=best.report.with_repair(phrase))
