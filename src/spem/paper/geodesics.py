"""Fields of one source against shortest ways inside the shape: shapes, differences, directions (3.2)."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from spem.api.parts import source_fields
from spem.api.parts import sources as make_sources
from spem.fields.boundary.sources import Sources
from spem.fields.boundary_distance import distance_to_boundary
from spem.fields.geodesics import inner_distances, source_distances
from spem.fields.gradients import gradient, source_gradient, unit_vectors
from spem.shapes.implicit import implicit_shape
from spem.shapes.shape import Shape

# The U: a square of side 2 with a notch from the top, of this depth and half width.
_DEPTH, _HALF = 1.3, 0.3
_CORNERS = np.array([[_DEPTH, -_HALF], [_DEPTH, _HALF]])
# Where −ρ log v is set equal to the distance: nodes near the source, as shares of the longest way.
_NEAR = (0.02, 0.06)


@dataclass(frozen=True, eq=False)
class Way:
    """A shape, one boundary source, and the lengths of the shortest ways from it.

    Parameters
    ----------
    name
        Name of the case.
    sources
        The one source.
    distance
        ``(n_nodes,)``, in the unit of the spacing.
    """

    name: str
    sources: Sources
    distance: NDArray[np.float64]

    @property
    def shape(self) -> Shape:
        """The shape."""
        return self.sources.system.shape

    @property
    def longest(self) -> float:
        """Length of the longest shortest way."""
        return float(self.distance.max())

    @cached_property
    def depth(self) -> NDArray[np.float64]:
        """``(n_nodes,)`` distance to the boundary."""
        return distance_to_boundary(self.shape)

    @cached_property
    def directions(self) -> NDArray[np.float64]:
        """``(n_nodes, d)`` unit vectors along the shortest ways, away from the source."""
        return unit_vectors(gradient(self.sources.system, self.distance))


def u_way(cells: int) -> tuple[Way, NDArray[np.float64]]:
    """Return a U with the exact lengths of ways from the end of one arm, and those by fast marching.

    Parameters
    ----------
    cells
        Voxels to the unit; the square has side 2.

    Examples
    --------
    >>> way, marched = u_way(20)
    >>> bool(np.abs(marched - way.distance).mean() < 0.5 / 20)
    True
    """
    shape = implicit_shape(_inside_u, (0.0, -1.0), (2.0, 1.0), 1 / cells, name="U", offset=0.5)
    source = _source_at(shape, np.array([0.0, -0.65]))
    return Way("U", source, _u_distance(source.position[0], shape.points)), source_distances(source)[0]


def tip_way(shape: Shape, name: str) -> Way:
    """Return a shape with the ways from the tip that is farthest from its deepest node, by fast marching."""
    deepest = int(distance_to_boundary(shape).argmax())
    tip = int(inner_distances(shape, [deepest])[0].argmax())
    source = _source_at(shape, shape.points[tip])
    return Way(name, source, source_distances(source)[0])


def difference(way: Way, rho: float) -> NDArray[np.float64]:
    """Return −ρ log v less the distance, over the longest way; zero near the source.

    The value near the source depends on the voxel that the source is, and is taken off.

    Parameters
    ----------
    way
        A shape, a source, and its distances.
    rho
        A finite ρ.
    """
    error = (-rho * source_fields(way.sources, rho).log[0] - way.distance) / way.longest
    share = way.distance / way.longest
    near = (share > _NEAR[0]) & (share < _NEAR[1])
    return np.asarray(error - np.median(error[near]))


def angles(way: Way, rho: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the angles between −∇ log v and the shortest ways, and how far ∇ log v points inward.

    Returns
    -------
    angle
        ``(n_nodes,)`` in degrees.
    inward
        ``(n_nodes,)`` cosine of the angle between ∇v and the direction away from the nearest boundary.
    """
    up = unit_vectors(source_gradient(source_fields(way.sources, rho), 0))
    cosine = -np.einsum("nd,nd->n", up, way.directions)
    from_walls = unit_vectors(gradient(way.sources.system, way.depth, boundary=0.0))
    return np.degrees(np.arccos(np.clip(cosine, -1, 1))), np.einsum("nd,nd->n", up, from_walls)


def _source_at(shape: Shape, point: NDArray[np.float64]) -> Sources:
    """Return the point source nearest to a place, alone."""
    everywhere = make_sources(shape)
    number, _ = everywhere.nearest(point)
    return everywhere.select(number)


def _inside_u(x: NDArray[np.float64]) -> NDArray[np.float64]:
    """Level function of the U, positive inside."""
    square = np.minimum(np.minimum(x[:, 0], 2 - x[:, 0]), 1 - np.abs(x[:, 1]))
    return np.asarray(np.minimum(square, np.maximum(x[:, 0] - _DEPTH, np.abs(x[:, 1]) - _HALF)))


def _u_distance(start: NDArray[np.float64], points: NDArray[np.float64]) -> NDArray[np.float64]:
    """Lengths of the shortest ways in the U: straight, or round one or both corners of the notch."""
    length = _straight(start, points)
    for first, second in (_CORNERS, _CORNERS[::-1]):
        to_first = _straight(start, first[None])[0]
        length = np.minimum(length, to_first + _straight(first, points))
        length = np.minimum(length, to_first + 2 * _HALF + _straight(second, points))
    return length


def _straight(start: NDArray[np.float64], ends: ArrayLike) -> NDArray[np.float64]:
    """Lengths of straight lines; infinite for those that cross the notch."""
    way = np.asarray(ends, np.float64) - start
    enter, leave = np.zeros(len(way)), np.ones(len(way))
    # each side of the notch is a half plane: value + t * rise < bound, less a grain for its corners
    for axis, sign, bound in ((0, 1, _DEPTH), (1, 1, _HALF), (1, -1, _HALF)):
        value, rise, limit = sign * start[axis], sign * way[:, axis], bound - 1e-9
        with np.errstate(divide="ignore", invalid="ignore"):
            crossing = (limit - value) / rise
        leave = np.where(rise > 0, np.minimum(leave, crossing), leave)
        enter = np.where(rise < 0, np.maximum(enter, crossing), enter)
        leave = np.where((rise == 0) & (value >= limit), -1.0, leave)
    return np.where(enter < leave - 1e-12, np.inf, np.linalg.norm(way, axis=1))
