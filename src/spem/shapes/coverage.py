"""Where an edge lies in an image whose pixels hold the share of their area that the shape covers.

A straight edge with unit normal n leaves a pixel's area in one of two parts whose share is a known
function of n and of the edge's distance from the pixel's centre; inverted, it gives the distance
exactly, where interpolating the shares between pixels errs by up to a tenth of a pixel.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from spem.shapes.levels import boundary_edges
from spem.shapes.shape import Cuts

# Pixels between these shares are taken for crossed by an edge; ringing and noise stay outside.
_MIXED = (0.1, 0.9)
# A sharp edge crosses as many pixels as it cuts grid edges, |n_0| + |n_1| per unit length, so about
# 0.8 of that number lie in _MIXED; an edge blurred over two pixels has over 1.2 of it.
_SHARP_RATIO = 1.1
# The ends of a column of pixels count as full and empty when they differ by this much.
_FULL = 0.98
_TINY = 1e-12


def is_coverage(coverage: NDArray[np.floating], inside: NDArray[np.bool_]) -> bool:
    """Tell whether edges are one pixel wide, as area coverage makes them, and not blurred.

    Parameters
    ----------
    coverage
        ``(n_0, n_1)`` grey level scaled to 0 on the background and 1 on the shape.
    inside
        ``(n_0, n_1)`` whether the coverage is over one half.

    Examples
    --------
    >>> ramp = np.array([[0.0, 0.0, 0.3, 1.0, 1.0]])
    >>> is_coverage(ramp, ramp > 0.5)
    True
    """
    mixed = np.count_nonzero((coverage > _MIXED[0]) & (coverage < _MIXED[1]))
    edges = sum(np.count_nonzero(np.diff(inside, axis=axis)) for axis in range(2))
    return bool(mixed <= _SHARP_RATIO * edges)


def coverage_cuts(coverage: NDArray[np.floating], inside: NDArray[np.bool_]) -> Cuts:
    """Cut the grid edges of an image of area coverage by the straight edge through each pixel.

    Parameters
    ----------
    coverage
        ``(n_0, n_1)`` share of each pixel that the shape covers; clipped to [0, 1].
    inside
        ``(n_0, n_1)`` whether the coverage is over one half, that is, the centre is covered.

    Returns
    -------
    Cuts
        One cut for each edge from an inside to an outside pixel; on the pixel's side where neither
        pixel is partly covered.

    Examples
    --------
    >>> ramp = np.array([[0.0, 0.7, 1.0, 0.3, 0.0]] * 3)
    >>> coverage_cuts(ramp, ramp > 0.5).fraction[:2]
    array([0.2, 0.8])
    """
    framed = np.pad(np.clip(coverage, 0.0, 1.0), 2, mode="edge")
    parts = []
    for direction, start, end in boundary_edges(inside):
        near = _offset(framed, start, inside.shape[1], direction // 2)
        far = _offset(framed, end, inside.shape[1], direction // 2)
        # the pixel that the crossing lies in knows its place; the other one's estimate is outside it
        fraction = np.clip(near, 0.0, 0.5) + np.clip(1.0 + far, 0.5, 1.0) - 0.5
        parts.append((start, np.full(start.size, direction, np.uint8), np.maximum(fraction, 1e-9)))
    voxel, directions, fraction = (np.concatenate(column) for column in zip(*parts, strict=True))
    return Cuts(voxel, directions, fraction)


def _offset(
    framed: NDArray[np.floating], flat: NDArray[np.int64], width: int, axis: int
) -> NDArray[np.float64]:
    """Distance along an axis from pixel centres to the edge through them, positive from inside."""
    row, column = np.divmod(flat, width)
    place = np.arange(5)
    patch: NDArray[np.float64] = framed[
        row[:, None, None] + place[:, None], column[:, None, None] + place
    ].astype(np.float64)  # (n, 5, 5)
    m0, m1 = _normal(patch)
    small, large = np.minimum(m0, m1), np.maximum(m0, m1)
    share = patch[:, 2, 2]
    less = np.minimum(share, 1.0 - share)
    corner = 2.0 * large * less < small
    plane = np.where(corner, np.sqrt(2.0 * small * large * less), large * less + 0.5 * small)
    centre = np.where(share > 0.5, 0.5 - plane, plane - 0.5)
    return np.asarray(centre / np.maximum(m0 if axis == 0 else m1, _TINY))


def _normal(patch: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Sizes of the normal's components at the centres of 5 x 5 patches, scaled to sum to one."""
    weights, difference = np.array([1.0, 2.0, 1.0]), np.array([1.0, 0.0, -1.0])
    inner = patch[:, 1:4, 1:4]
    m0 = np.abs(np.einsum("nij,i,j->n", inner, difference, weights))
    m1 = np.abs(np.einsum("nij,i,j->n", inner, weights, difference))
    tall = m0 >= m1
    # height function: the sums of three columns give the slope of a straight edge exactly, if the
    # edge leaves none of them through its ends; the smoothed gradient above errs by some degrees
    columns = np.where(tall[:, None, None], patch, patch.transpose(0, 2, 1))[:, :, 1:4]
    span = columns[:, 0] - columns[:, -1]
    whole = np.all(np.abs(span) > _FULL, axis=1) & (np.abs(span.sum(axis=1)) > 3 * _FULL)
    height = columns.sum(axis=1)
    slope = np.abs(height[:, 2] - height[:, 0]) / 2.0
    m0 = np.where(whole, np.where(tall, 1.0, slope), m0)
    m1 = np.where(whole, np.where(tall, slope, 1.0), m1)
    total = np.maximum(m0 + m1, _TINY)
    return m0 / total, m1 / total
