"""Canonical forms: a surface bent until straight distances are those along it, whatever its pose was."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray
from scipy.linalg import eigh

from spem.rivals.fast_marching import Fans, geodesic_disk
from spem.shapes.surface import Surface


@dataclass(frozen=True, eq=False)
class Scaling:
    """Points whose distances are nearly given ones.

    Parameters
    ----------
    points
        ``(n_points, n_axes)`` coordinates, their mean at the origin.
    stress
        ``(n_iterations + 1,)`` sum of squared errors over all pairs, of the start and after each iteration.
    converged
        Whether the stress had stopped to fall.
    """

    points: NDArray[np.float64]
    stress: NDArray[np.float64]
    converged: bool


def surface_distances(surface: Surface) -> NDArray[np.float64]:
    """Compute the distances along a surface between its vertices, by fast marching.

    Vertices of different components are as far apart as the farthest two of one component.

    Parameters
    ----------
    surface
        A manifold surface.

    Returns
    -------
    numpy.ndarray
        ``(n_vertices, n_vertices)`` symmetric, zero on the diagonal.

    Examples
    --------
    >>> corners = np.array([[0.0, 0, 0], [3, 0, 0], [3, 4, 0], [0, 4, 0]])
    >>> surface_distances(Surface(corners, np.array([[0, 1, 2], [0, 2, 3]])))[0]
    array([0., 3., 5., 4.])
    """
    n = len(surface.vertices)
    fans, found = Fans.of(surface.faces, n), np.full((n, n), np.inf)
    for vertex in range(n):
        near, distances = geodesic_disk(surface.vertices, fans, vertex, np.inf)
        found[vertex, near] = distances
    reached = np.isfinite(found)
    found[~reached] = found[reached].max()
    return np.asarray((found + found.T) / 2)


def classical_scaling(distances: NDArray[np.float64], n_axes: int = 3) -> NDArray[np.float64]:
    """Place points by the leading eigenvectors of their doubly centred squared distances.

    Parameters
    ----------
    distances
        ``(n_points, n_points)`` symmetric.
    n_axes
        Dimension of the space; directions of negative eigenvalues are left flat.

    Returns
    -------
    numpy.ndarray
        ``(n_points, n_axes)``, axes of largest spread first.

    Examples
    --------
    >>> places = classical_scaling(np.array([[0.0, 1, 3], [1, 0, 2], [3, 2, 0]]), 1)
    >>> np.abs(np.diff(places[:, 0])).round(12)
    array([1., 2.])
    """
    n = len(distances)
    squared = distances**2
    means = squared.mean(axis=0)
    gram = -(squared - means - means[:, None] + means.mean()) / 2
    values, vectors = eigh(gram, subset_by_index=(max(n - n_axes, 0), n - 1))
    points = np.zeros((n, n_axes))
    points[:, : len(values)] = (vectors * np.sqrt(np.maximum(values, 0)))[:, ::-1]
    return points


def least_squares_scaling(
    distances: NDArray[np.float64],
    start: NDArray[np.float64],
    *,
    tolerance: float = 1e-4,
    max_iterations: int = 1000,
) -> Scaling:
    """Place points so that the sum of squared errors of their distances is least, by SMACOF.

    Each iteration is the Guttman transform X ← B(X) X / n, which never raises the stress.

    Parameters
    ----------
    distances
        ``(n_points, n_points)`` symmetric, zero on the diagonal.
    start
        ``(n_points, n_axes)`` coordinates to start from.
    tolerance
        Relative fall of the stress over one iteration at which to stop.
    max_iterations
        Number of iterations at which to stop in any case.

    Examples
    --------
    >>> triangle = 1.0 - np.eye(3)
    >>> found = least_squares_scaling(triangle, np.array([[0.0, 0], [1, 0], [0, 2]]), tolerance=1e-12)
    >>> bool(found.stress[-1] < 1e-9), found.converged
    (True, True)
    """
    points = start - start.mean(axis=0)
    moved, first = _guttman(distances, points)
    stress = [first]
    for _ in range(max_iterations):
        points = moved
        moved, reached = _guttman(distances, points)
        stress.append(reached)
        if stress[-2] - stress[-1] <= tolerance * stress[-2]:
            return Scaling(points, np.array(stress), True)
    return Scaling(points, np.array(stress), False)


def canonical_form(surface: Surface, *, tolerance: float = 1e-4, max_iterations: int = 1000) -> Surface:
    """Bend a surface until the straight distances of its vertices are nearly those along it.

    Parameters
    ----------
    surface
        A manifold surface.
    tolerance, max_iterations
        Of `least_squares_scaling`, which starts from `classical_scaling`.

    Returns
    -------
    Surface
        The same faces; vertices up to a rotation, a reflection and a shift.

    Examples
    --------
    Two faces folded along an edge come out flat, their far corners two heights apart:

    >>> corners = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
    >>> flat = canonical_form(Surface(corners, np.array([[0, 1, 2], [0, 3, 1]]))).vertices
    >>> round(float(np.linalg.norm(flat[2] - flat[3])), 3)
    2.0
    """
    distances = surface_distances(surface)
    start = classical_scaling(distances)
    scaling = least_squares_scaling(distances, start, tolerance=tolerance, max_iterations=max_iterations)
    return Surface(scaling.points, surface.faces, surface.repairs)


@njit(cache=True, nogil=True)
def _guttman(  # pragma: no cover
    distances: NDArray[np.float64], points: NDArray[np.float64]
) -> tuple[NDArray[np.float64], float]:
    """Return the Guttman transform of points, and the stress of the points themselves."""
    n, n_axes = points.shape
    moved, stress, offset = np.zeros((n, n_axes)), 0.0, np.empty(n_axes)
    for i in range(n):
        for j in range(i):
            squared = 0.0
            for axis in range(n_axes):
                offset[axis] = points[i, axis] - points[j, axis]
                squared += offset[axis] * offset[axis]
            length = np.sqrt(squared)
            stress += (distances[i, j] - length) ** 2
            if length > 0.0:
                ratio = distances[i, j] / (length * n)
                for axis in range(n_axes):
                    moved[i, axis] += ratio * offset[axis]
                    moved[j, axis] -= ratio * offset[axis]
    return moved, stress
