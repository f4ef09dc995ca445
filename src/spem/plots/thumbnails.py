"""Small pictures of shapes, for galleries."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.colors import to_rgb
from PIL import Image
from scipy.ndimage import gaussian_filter
from skimage.measure import marching_cubes

from spem.plots.camera import principal_view
from spem.plots.level import LEAST, STAIR_WIDTH, surface_level
from spem.plots.raster import render_surface
from spem.plots.style import SOLID, image_png
from spem.plots.values import require_drawable

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from spem.shapes.shape import Shape

# Share of the volume that a shape must have kept for the surface of its file to be a picture of it.
_WHOLE = 0.999
# Voxels of a grid up to which its exact surface takes a few milliseconds.
_COARSE = 20_000


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
    picture = _solid(shape, size) if shape.ndim == 3 else _silhouette(shape, size)
    return image_png(picture, optimize=False)


def _solid(shape: Shape, size: int) -> NDArray[np.uint8]:
    """Draw a solid by its own surface, where the grid has all of it, or by one of the grid."""
    view = principal_view(shape.points)
    if shape.surface is not None and shape.report.volume_kept > _WHOLE:
        vertices, faces = shape.surface.vertices, shape.surface.faces
    else:
        index, faces, _, _ = marching_cubes(_level(shape), 0.0, gradient_direction="ascent")
        vertices = np.asarray(shape.origin) + index * np.asarray(shape.spacing)
    return render_surface(vertices, faces, view=view, size=(size, size))


def _level(shape: Shape) -> NDArray[Any]:
    """Return a level function: of a fine grid a rough one, in a tenth of the time."""
    if shape.mask.size <= _COARSE:
        return surface_level(shape)
    level = np.where(shape.mask, np.float32(1), np.float32(-1))
    level = gaussian_filter(level, STAIR_WIDTH, mode="nearest", truncate=2.0)
    kept: NDArray[Any] = np.where(shape.mask, np.maximum(level, LEAST), np.minimum(level, -LEAST))
    return kept


def _silhouette(shape: Shape, size: int) -> NDArray[np.uint8]:
    """Fill a flat shape with one colour; its rim is smoothed over a pixel."""
    level = np.atleast_2d(_level(shape))
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
