"""Shapes scaled on the paper's grid of pixels, and their maps compared at the same places (Fig. 9)."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import map_coordinates

from spem.embedding.maps import Maps
from spem.plots.extension import extend_values
from spem.plots.level import surface_level
from spem.shapes.rescale import to_spacing
from spem.shapes.shape import Shape


def scaled(shape: Shape, factor: float) -> Shape:
    """Return a shape of pixels of length one scaled up or down: as many more pixels, of length one again.

    A point x of the shape is at ``factor * x`` of the scaled one.

    Examples
    --------
    >>> shape = Shape.from_mask(np.ones((20, 20)))
    >>> scaled(shape, 2.0)
    Shape('shape', 2-D, 1596 nodes, grid 42 x 42, spacing 1 x 1)
    """
    finer = to_spacing(shape, 1.0 / factor)
    return replace(finer, spacing=(1.0,) * shape.ndim, origin=tuple(factor * x for x in finer.origin))


def values_at(maps: Maps, points: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return maps at points of their shape, interpolated linearly between nodes and the boundary.

    Parameters
    ----------
    maps
        Maps that are not centred: on the boundary v = 1 for every ρ.
    points
        ``(n_points, d)`` in the shape's coordinates.

    Returns
    -------
    values
        ``(n_points, n_maps)``.

    Examples
    --------
    >>> import spem
    >>> disk = spem.synthetic.disk(radius=10.0, spacing=1.0)
    >>> maps = spem.maps(disk, 2)
    >>> bool(np.allclose(values_at(maps, disk.points), maps.values, atol=1e-6))
    True
    """
    shape, level = maps.shape, surface_level(maps.shape)
    index = ((points - np.asarray(shape.origin)) / np.asarray(shape.spacing)).T
    columns = []
    for values, surface in zip(maps.values.T, maps.basis.sum(axis=0), strict=True):
        grid = extend_values(shape, values, level, boundary=float(surface))
        columns.append(map_coordinates(grid, index, order=1, mode="nearest"))
    return np.stack(columns, axis=1)


def signal_to_noise(
    original: NDArray[np.floating[Any]], other: NDArray[np.floating[Any]]
) -> NDArray[np.float64]:
    """Return the peak signal-to-noise ratio of each column against the original, in decibels.

    The peak is the range of the column in the original: 20 dB are a root mean square difference of a tenth
    of it.

    Examples
    --------
    >>> ramp = np.linspace(0, 1, 11)[:, None]
    >>> print(signal_to_noise(ramp, ramp + 0.1).round(6))
    [20.]
    """
    noise = np.square(other - original).mean(axis=0)
    return np.asarray(10 * np.log10(np.square(np.ptp(original, axis=0)) / noise))
