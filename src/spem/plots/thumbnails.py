"""Small pictures of shapes, for galleries."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.colors import to_rgb
from PIL import Image

from spem.plots.level import surface_level
from spem.plots.style import SOLID, image_png
from spem.plots.surfaces import picture_surface
from spem.plots.values import require_drawable

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from spem.shapes.shape import Shape


def thumbnail(shape: Shape, size: int = 96) -> bytes:
    r"""Return a small square picture of a shape as a PNG file with a transparent ground.

    Silhouettes are filled, volumes shaded, and one-dimensional shapes drawn as a bar.

    Parameters
    ----------
    shape
        A shape of one, two or three dimensions.
    size
        Side in pixels.

    Raises
    ------
    ShapeError
        If the shape has more than three dimensions.

    Examples
    --------
    >>> from spem.shapes.shape import Shape
    >>> thumbnail(Shape.from_mask(np.ones((3, 4))))[:4]
    b'\x89PNG'
    """
    require_drawable(shape)
    if shape.ndim == 3:
        return image_png(picture_surface(shape, size=(size, size)))
    return image_png(_silhouette(shape, size))


def _silhouette(shape: Shape, size: int) -> NDArray[np.uint8]:
    """Fill a flat shape with one colour; its rim is smoothed over a pixel."""
    level = np.atleast_2d(surface_level(shape))
    if shape.ndim == 1:
        level = np.repeat(level, max(2, level.size // 12), axis=0)
    spacing = np.asarray(shape.spacing if shape.ndim == 2 else shape.spacing * 2)
    extent = np.array(level.shape) * spacing
    rows, columns = np.maximum(1, np.rint(size * extent / extent.max())).astype(int)
    # Enlarged smoothly, then made a mask, then averaged: an edge without stairs.
    fine = Image.fromarray(level.astype(np.float32)).resize(
        (4 * columns, 4 * rows), Image.Resampling.BILINEAR
    )
    cover = np.asarray(fine) > 0
    opacity = cover.reshape(rows, 4, columns, 4).mean(axis=(1, 3))
    picture = np.zeros((size, size, 4), np.uint8)
    picture[..., :3] = np.rint(255 * np.array(to_rgb(SOLID)))
    top, left = (size - rows) // 2, (size - columns) // 2
    picture[top : top + rows, left : left + columns, 3] = np.rint(255 * opacity)
    return picture
