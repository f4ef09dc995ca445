"""How smooth the level curves of a field are: total curvature, bending energy and sharpest turn (2.1)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from spem.fields.isocontours import iso_contours
from spem.fields.level_curves import turning_angles
from spem.shapes.shape import Shape

# Shorter curves, in chords, are too few points to speak of their curvature.
_MIN_CHORDS = 8


@dataclass(frozen=True, eq=False)
class Smoothness:
    """Measures of the longest curve of each level; NaN where curves run into the boundary, or all are short.

    Parameters
    ----------
    turns
        ``(n_levels,)`` total curvature ∫|κ| ds over 2π: 1 where the curve is convex.
    energy
        ``(n_levels,)`` bending energy times length, L ∫κ² ds over 4π²: 1 for a circle.
    sharpest
        ``(n_levels,)`` largest angle between successive chords, in radians.
    """

    turns: NDArray[np.float64]
    energy: NDArray[np.float64]
    sharpest: NDArray[np.float64]


def smoothness(
    shape: Shape, values: NDArray[np.float64], levels: Sequence[float] | NDArray[np.float64], step: float
) -> Smoothness:
    """Measure the level curves of a field by chords of one length.

    Examples
    --------
    >>> import spem
    >>> disk = spem.synthetic.disk(1.0, 0.02)
    >>> found = smoothness(disk, (disk.points**2).sum(axis=1), [0.5], 0.1)
    >>> found.turns.round(1), found.energy.round(1)
    (array([1.]), array([1.]))
    """
    rows = []
    for lines in iso_contours(shape, values, levels):
        long = [line for line in lines if _length(line) >= _MIN_CHORDS * step]
        if not long or any(not np.array_equal(line[0], line[-1]) for line in long):
            rows.append((np.nan, np.nan, np.nan))
            continue
        line = max(long, key=_length)
        angle = np.abs(turning_angles(line, step))
        energy = np.square(angle).sum() * _length(line) / step
        rows.append((angle.sum() / (2 * np.pi), energy / (4 * np.pi**2), angle.max()))
    turns, energies, sharpest = np.asarray(rows, np.float64).reshape(-1, 3).T
    return Smoothness(turns, energies, sharpest)


def at_areas(
    shape: Shape, fields: Sequence[NDArray[np.float64]], areas: NDArray[np.float64], step: float
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Compare the curves of several fields that hold the same shares of the nodes, where values are smaller.

    Returns
    -------
    turns
        ``(n_fields, n_areas)`` of `Smoothness`.
    corners
        ``(n_fields, n_areas)`` sharpest turn over that between chords of twice the length: near a half where
        a curve is smooth, near 1 where it has a corner.

    Examples
    --------
    >>> import spem
    >>> square = spem.synthetic.box((1.0, 1.0), 0.02)
    >>> _, corners = at_areas(square, [np.abs(square.points).max(axis=1)], np.array([0.5]), 0.1)
    >>> bool(corners[0, 0] > 0.75)
    True
    """
    turns, corners = [], []
    for values in fields:
        levels = np.quantile(values, areas)
        fine, coarse = (smoothness(shape, values, levels, chord) for chord in (step, 2 * step))
        turns.append(fine.turns)
        corners.append(fine.sharpest / coarse.sharpest)
    return np.stack(turns), np.stack(corners)


def _length(line: NDArray[np.float64]) -> float:
    """Length of a polyline."""
    return float(np.linalg.norm(np.diff(line, axis=0), axis=1).sum())
