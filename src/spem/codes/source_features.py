"""Node features of kind "sources": what each piece of a contour sees of the others through the hyperfield."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from spem.codes.bands import Bands
from spem.codes.settings import Settings
from spem.embedding.boundary_contexts import boundary_contexts, context_basis, mirror_signs
from spem.embedding.boundary_response import boundary_response
from spem.errors import ShapeError
from spem.fields.boundary.patches import divide_points
from spem.fields.boundary.sources import Sources, point_sources
from spem.fields.operator import assemble
from spem.shapes.shape import Shape

N_PATCHES = 100
# In units of the shape's size: as short as grids of a thousand pixels resolve. Ways are then nearly shortest
# ones, and longer screening finds fewer shapes.
RHO = 0.03


def source_features(
    shape: Shape,
    settings: Settings,
    threads: int | None = None,
    *,
    n_patches: int = N_PATCHES,
    rho: float = RHO,
    mirrored: bool = True,
) -> Bands:
    """Compute the boundary contexts of the arcs of the longest contour, each in few numbers.

    Holes take part as boundary that is held at zero. The roots of the shares are taken, so that rare bins
    count (the Hellinger distance), and projected on the smoothest functions of the bins.

    Parameters
    ----------
    shape
        A shape of two dimensions.
    settings
        Boundary model, and number of values.
    threads
        Without effect: one shape takes milliseconds.
    n_patches
        Number of arcs that the contours are cut into, fewer where there are fewer boundary points; beside one
        for each contour where there are more contours than that.
    rho
        Screening length, in units of the shape's size.
    mirrored
        Whether each arc counts a second time as its mirror image, so that a shape and its reflection have
        the same code; or else they differ.

    Returns
    -------
    tuple
        One band, ``(n_arcs, n_maps)`` in float32, or twice as many rows with mirror images.

    Raises
    ------
    ShapeError
        When the shape is not of two dimensions.
    ParameterError
        When more values are asked for than there are bins.

    Examples
    --------
    >>> from spem.shapes.synthetic import disk
    >>> source_features(disk(radius=20.0, spacing=1.0), Settings(features="spem", n_maps=44))[0].shape
    (200, 44)
    """
    outer = contour_arcs(shape, settings, n_patches)
    shares = boundary_contexts(boundary_response(outer, rho * shape.size))
    basis, signs = _basis(settings.n_maps)
    values = np.sqrt(shares) @ basis
    return ((np.vstack([values, values * signs]) if mirrored else values).astype(np.float32),)


def contour_arcs(shape: Shape, settings: Settings, n_patches: int = N_PATCHES) -> Sources:
    """Cut the contours of a silhouette into arcs, and return those of the longest.

    Parameters
    ----------
    shape
        A shape of two dimensions.
    settings
        Boundary model.
    n_patches
        As for `source_features`.

    Raises
    ------
    ShapeError
        When the shape is not of two dimensions.

    Examples
    --------
    >>> from spem.shapes.synthetic import annulus
    >>> contour_arcs(annulus(0.5, 1.0, 0.05), Settings(features="sources")).n_sources
    66
    """
    if shape.ndim != 2:
        msg = f"{shape.name}: features 'sources' are of silhouettes; this shape has {shape.ndim} dimensions"
        raise ShapeError(msg)
    points = point_sources(assemble(shape, settings.boundary))
    n_contours = points.points.n_contours
    # each contour takes an arc: where holes took half of them little would be left to divide the longest
    count = min(n_patches if 2 * n_contours <= n_patches else n_contours + n_patches, points.n_sources)
    arcs = divide_points(points, count)
    return arcs.select(np.flatnonzero(arcs.contour == 0))


@lru_cache(maxsize=4)
def _basis(count: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the basis and its signs under reflection, made once for all shapes of a collection."""
    return context_basis(count), mirror_signs(count)
