"""Surfaces of equal value inside a three-dimensional shape, seen through it, as Fig. 15 has them."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.colors import to_rgb

from spem.fields.isocontours import iso_surfaces
from spem.plots.camera import principal_view, view_rotation
from spem.plots.raster import render_surface
from spem.plots.style import SOLID, bare
from spem.plots.surfaces import shape_surface

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.image import AxesImage
    from numpy.typing import ArrayLike, NDArray

    from spem.plots.camera import View
    from spem.shapes.shape import Shape

# Colours of the surfaces at the lower and at the upper threshold: the ends of the map colours.
LOW_COLOUR, HIGH_COLOUR = "#2166ac", "#b2182b"
# How much of the shape's own picture covers the surfaces inside it, and how opaque it is beside them.
VEIL, GHOST = 0.22, 0.45


def picture_levels(
    shape: Shape,
    values: ArrayLike,
    thresholds: tuple[float, float],
    *,
    view: View | None = None,
    size: tuple[int, int] = (320, 320),
) -> NDArray[np.uint8]:
    """Return a picture of a shape of glass with the surfaces at a lower and at an upper threshold inside.

    What lies below the lower one is blue, above the upper one red; if both are the same, only red is drawn.

    Parameters
    ----------
    shape
        A three-dimensional shape.
    values
        ``(n_nodes,)`` one value a node.
    thresholds
        The lower and the upper value; a surface is left out where no value lies beyond its own.
    view
        Elevation and azimuth in degrees, a rotation, or None to look at the broad side.
    size
        Width and height in pixels.

    Returns
    -------
    picture
        ``(height, width, 4)`` bytes on a transparent ground.

    Raises
    ------
    ShapeError
        If the shape is not three-dimensional.
    ParameterError
        If there is not one value for each node.

    Examples
    --------
    >>> from spem.shapes.shape import Shape
    >>> shape = Shape.from_mask(np.ones((4, 4, 4)))
    >>> picture_levels(shape, shape.points[:, 0], (0.5, 2.5), size=(32, 24)).shape
    (24, 32, 4)
    """
    body = shape_surface(shape)
    rotation = principal_view(shape.points) if view is None else view_rotation(view)
    ghost = render_surface(body.vertices, body.faces, view=rotation, size=size, colour=SOLID)
    low, high = _regions(shape, values, thresholds)
    # Faces without area are not drawn, but the camera is fitted to them: both pictures have one view.
    frame = (body.vertices, np.arange(len(body.vertices))[:, None].repeat(3, axis=1))
    first = np.cumsum([0, len(low[0]), len(high[0])])
    colours = [to_rgb(LOW_COLOUR), to_rgb(HIGH_COLOUR), to_rgb(SOLID)]
    meshes = (low, high, frame)
    inner = render_surface(
        np.concatenate([mesh[0] for mesh in meshes]),
        np.concatenate([mesh[1] + start for mesh, start in zip(meshes, first, strict=True)]),
        view=rotation,
        size=size,
        face_colours=np.repeat(colours, [len(mesh[1]) for mesh in meshes], axis=0),
    )
    return _through(ghost, inner)


def draw_levels(
    shape: Shape,
    values: ArrayLike,
    thresholds: tuple[float, float],
    ax: Axes,
    *,
    view: View | None = None,
    size: tuple[int, int] = (480, 480),
) -> AxesImage:
    """Draw the surfaces at two thresholds on an axis; the arguments are those of `picture_levels`.

    Examples
    --------
    >>> from spem.plots.style import new_figure
    >>> from spem.shapes.shape import Shape
    >>> shape = Shape.from_mask(np.ones((4, 4, 4)))
    >>> ax = new_figure(2, 2).add_subplot()
    >>> draw_levels(shape, shape.points[:, 0], (0.5, 2.5), ax, size=(32, 32)).get_array().shape
    (32, 32, 4)
    """
    picture = picture_levels(shape, values, thresholds, view=view, size=size)
    bare(ax)
    return ax.imshow(picture, interpolation="antialiased")


def _regions(
    shape: Shape, values: ArrayLike, thresholds: tuple[float, float]
) -> list[tuple[NDArray[np.float64], NDArray[np.int64]]]:
    """Triangulate what lies below the lower threshold, and what lies above the upper one."""
    nodal = np.asarray(values, np.float64)
    meshes = []
    for sign, level in ((-1.0, thresholds[0]), (1.0, thresholds[1])):
        meshes += iso_surfaces(shape, sign * nodal, [sign * level])
    if thresholds[0] == thresholds[1]:
        meshes[0] = (np.empty((0, 3)), np.empty((0, 3), np.int64))
    return meshes


def _through(ghost: NDArray[np.uint8], inner: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Lay the picture of a shape of glass over that of what is inside."""
    glass, core = ghost / 255.0, inner / 255.0
    opacity = core[..., 3:]
    colour = (1 - VEIL) * core[..., :3] + VEIL * glass[..., :3]
    mixed = opacity * colour + (1 - opacity) * glass[..., :3]
    shown = opacity + (1 - opacity) * GHOST * glass[..., 3:]
    return np.asarray(np.rint(255 * np.concatenate([mixed, shown], axis=2)), np.uint8)
