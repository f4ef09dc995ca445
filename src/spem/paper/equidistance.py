"""The spread of a field among nodes that are equally far from the boundary (Fig. 3)."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import RegularGridInterpolator
from scipy.ndimage import distance_transform_edt

from spem.fields.isocontours import iso_contours
from spem.paper.limbs import node_depth
from spem.shapes.shape import Shape

# Half the width of a band of depth, in pixels; and of the wider one that the fall of v is taken from.
BAND, FALL = 0.25, 1.0

Array = NDArray[np.floating[Any]]


def band(depth: Array, at: float) -> NDArray[np.bool_]:
    """Return which nodes are of one depth, within the band.

    Examples
    --------
    >>> band(np.array([1.0, 1.2, 1.4]), 1.0).tolist()
    [True, True, False]
    """
    return np.asarray(np.abs(depth - at) <= BAND)


def spread_ratios(shape: Shape, fields: Array, at: float) -> dict[str, Array]:
    """Return for each field how much more it spreads in a band of depth than the depths in it explain.

    What they explain is the standard deviation of the depth times the mean fall of the field per pixel.

    Parameters
    ----------
    shape
        A silhouette with voxels of length one.
    fields
        ``(n_nodes, n_rho)`` fields.
    at
        The depth.

    Returns
    -------
    dict
        ``(n_rho,)`` ratios, by depths below the surface, ``"sub-voxel"``, and by those of the distance
        transform of the mask, ``"pixel"``.
    """
    found = {}
    transform = distance_transform_edt(shape.mask)[shape.mask]
    for kind, depth in (("sub-voxel", node_depth(shape)), ("pixel", transform)):
        near = np.abs(depth - at) <= FALL
        fall = np.polyfit(depth[near], fields[near], 1)[0]
        mine = band(depth, at)
        # Distances of pixels repeat, but are no better known for it: at least as if evenly spread.
        width = max(float(depth[mine].std()), BAND / np.sqrt(3))
        found[kind] = fields[mine].std(axis=0) / np.abs(fall * width)
    return found


def spread_along_curve(shape: Shape, fields: Array, at: float) -> Array:
    """Return for each field its standard deviation along the curve of exactly one depth.

    Parameters
    ----------
    shape, fields, at
        As for `spread_ratios`.
    """
    lines = np.vstack(iso_contours(shape, node_depth(shape), [at])[0])
    values = RegularGridInterpolator(shape.axes, shape.to_grid(fields, 1.0))(lines)
    return np.asarray(values.std(axis=0))
