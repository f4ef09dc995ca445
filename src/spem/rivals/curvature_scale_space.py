"""Scale space of a surface's mean curvature, and the keypoints where it changes most between scales."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array, csr_array, diags_array, eye_array

from spem.rivals.surface_curvature import SurfaceCurvature, surface_curvature


@dataclass(frozen=True, eq=False)
class CurvatureScaleSpace:
    """A surface smoothed again and again.

    Parameters
    ----------
    faces
        ``(n_faces, 3)`` vertex indices, the same at all scales.
    sigma
        ``(n_scales,)`` standard deviation of the Gaussian that the smoothing stands for, in the unit of the
        vertices.
    vertices
        ``(n_scales, n_vertices, 3)`` the smoothed surfaces.
    curvature
        Curvatures at each scale.
    """

    faces: NDArray[np.int64]
    sigma: NDArray[np.float64]
    vertices: NDArray[np.float64]
    curvature: tuple[SurfaceCurvature, ...]

    @cached_property
    def differences(self) -> NDArray[np.float64]:
        """``(n_scales − 1, n_vertices)`` mean curvature at the next scale less that at each."""
        return np.diff([scale.mean for scale in self.curvature], axis=0)

    def keypoints(self) -> NDArray[np.int64]:
        """Find the extrema of `differences` over neighbours in space and in scale.

        Returns
        -------
        numpy.ndarray
            ``(n_keypoints, 2)`` scale and vertex of each; never of the first or last difference.
        """
        values = self.differences
        around = _adjacency(self.faces, values.shape[1]).tocsr()
        found = np.zeros(values.shape, bool)
        for sign in (1, -1):
            signed = sign * values
            ring = np.array([_ring_maximum(around, row) for row in signed])
            with_centre = np.maximum(ring, signed)
            middle = signed[1:-1]
            found[1:-1] |= (middle > ring[1:-1]) & (middle > with_centre[:-2]) & (middle > with_centre[2:])
        return np.argwhere(found)


def curvature_scale_space(
    vertices: NDArray[np.float64],
    faces: NDArray[np.int64],
    *,
    first_steps: float = 5,
    scales_per_octave: int = 2,
    n_scales: int = 8,
) -> CurvatureScaleSpace:
    """Smooth a surface by repeated binomial filtering and measure its curvatures at each scale.

    One step moves each vertex to the mean of itself and its neighbours; m steps stand for a Gaussian of
    standard deviation e √(2m/3), with e the median length of an edge.

    Parameters
    ----------
    vertices
        ``(n_vertices, 3)`` coordinates.
    faces
        ``(n_faces, 3)`` vertex indices, counter-clockwise seen from outside.
    first_steps
        Number of steps of the first scale.
    scales_per_octave
        Number of scales until the number of steps has doubled.
    n_scales
        Number of scales.

    Examples
    --------
    >>> import trimesh
    >>> ball = trimesh.creation.icosphere(subdivisions=2)
    >>> curvature_scale_space(ball.vertices, ball.faces, n_scales=4).vertices.shape
    (4, 162, 3)
    """
    n = len(vertices)
    around = _adjacency(faces, n)
    row, column = around.coords
    edge = float(np.median(np.linalg.norm(vertices[row] - vertices[column], axis=1)))
    smooth = around.tocsr() + eye_array(n, format="csr")
    smooth = diags_array(1 / smooth.sum(axis=1)) @ smooth
    steps = np.rint(first_steps * 2 ** (np.arange(n_scales) / scales_per_octave)).astype(int)
    levels, current, done = [], np.asarray(vertices, np.float64), 0
    for target in steps:
        for _ in range(target - done):
            current = smooth @ current
        done = int(target)
        levels.append(current)
    curvature = tuple(surface_curvature(level, faces) for level in levels)
    return CurvatureScaleSpace(faces, edge * np.sqrt(2 * steps / 3), np.array(levels), curvature)


def _adjacency(faces: NDArray[np.int64], n: int) -> coo_array:
    """Return the symmetric matrix of ones at neighbouring vertices."""
    start, stop = faces.reshape(-1), np.roll(faces, -1, axis=1).reshape(-1)
    key = np.unique(np.concatenate([start * n + stop, stop * n + start]))
    return coo_array((np.ones(key.size), (key // n, key % n)), shape=(n, n))


def _ring_maximum(around: csr_array, values: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the largest value among each vertex's neighbours; vertices without any are given infinity."""
    filled = np.flatnonzero(np.diff(around.indptr))
    largest = np.full(values.size, np.inf)
    largest[filled] = np.maximum.reduceat(values[around.indices], around.indptr[filled])
    return largest
