"""Fill a surface with holes by its generalised winding number (Jacobson, Kavan, Sorkine-Hornung 2013)."""

from __future__ import annotations

import igl
import numpy as np
from numpy.typing import NDArray

from spem.shapes.crossings import cross_lines
from spem.shapes.surface import Surface
from spem.shapes.voxelize import Filling, Lattice, cut_edges, winding_range

# Up to this part of open edges, a node for which all six lines agree has their winding number;
# beyond it lines may agree by chance, and the number is computed everywhere.
NEARLY_CLOSED = 0.01


def fill_by_winding(surface: Surface, lattice: Lattice) -> Filling:
    """Fill a surface with holes: inside where its generalised winding number is above one half.

    Parameters
    ----------
    surface
        Any triangles, oriented as consistently as can be.
    lattice
        The grid, with at least one layer outside the surface.

    Returns
    -------
    Filling
        Cuts lie where the surface crosses an edge; where an edge leaves the shape through a hole,
        where the winding number, interpolated along the edge, is one half.

    Examples
    --------
    >>> corners = np.array([[0.0, 0, 0], [3, 0, 0], [0, 3, 0], [0, 0, 3]])
    >>> tetrahedron = np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])
    >>> from spem.shapes.voxelize import lattice_around
    >>> lattice = lattice_around(corners, (0.25, 0.25, 0.25))
    >>> closed = fill_by_winding(Surface(corners, tetrahedron), lattice)
    >>> lidless = fill_by_winding(Surface(corners, tetrahedron[:3]), lattice)
    >>> int(closed.mask.sum()), int(lidless.mask.sum())
    (286, 286)
    """
    points = lattice.grid_units(surface.vertices)
    crossings = [cross_lines(points, surface.faces, lattice.shape, axis) for axis in range(3)]
    low, high = winding_range(crossings)
    nearly_closed = len(surface.open_edges) <= NEARLY_CLOSED * 1.5 * len(surface.faces)
    unsettled = np.flatnonzero(low != high) if nearly_closed else np.arange(low.size)
    winding = low.astype(np.float64)
    if unsettled.size:
        queries = lattice.positions(unsettled)
        winding.reshape(-1)[unsettled] = igl.fast_winding_number(surface.vertices, surface.faces, queries)
    _clear_outermost(winding)
    mask = winding > 0.5
    return Filling(mask, cut_edges(mask, crossings, winding), int(np.count_nonzero(winding < -0.5)))


def _clear_outermost(winding: NDArray[np.float64]) -> None:
    """Put the outermost layer outside, whatever sheets that lie over each other add up to there."""
    for axis in range(3):
        for side in (0, -1):
            layer = np.moveaxis(winding, axis, 0)[side]
            np.minimum(layer, 0, out=layer)
