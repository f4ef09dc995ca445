"""Nodes of a silhouette by their depth, and the spread of a field among equally deep ones (Fig. 2, 3)."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import RegularGridInterpolator
from scipy.ndimage import distance_transform_edt

from spem.fields.boundary_distance import distance_to_boundary
from spem.fields.isocontours import iso_contours
from spem.paper.limbs import fingers
from spem.shapes.shape import Shape

# Half the width of a band of depth, in pixels; and of the wider one that the fall of v is taken from.
BAND, FALL = 0.25, 1.0

# How near a depth that is looked for, in pixels; the middle of a finger, as a share of its length.
NEAR, MIDDLE = 0.1, 0.15

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
    for kind, depth in (("sub-voxel", distance_to_boundary(shape)), ("pixel", transform)):
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
    lines = np.vstack(iso_contours(shape, distance_to_boundary(shape), [at])[0])
    values = RegularGridInterpolator(shape.axes, shape.to_grid(fields, 1.0))(lines)
    return np.asarray(values.std(axis=0))


def distinct_nodes(hand: Shape) -> NDArray[np.int64]:
    """Choose five nodes of a hand of distinct character (Fig. 2).

    The deepest one; two of the palm at two thirds and one third of its depth; the deepest one in the middle
    of the longest finger; and one of the palm that is as deep. Those of the palm are as far from fingers and
    from the nodes before them as their depth allows.

    Parameters
    ----------
    hand
        A silhouette with five fingers.

    Raises
    ------
    ParameterError
        If it has fewer.
    """
    found, depth, points = fingers(hand), distance_to_boundary(hand), hand.points
    lengths = [found.length(finger) for finger in range(len(found.inside))]
    longest = int(np.argmax(lengths))
    away = np.linalg.norm(points - points[found.tip(longest)], axis=1) / lengths[longest]
    middle = found.inside[longest] & (np.abs(away - 0.5) < MIDDLE)
    chosen = {0: int(np.where(found.core, depth, 0).argmax()), 3: int(np.where(middle, depth, 0).argmax())}
    limbs = points[~found.core]
    for place, wanted in ((4, depth[chosen[3]]), (1, depth.max() * 2 / 3), (2, depth.max() / 3)):
        level = np.flatnonzero(found.core & (np.abs(depth - wanted) < NEAR))
        others = np.vstack([limbs, points[list(chosen.values())]])
        clear = np.linalg.norm(points[level][:, None] - others, axis=2).min(axis=1)
        chosen[place] = int(level[clear.argmax()])
    return np.array([chosen[place] for place in range(5)])
