"""The field for small ρ against exact distances to the boundary: shapes, errors and their rates (3.2)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from spem.api.fields import field
from spem.fields.boundary_distance import distance_to_boundary, screened_distance
from spem.fields.operator import Boundary
from spem.fields.solvers.direct import Direct
from spem.shapes.closed_forms import ball_field
from spem.shapes.shape import Shape
from spem.shapes.synthetic import box, disk

# Share of a disk's radius within which its expansion, in ρ/r, is not tried.
_CENTRE = 0.3


@dataclass(frozen=True, eq=False)
class Case:
    """A shape with the exact distance of its nodes to the boundary.

    Parameters
    ----------
    name
        Name of the case.
    shape
        The shape.
    distance
        ``(n_nodes,)``, in the unit of the spacing.
    boundary
        The boundary model that the distance belongs to.
    """

    name: str
    shape: Shape
    distance: NDArray[np.float64]
    boundary: Boundary = "surface"

    @property
    def radius(self) -> float:
        """Largest distance to the boundary."""
        return float(self.distance.max())


def known_cases(radius: float) -> list[Case]:
    """Return a disk and a rectangle of this inner radius in voxels, whose distances are known.

    Examples
    --------
    >>> [case.name for case in known_cases(5.0)]
    ['disk', 'rectangle']
    """
    round_one, flat = disk(radius, 1.0), box((2 * radius, 3 * radius), 1.0)
    to_sides = radius * np.array([1.0, 1.5]) - np.abs(flat.points)
    return [
        Case("disk", round_one, radius - np.linalg.norm(round_one.points, axis=1)),
        Case("rectangle", flat, to_sides.min(axis=1)),
    ]


def silhouette_cases(shape: Shape, name: str) -> list[Case]:
    """Return a silhouette with its outline as boundary, and with the centres of the pixels outside.

    The distance of the latter is that of the Euclidean distance transform.

    Examples
    --------
    >>> [case.boundary for case in silhouette_cases(Shape.from_mask(np.ones((4, 4))), "square")]
    ['surface', 'voxel']
    """
    to_pixels = ndimage.distance_transform_edt(shape.mask, shape.spacing).ravel()[shape.voxels]
    return [
        Case(name, shape, distance_to_boundary(shape)),
        Case(f"{name}, voxels", shape, to_pixels, "voxel"),
    ]


def errors(case: Case, shares: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return −ρ log v less the distance, over the inner radius.

    Parameters
    ----------
    case
        A shape and its distance.
    shares
        ``(n_rho,)`` ρ over the inner radius.

    Returns
    -------
    error
        ``(n_rho, n_nodes)``

    Examples
    --------
    On a rectangle −ρ log v falls short where several sides are near, by ρ log 2 and more:

    >>> error = errors(known_cases(20.0)[1], np.array([0.25]))
    >>> bool(abs(error.max()) < 0.002), bool(error.min() < -0.25 * np.log(2))
    (True, True)
    """
    found = []
    for rho in shares * case.radius:
        v = field(case.shape, rho, solver=Direct(), boundary=case.boundary)
        found.append(screened_distance(v, rho) - case.distance)
    return np.array(found) / case.radius


def rate(shares: NDArray[np.float64], error: NDArray[np.float64]) -> float:
    """Return the power of ρ with which errors ``(n_rho,)`` fall, by least squares in logarithms.

    Examples
    --------
    >>> rho = np.array([0.4, 0.2, 0.1])
    >>> round(rate(rho, 3 * rho**2), 6)
    2.0
    """
    return float(np.polyfit(np.log(shares), np.log(error), 1)[0])


def extrapolated(shares: NDArray[np.float64], error: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the errors ``(n_rho - 1, n_nodes)`` that are left when two ρ in a row are made to cancel O(ρ).

    Examples
    --------
    >>> extrapolated(np.array([0.2, 0.1]), np.array([[0.4], [0.2]]))
    array([[0.]])
    """
    large, small = shares[:-1, None], shares[1:, None]
    return np.asarray((large * error[1:] - small * error[:-1]) / (large - small))


def disk_remainder(shares: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return ``(n_rho,)`` the mean of −ρ log v − d + (ρ/2) log(R/r) over R, outside a disk's centre.

    For v in closed form, so that no grid limits ρ.

    Examples
    --------
    >>> left = disk_remainder(np.array([0.02, 0.01]))
    >>> round(float(left[0] / left[1]), 1)
    4.1
    """
    r = np.linspace(_CENTRE, 1.0, 200)
    closed = ball_field(np.stack([r, np.zeros_like(r)], axis=1), 1.0, shares).T
    beyond = -shares[:, None] * np.log(closed) - (1 - r) + shares[:, None] / 2 * np.log(1 / r)
    return np.asarray(np.abs(beyond).mean(axis=1))


def grid_share(case: Case, shares: NDArray[np.float64], error: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return ``(n_rho,)`` medians of what the grid of a disk lacks of the closed form, over d h²/24ρ².

    Beside a flat side it is 1 along an axis and 1/2 along diagonals.

    Examples
    --------
    >>> shares, disk = np.array([0.25, 0.125]), known_cases(40.0)[0]
    >>> grid_share(disk, shares, errors(disk, shares)).round(1)
    array([0.5, 0.6])
    """
    outside = case.distance < (1 - _CENTRE) * case.radius
    depth = case.distance[outside] / case.radius
    rho = shares * case.radius
    closed = ball_field(case.shape.points[outside], case.radius, rho).T
    lacking = -shares[:, None] * np.log(closed) - depth - error[:, outside]
    return np.asarray(np.median(lacking / (depth / rho[:, None] ** 2 / 24), axis=1))
