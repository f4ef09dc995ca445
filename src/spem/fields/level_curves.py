"""Level curves and surfaces of a field: their curvature at the nodes, how a traced curve turns (2.1)."""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import ArrayLike, NDArray

from spem.errors import ParameterError, require_kind
from spem.fields.gradients import gradient
from spem.fields.operator import System, assemble
from spem.shapes.shape import Shape


def level_curvature(
    place: Shape | System, values: ArrayLike, *, boundary: ArrayLike | None = None
) -> NDArray[np.float64]:
    """Return div(∇v/|∇v|), the curvature of the level curve of v through each node (2.1).

    Positive where the curve bends away from larger values: 1/r on the circles of a field that grows outward.
    In more dimensions the sum of the principal curvatures of the level surface. Any growing function of v
    has the same level curves; of a screened field take log v, whose profile is nearly straight. Second
    order away from the boundary, first beside it.

    Parameters
    ----------
    place
        The shape whose nodes carry the field, or a system made of it.
    values
        ``(n_nodes,)`` the field.
    boundary
        Its value on the boundary, 1 for v and 0 for log v: one number, or one a boundary edge. None where it
        is not known.

    Returns
    -------
    curvature
        ``(n_nodes,)``, in 1 over the unit of the spacing; NaN where the gradient vanishes, and where an axis
        has fewer than two known ends.

    Raises
    ------
    ParameterError
        If there is not one finite value for each node, or not one for each boundary edge.

    Examples
    --------
    >>> from spem.shapes.shape import Shape
    >>> square = Shape.from_mask(np.ones((5, 5)))
    >>> curvature = level_curvature(square, np.sum(square.points**2, axis=1))
    >>> bool(np.isclose(curvature[18], 1 / np.hypot(3, 3)))
    True
    """
    if isinstance(place, System):
        system = place
    else:
        require_kind(place, Shape, "read it first: spem.read(...)")
        system = assemble(place)
    slope = gradient(system, values, boundary=boundary)
    nodal = np.ascontiguousarray(values, np.float64)
    ends = np.broadcast_to(
        np.asarray(np.nan if boundary is None else boundary, np.float64), system.domain.fraction.shape
    )
    pure = _second_differences(
        nodal,
        np.ascontiguousarray(ends),
        system.domain.neighbours,
        system.domain.fraction,
        np.asarray(system.shape.spacing, np.float64),
    )
    mixed = np.stack([gradient(system, component) for component in slope.T], axis=1)  # (n_nodes, d, d)
    mixed = (mixed + mixed.transpose(0, 2, 1)) / 2
    axis = np.arange(system.shape.ndim)
    mixed[:, axis, axis] = pure
    length = np.linalg.norm(slope, axis=1)
    with np.errstate(divide="ignore", invalid="ignore"):
        normal = slope / length[:, None]
        along = np.einsum("na,nab,nb->n", normal, mixed, normal)
        curvature = (pure.sum(axis=1) - along) / length
    return np.asarray(np.where(length > 0, curvature, np.nan))


def turning_angles(line: ArrayLike, step: float) -> NDArray[np.float64]:
    """Return the angles by which a closed curve turns between successive chords.

    Their absolute values sum to the total curvature, 2π for a convex curve and more for others. A step of
    several voxels keeps out what linear interpolation does to traced curves.

    Parameters
    ----------
    line
        ``(n_points, 2)`` corners of a closed polyline, the first one repeated, as `iso_contours` has them.
    step
        Length of the chords along the curve, in the unit of the points; as near to it as divides the curve.

    Returns
    -------
    angles
        ``(n_chords,)`` in radians, between −π and π.

    Raises
    ------
    ParameterError
        If the curve is not closed, not two-dimensional, or shorter than three steps.

    Examples
    --------
    >>> square = [[0, 0], [0, 2], [2, 2], [2, 0], [0, 0]]
    >>> np.abs(turning_angles(square, 1.0)).round(2)
    array([1.57, 0.  , 1.57, 0.  , 1.57, 0.  , 1.57, 0.  ])
    """
    points = np.asarray(line, np.float64)
    if points.ndim != 2 or points.shape[1] != 2 or len(points) < 2 or not np.allclose(points[0], points[-1]):
        msg = f"line: expected (n_points, 2) points whose last is the first, got {points.shape}; close it"
        raise ParameterError(msg)
    arc = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])
    if not 0 < 3 * step <= arc[-1] * (1 + 1e-9):
        msg = f"step={step!r}: a curve of length {arc[-1]:.4g} needs a positive step of at most a third of it"
        raise ParameterError(msg)
    place = np.arange(round(arc[-1] / step)) * (arc[-1] / round(arc[-1] / step))
    even = np.stack([np.interp(place, arc, coordinate) for coordinate in points.T], axis=1)
    chord = np.roll(even, -1, axis=0) - even
    heading = np.arctan2(chord[:, 1], chord[:, 0])
    turn = heading - np.roll(heading, 1)
    return np.asarray(np.mod(turn + np.pi, 2 * np.pi) - np.pi)


@njit(cache=True, nogil=True)
def _second_differences(
    values: NDArray[np.float64],
    boundary: NDArray[np.float64],
    neighbours: NDArray[np.int32],
    fraction: NDArray[np.float64],
    spacing: NDArray[np.float64],
) -> NDArray[np.float64]:
    """Second derivative along each axis, of the parabola through a node and the two ends of its edges."""
    n, d = neighbours.shape[0], spacing.size
    result = np.empty((n, d))
    edge = 0
    for i in range(n):
        for a in range(d):
            slope, length = np.zeros(2), np.ones(2)
            for side in range(2):
                j = neighbours[i, 2 * a + side]
                far = values[j] if j < n else boundary[edge]
                if j == n:
                    length[side] = fraction[edge]
                    edge += 1
                slope[side] = (far - values[i]) / length[side]
            result[i, a] = 2.0 * slope.sum() / (length.sum() * spacing[a] ** 2)
    return result
