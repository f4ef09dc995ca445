"""Depth images of a surface, seen from afar in many directions."""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from spem.shapes.surface import Surface

# Half the side of the window over the largest radius: the silhouette keeps off the border of its image.
_WINDOW = 1.1


def upright(surface: Surface) -> Surface:
    """Shift, turn and scale a surface to its principal axes.

    The mean and the covariance are those of the area, so they do not depend on how it is cut in triangles.

    Parameters
    ----------
    surface
        A surface of some area.

    Returns
    -------
    Surface
        Its mean at the origin, its largest spread along axis 0 and its least along axis 2, its farthest
        vertex at distance 1.

    Examples
    --------
    >>> corners = np.array([[0.0, 0, 0], [0, 0, 6], [2, 0, 0], [2, 0, 6]])
    >>> np.ptp(upright(Surface(corners, np.array([[0, 1, 2], [3, 2, 1]]))).vertices, axis=0).round(3)
    array([1.897, 0.632, 0.   ])
    """
    corners = surface.vertices[surface.faces]  # (n_faces, 3, 3)
    first = corners[:, 0]
    area = np.linalg.norm(np.cross(corners[:, 1] - first, corners[:, 2] - first), axis=1)
    share = area / area.sum()
    mean = share @ corners.mean(axis=1)
    off = corners - mean
    total = off.sum(axis=1)
    covariance = (
        np.einsum("f,fci,fcj->ij", share, off, off) + np.einsum("f,fi,fj->ij", share, total, total)
    ) / 12
    _, axes = np.linalg.eigh(covariance)
    points = (surface.vertices - mean) @ axes[:, ::-1]
    return Surface(points / np.linalg.norm(points, axis=1).max(), surface.faces, surface.repairs)


def depth_views(surface: Surface, directions: NDArray[np.float64], side: int = 256) -> NDArray[np.uint8]:
    """Draw a surface in the unit ball as orthographic depth images.

    Parameters
    ----------
    surface
        A surface whose vertices are at most 1 from the origin, such as `upright` makes.
    directions
        ``(n_views, 3)`` unit vectors from the origin to the eye.
    side
        Pixels along each side of an image.

    Returns
    -------
    numpy.ndarray
        ``(n_views, side, side)``: 0 where the line of sight meets nothing, else from 1 at the farthest point
        of the ball to 255 at the nearest.

    Examples
    --------
    >>> corners = np.array([[0.0, 0, 0.5], [0.5, 0, 0.5], [0, 0.5, 0.5]])
    >>> (image,) = depth_views(Surface(corners, np.array([[0, 1, 2]])), np.array([[0.0, 0, 1]]), 8)
    >>> image.shape, np.unique(image)
    ((8, 8), array([  0, 192], dtype=uint8))
    """
    images = np.zeros((len(directions), side, side), np.float32)
    half = side / 2
    for image, direction in zip(images, directions, strict=True):
        seen = surface.vertices @ _frame(direction).T
        seen[:, :2] = seen[:, :2] * (half / _WINDOW) + (half - 0.5)
        seen[:, 2] = 128 + 127 * seen[:, 2]
        _draw(seen, surface.faces, image)
    return np.rint(images).astype(np.uint8)


def _frame(direction: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the axes of an image and of its depth as rows, right-handed."""
    # Symmetric views of symmetric surfaces are then the same but for quarter turns of the image.
    order = np.argsort(-np.abs(direction), kind="stable")
    aside = np.eye(3)[order[0] if abs(direction[order[1]]) > 0 else order[1]]
    down = np.cross(direction, aside)
    down /= np.linalg.norm(down)
    return np.stack([down, np.cross(direction, down), direction])


@njit(cache=True, nogil=True)
def _draw(  # pragma: no cover
    points: NDArray[np.float64], faces: NDArray[np.int64], image: NDArray[np.float32]
) -> None:
    """Keep in each pixel the largest third coordinate over its centre of all triangles."""
    rows, columns = image.shape
    for face in range(faces.shape[0]):
        a, b, c = points[faces[face, 0]], points[faces[face, 1]], points[faces[face, 2]]
        area = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
        if area == 0.0:
            continue
        by_row = ((b[2] - a[2]) * (c[1] - a[1]) - (c[2] - a[2]) * (b[1] - a[1])) / area
        by_column = ((c[2] - a[2]) * (b[0] - a[0]) - (b[2] - a[2]) * (c[0] - a[0])) / area
        top = max(int(np.ceil(min(a[0], b[0], c[0]))), 0)
        bottom = min(int(np.floor(max(a[0], b[0], c[0]))), rows - 1)
        for row in range(top, bottom + 1):
            low, high = -1.0, float(columns)
            for p, q in ((a, b), (b, c), (c, a)):
                # The side of an edge on which a pixel lies is linear along the row.
                slope = (q[0] - p[0]) * (1.0 if area > 0 else -1.0)
                value = ((q[0] - p[0]) * -p[1] - (q[1] - p[1]) * (row - p[0])) * (1.0 if area > 0 else -1.0)
                if slope > 0:
                    low = max(low, -value / slope)
                elif slope < 0:
                    high = min(high, -value / slope)
                elif value < 0:
                    high = -1.0
            for column in range(max(int(np.ceil(low)), 0), min(int(np.floor(high)), columns - 1) + 1):
                depth = a[2] + by_row * (row - a[0]) + by_column * (column - a[1])
                image[row, column] = max(image[row, column], depth)
