"""A level function of a shape for drawing: positive inside, zero on the surface."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from scipy.ndimage import distance_transform_edt, gaussian_filter

from spem.shapes.shape import FACE_FRACTION, Shape

if TYPE_CHECKING:
    from numpy.typing import NDArray

# Beyond this many edges from the surface the level is constant: smoothing then sees one surface only.
REACH = 2.5
# Gaussian widths in voxels: stairs of a bare mask need more than surfaces whose cuts are known.
STAIR_WIDTH = 1.0
CUT_WIDTH = 0.5
# No node changes side by the smoothing, so that parts one voxel thick stay.
LEAST = 0.08


def surface_level(shape: Shape) -> NDArray[np.float64]:
    """Return a smooth function on the grid that is positive inside and negative outside a shape.

    Next to the surface it is the distance to the plane through the cuts around a node, elsewhere
    the distance to the nearest voxel of the other side, clipped; then it is smoothed, and every
    node is kept on its side. Cuts between two inside voxels are not seen.

    Parameters
    ----------
    shape
        A shape of any dimension.

    Returns
    -------
    level
        ``(n_0, ..., n_{d-1})`` level in units of the smallest spacing.

    Examples
    --------
    >>> shape = Shape.from_mask(np.ones((3, 3)))
    >>> bool(((surface_level(shape) > 0) == shape.mask).all())
    True
    """
    mask = shape.mask
    unit = np.asarray(shape.spacing) / min(shape.spacing)
    level = distance_transform_edt(mask, unit) - distance_transform_edt(~mask, unit)
    level = np.clip(level - np.where(mask, 0.5, -0.5), -REACH, REACH)
    near = _plane_distance(shape, unit)
    level = np.where(np.isfinite(near), np.where(mask, near, -near), level)
    level = gaussian_filter(level, CUT_WIDTH if len(shape.cuts) else STAIR_WIDTH, mode="nearest")
    kept: NDArray[np.float64] = np.where(mask, np.maximum(level, LEAST), np.minimum(level, -LEAST))
    return kept


def _plane_distance(shape: Shape, unit: NDArray[np.float64]) -> NDArray[np.float64]:
    """Distance of each node beside the surface to the plane through its cuts, inf elsewhere."""
    mask = shape.mask
    inverse = np.zeros(mask.shape)
    for axis in range(mask.ndim):
        ahead = [slice(None)] * mask.ndim
        behind = list(ahead)
        ahead[axis], behind[axis] = slice(1, None), slice(None, -1)
        nearest = np.full(mask.shape, np.inf)
        for side, (here, there) in enumerate([(tuple(ahead), tuple(behind)), (tuple(behind), tuple(ahead))]):
            fraction = _fractions(shape, 2 * axis + side)[here]
            crossed = mask[here] & ~mask[there]
            inner = np.where(crossed, fraction, np.inf)
            outer = np.where(crossed, np.maximum(1 - fraction, LEAST), np.inf)
            nearest[here] = np.minimum(nearest[here], inner)
            nearest[there] = np.minimum(nearest[there], outer)
        inverse += (nearest * unit[axis]) ** -2.0
    with np.errstate(divide="ignore"):
        distance: NDArray[np.float64] = inverse**-0.5
    return distance


def _fractions(shape: Shape, direction: int) -> NDArray[np.float64]:
    """Cut fraction of every voxel's edge in one direction; one half where nothing is known."""
    fraction = np.full(shape.mask.size, FACE_FRACTION)
    chosen = shape.cuts.direction == direction
    fraction[shape.cuts.voxel[chosen]] = np.maximum(shape.cuts.fraction[chosen], LEAST)
    return fraction.reshape(shape.mask.shape)
