"""The signed distance from the nodes of a grid to the surface of its shape, finer than a voxel."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage
from scipy.spatial import cKDTree

from spem.shapes.levels import boundary_edges
from spem.shapes.shape import FACE_FRACTION, MIN_FRACTION, Shape

_TINY = 1e-12
# Within this many voxels of the surface the nearest foot is searched for: interpolation reads those.
_BAND = 2.5
# Least cosine, between a foot's normal and the way to it, for which its plane is taken.
_FACING = 0.5


def signed_distance(shape: Shape) -> NDArray[np.float64]:
    """Return the distance from each voxel centre to the surface, positive inside.

    At voxels beside the surface, the distance is that to the plane through the cuts of their edges,
    with the normal of a first estimate; elsewhere, that to the nearest foot point of such planes,
    found by the exact Euclidean distance transform and, near the surface and at the deepest
    voxels, by search. Cuts between two inside voxels do not count: no outside lies between them.

    Parameters
    ----------
    shape
        The shape.

    Returns
    -------
    array
        ``mask.shape``, in the unit of the spacing.

    Examples
    --------
    >>> signed_distance(Shape.from_mask(np.ones(5)))
    array([-0.5,  0.5,  1.5,  2.5,  1.5,  0.5, -0.5])
    """
    reach = _axis_distances(shape)
    beside = np.flatnonzero(np.isfinite(reach).any(axis=0))
    place = np.stack(np.unravel_index(beside, shape.mask.shape)) * np.reshape(shape.spacing, (-1, 1))
    inverse = 1.0 / reach[:, beside]
    offset = inverse / np.sum(inverse**2, axis=0)
    nearest = _nearest(shape, beside)
    normal = _normals(shape, _to_feet(shape, place + offset, nearest), beside)
    # least squares of the plane's distance over the cuts, each of which lies on the plane
    known = np.isfinite(reach[:, beside])
    weight = np.where(known, normal**2, 0.0)
    total = weight.sum(axis=0)
    along = np.where(known, reach[:, beside], 0.0) * normal
    length = np.sum(weight * along, axis=0) / np.maximum(total, _TINY)
    agrees = (total > _TINY) & (length * np.sum(offset * normal, axis=0) > 0)
    feet = place + np.where(agrees, length * normal, offset)
    return _search(shape, feet, normal, _to_feet(shape, feet, nearest), beside)


def _nearest(shape: Shape, at: NDArray[np.int64]) -> NDArray[np.int64]:
    """Position in `at` of the nearest of its voxels, for every voxel of the grid."""
    free = np.ones(shape.mask.shape, bool)
    free.ravel()[at] = False
    index = ndimage.distance_transform_edt(
        free, sampling=shape.spacing, return_distances=False, return_indices=True
    )
    position = np.zeros(shape.mask.size, np.int32)
    position[at] = np.arange(at.size)
    return np.asarray(position[np.ravel_multi_index(tuple(index), shape.mask.shape)])


def _to_feet(shape: Shape, feet: NDArray[np.float64], nearest: NDArray[np.int64]) -> NDArray[np.float64]:
    """Signed distance from every voxel centre to the foot point given for it."""
    squared = np.zeros(shape.mask.shape)
    for axis, h in enumerate(shape.spacing):
        along = h * np.arange(shape.mask.shape[axis]).reshape(
            [-1 if a == axis else 1 for a in range(shape.ndim)]
        )
        squared += (feet[axis][nearest].reshape(shape.mask.shape) - along) ** 2
    distance = np.sqrt(squared)
    return np.where(shape.mask, distance, -distance)


def _normals(shape: Shape, distance: NDArray[np.float64], beside: NDArray[np.int64]) -> NDArray[np.float64]:
    """Return unit outward normals ``(d, n)`` at voxels by central differences of a distance."""
    index = np.stack(np.unravel_index(beside, shape.mask.shape))
    flat = distance.ravel()
    normal = np.empty(index.shape)
    for axis, h in enumerate(shape.spacing):
        step = int(np.prod(shape.mask.shape[axis + 1 :]))
        back = np.minimum(index[axis], 1)
        ahead = np.minimum(shape.mask.shape[axis] - 1 - index[axis], 1)
        normal[axis] = (flat[beside - back * step] - flat[beside + ahead * step]) / (h * (back + ahead))
    return np.asarray(normal / np.maximum(np.sqrt(np.sum(normal**2, axis=0)), _TINY))


def _search(
    shape: Shape,
    feet: NDArray[np.float64],
    normal: NDArray[np.float64],
    distance: NDArray[np.float64],
    beside: NDArray[np.int64],
) -> NDArray[np.float64]:
    """Make the distance that to the nearest foot of all, near the surface and at the deepest voxels."""
    rough = np.abs(distance).ravel()
    step = max(shape.spacing)
    wanted = (rough < _BAND * step) | (distance.ravel() > distance.max() - step)
    wanted[beside] = False
    at = np.flatnonzero(wanted)
    place = np.stack(np.unravel_index(at, shape.mask.shape), axis=1) * np.asarray(shape.spacing)
    found, foot = cKDTree(feet.T).query(place)
    # feet lie about a voxel apart: the plane there is nearer than the foot, unless at a sharp edge
    to_plane = np.abs(np.sum((place - feet.T[foot]) * normal.T[foot], axis=1))
    faces = (to_plane > _FACING * found) & (rough[at] < _BAND * step)
    found = np.where(faces, to_plane, found)
    result = distance.copy().ravel()
    result[at] = np.copysign(found, result[at])
    return result.reshape(shape.mask.shape)


def _axis_distances(shape: Shape) -> NDArray[np.float64]:
    """Signed distance ``(d, voxels)`` along each axis to the nearer cut beside a voxel; inf where none is."""
    fractions = {}
    for direction in range(2 * shape.ndim):
        hit = shape.cuts.direction == direction
        fractions[direction] = (shape.cuts.voxel[hit], shape.cuts.fraction[hit])
    reach = np.full((shape.ndim, shape.mask.size), np.inf)
    for direction, start, end in boundary_edges(shape.mask):
        along = reach[direction // 2]
        listed, values = fractions[direction]
        theta = np.full(start.size, FACE_FRACTION)
        place = np.searchsorted(listed, start)
        found = place < listed.size
        found[found] = listed[place[found]] == start[found]
        theta[found] = values[place[found]]
        h = shape.spacing[direction // 2]
        sign = 1.0 if direction % 2 else -1.0
        for node, part, toward in ((start, theta, sign), (end, 1.0 - theta, -sign)):
            length = h * np.maximum(part, MIN_FRACTION)
            closer = length < np.abs(along[node])
            along[node[closer]] = toward * length[closer]
    return reach
