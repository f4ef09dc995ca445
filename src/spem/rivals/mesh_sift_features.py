"""Orientations and descriptors of meshSIFT keypoints: a daisy of histograms around each."""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

from spem.rivals.curvature_scale_space import CurvatureScaleSpace
from spem.rivals.fast_marching import Fans, geodesic_disk
from spem.rivals.surface_curvature import SurfaceCurvature, tangent_frames

# All in units of the keypoint's scale σ, as published.
REACH = 9.0
WEIGHT_WIDTH = 4.5
RING = 4.5
REGION_RADIUS = 3.75

N_REGIONS = 9
N_BINS = 8
N_ENTRIES = 2 * N_BINS * N_REGIONS
_N_ANGLES = 360
_PEAK = 0.8
# a square of regions about the keypoint, its sides and its corners
_CENTRES = RING * np.array([[0.0, 0], [1, 0], [1, 1], [0, 1], [-1, 1], [-1, 0], [-1, -1], [0, -1], [1, -1]])


def _smoothing() -> NDArray[np.complex128]:
    """Return the transform of three passes of the Gaussian of 17 bins over the histogram of directions."""
    kernel = np.zeros(_N_ANGLES)
    kernel[np.arange(-8, 9)] = np.exp(-(np.arange(-8, 9) ** 2) / (2 * 17.0**2))
    return np.asarray(np.fft.rfft(kernel / kernel.sum()) ** 3)


_SMOOTH = _smoothing()


def keypoint_features(space: CurvatureScaleSpace, keypoints: NDArray[np.int64]) -> NDArray[np.float32]:
    """Describe the surface around each keypoint, once for each of its orientations.

    Parameters
    ----------
    space
        The scale space that the keypoints were found in.
    keypoints
        ``(n_keypoints, 2)`` scale and vertex.

    Returns
    -------
    numpy.ndarray
        ``(n_features, 144)`` unit vectors: for each of nine regions, histograms of shape index and of slant
        angle, eight bins each.
    """
    fans = Fans.of(space.faces, space.vertices.shape[1])
    rows = []
    for scale in np.unique(keypoints[:, 0]):
        curvature, sigma = space.curvature[scale], float(space.sigma[scale])
        bins = _shape_bins(curvature)
        for vertex in keypoints[keypoints[:, 0] == scale, 1]:
            near, distance = geodesic_disk(space.vertices[scale], fans, int(vertex), REACH * sigma)
            offset = space.vertices[scale][near] - space.vertices[scale][vertex]
            rows += _describe(offset, distance / sigma, near, curvature, bins)
    return _unit(np.array(rows).reshape(-1, N_ENTRIES)).astype(np.float32)


def _shape_bins(curvature: SurfaceCurvature) -> NDArray[np.int64]:
    """Return the bin of each vertex's shape index."""
    return np.clip(((curvature.shape_index + 1) * N_BINS / 2).astype(np.int64), 0, N_BINS - 1)


def _describe(
    offset: NDArray[np.float64],
    distance: NDArray[np.float64],
    near: NDArray[np.int64],
    curvature: SurfaceCurvature,
    bins: NDArray[np.int64],
) -> list[NDArray[np.float64]]:
    """Return the descriptors of one keypoint from its neighbourhood, lengths in units of its scale."""
    normals = curvature.normals[near]
    weight = curvature.areas[near] * np.exp(-np.square(distance / WEIGHT_WIDTH) / 2)
    reference = weight @ normals
    length = float(np.linalg.norm(reference))
    if length == 0:
        return []
    reference /= length
    frame = tangent_frames(reference)
    tilt = weight * np.arccos(np.clip(normals @ reference, -1, 1))
    slant, bearing = _angles(normals @ frame.T), _angles(offset @ frame.T)
    # angles from the mean slant: bins of directions are then the same however the surface is turned
    mean_slant = np.angle(tilt @ np.exp(1j * slant))
    slant, bearing = slant - mean_slant, bearing - mean_slant
    bent = weight * curvature.curvedness[near]
    found = []
    for turn in _orientations(slant, tilt):
        # geodesic polar coordinates as a plane
        angle = bearing - turn
        place = distance[:, None] * np.stack([np.cos(angle), np.sin(angle)], axis=1)
        found.append(_histograms(place, slant - turn, bins[near], bent, tilt))
    return found


def _angles(vectors: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the direction of plane vectors, in radians."""
    return np.asarray(np.arctan2(vectors[:, 1], vectors[:, 0]))


def _orientations(slant: NDArray[np.float64], tilt: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the peaks of the smoothed histogram of slants that reach 80 % of the highest, in radians."""
    step = 2 * np.pi / _N_ANGLES
    place = np.floor(slant / step).astype(np.int64) % _N_ANGLES
    counts = np.fft.irfft(np.fft.rfft(np.bincount(place, tilt, _N_ANGLES)) * _SMOOTH, _N_ANGLES)
    before, after = np.roll(counts, 1), np.roll(counts, -1)
    peaks = np.flatnonzero((counts > before) & (counts >= after) & (counts >= _PEAK * counts.max()))
    low, top, high = before[peaks], counts[peaks], after[peaks]
    return np.asarray((peaks + 0.5 + (low - high) / (2 * (low - 2 * top + high))) * step)


def _histograms(
    place: NDArray[np.float64],
    slant: NDArray[np.float64],
    shape_bin: NDArray[np.int64],
    bent: NDArray[np.float64],
    tilt: NDArray[np.float64],
) -> NDArray[np.float64]:
    """Return the descriptor of one orientation, ``(144,)``."""
    slant_bin = np.floor(slant * (N_BINS / (2 * np.pi))).astype(np.int64) % N_BINS
    shapes, slants = _daisy(place, _CENTRES, shape_bin, slant_bin, bent, tilt)
    return _unit(np.concatenate([_clipped(shapes), _clipped(slants)], axis=1)).reshape(-1)


@njit(cache=True, nogil=True)
def _daisy(
    place: NDArray[np.float64],
    centres: NDArray[np.float64],
    shape_bin: NDArray[np.int64],
    slant_bin: NDArray[np.int64],
    bent: NDArray[np.float64],
    tilt: NDArray[np.float64],
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the histograms of shape index and of slant of each region, ``(9, 8)`` each."""
    shapes, slants = np.zeros((N_REGIONS, N_BINS)), np.zeros((N_REGIONS, N_BINS))
    for i in range(len(place)):
        for region in range(N_REGIONS):
            x, y = place[i, 0] - centres[region, 0], place[i, 1] - centres[region, 1]
            square = x * x + y * y
            if square < REGION_RADIUS**2:
                weight = np.exp(-square / (2 * WEIGHT_WIDTH**2))
                shapes[region, shape_bin[i]] += weight * bent[i]
                slants[region, slant_bin[i]] += weight * tilt[i]
    return shapes, slants


def _clipped(counts: NDArray[Any]) -> NDArray[np.float64]:
    """Return the histograms of the regions at unit length, clipped so that no bin outweighs the rest."""
    return np.asarray(np.minimum(_unit(counts.reshape(N_REGIONS, N_BINS)), 1 / np.sqrt(N_BINS)))


def _unit(rows: NDArray[Any]) -> NDArray[np.float64]:
    """Return rows of length one; null ones stay."""
    length = np.linalg.norm(rows, axis=1, keepdims=True)
    return np.asarray(rows / np.where(length > 0, length, 1))
