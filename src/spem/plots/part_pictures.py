"""The parts of one shape on an axis: a band, a region with its boundary, or a shaded surface."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from scipy.ndimage import binary_dilation, distance_transform_edt

from spem.plots.borders import Borders
from spem.plots.boundary_lines import draw_boundary
from spem.plots.camera import picture_size, principal_view, view_rotation
from spem.plots.fields import draw_outline
from spem.plots.level import surface_level
from spem.plots.part_surface import part_surface
from spem.plots.plane import clip_to, contour_lines, extent
from spem.plots.raster import SHARPNESS, render_surface
from spem.plots.style import INK, TEXT_SIZE, bare, part_colours
from spem.plots.values import require_drawable

if TYPE_CHECKING:
    from collections.abc import Sequence

    from matplotlib.axes import Axes
    from matplotlib.image import AxesImage
    from matplotlib.text import Text
    from numpy.typing import ArrayLike, NDArray

    from spem.decomposition.parts import Parts
    from spem.plots.camera import View
    from spem.plots.part_surface import Mesh
    from spem.shapes.shape import Shape

# Pictures of silhouettes have at least this many pixels along their longer side.
FINE = 900
# How far the colours of a region are toned down, so that its boundary stands out.
TONE = 0.35
# Width of an outline that shows the parts of the boundary, in points.
OUTLINE = 2.2
# A number is written in a part whose inner radius in points is at least this.
ROOM = 4.5
# Where the room is this share of the most, a number is as readable, and may stand nearer the middle.
WIDE = 0.85
# How much red, green and blue count for lightness; below the second, numbers are white.
LIGHTNESS = (0.299, 0.587, 0.114)
DARK = 0.48


def draw_parts(
    parts: Parts,
    ax: Axes,
    *,
    boundary: bool = True,
    numbers: bool = True,
    view: View | None = None,
    mesh: Mesh | None = None,
) -> AxesImage:
    """Draw the parts of a shape in their colours; what no part explains is grey.

    Parameters
    ----------
    parts
        Parts of a shape of one, two or three dimensions.
    ax
        Axis to draw on.
    boundary
        Whether the outline of a two-dimensional shape shows the parts of the boundary; otherwise it is ink.
    numbers
        Whether parts of two-dimensional shapes bear their labels, where there is room.
    view
        View of a three-dimensional shape: elevation and azimuth, or a rotation; its broad side by default.
    mesh
        Vertices and faces of the mesh that a three-dimensional shape was made of, to be coloured in place
        of the surface of its voxels.

    Raises
    ------
    ShapeError
        If the shape has more than three dimensions.

    Examples
    --------
    >>> from types import SimpleNamespace
    >>> from spem.plots.style import new_figure
    >>> from spem.shapes.shape import Shape
    >>> toy = SimpleNamespace(shape=Shape.from_mask(np.ones((3, 3, 3))), node_labels=np.arange(27) // 9)
    >>> ax = new_figure(2, 2).add_subplot()
    >>> draw_parts(toy, ax).get_array().shape[2]
    4
    """
    shape = parts.shape
    if shape.ndim == 3:
        return _draw_surface(shape, parts.node_labels, ax, view, mesh)
    require_drawable(shape)
    if shape.ndim == 1:
        return _draw_band(shape, parts.node_labels, ax)
    image = _draw_region(shape, parts.node_labels, ax, TONE if boundary else 0.0)
    if boundary:
        draw_boundary(parts.sources, part_colours(parts.source_labels), ax, widths=OUTLINE)
    else:
        draw_outline(shape, ax, width=0.8)
    if numbers:
        _number(shape, parts.node_labels, ax, TONE if boundary else 0.0)
    return image


def picture_parts(
    shape: Shape,
    node_labels: ArrayLike,
    *,
    view: View | None = None,
    mesh: Mesh | None = None,
    size: tuple[int, int] = (640, 480),
) -> NDArray[np.uint8]:
    """Return a shaded picture of the parts of a three-dimensional shape, without a graphics driver.

    Parameters
    ----------
    shape
        A three-dimensional shape.
    node_labels
        ``(n_nodes,)`` part of each node.
    view, mesh
        As in `draw_parts`.
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
        If labels or mesh do not fit the shape.

    Examples
    --------
    >>> from spem.shapes.shape import Shape
    >>> picture_parts(Shape.from_mask(np.ones((3, 3, 3))), np.arange(27) // 9, size=(32, 24)).shape
    (24, 32, 4)
    """
    surface = part_surface(shape, node_labels, mesh=mesh)
    rotation = principal_view(shape.points) if view is None else view_rotation(view)
    colours = part_colours(surface.face_labels)
    return render_surface(surface.vertices, surface.faces, view=rotation, size=size, face_colours=colours)


def _draw_surface(
    shape: Shape, node_labels: NDArray[np.int32], ax: Axes, view: View | None, mesh: Mesh | None
) -> AxesImage:
    """Draw the surface of a three-dimensional shape, a little finer than the axis is in pixels."""
    size = picture_size(shape, SHARPNESS * ax.bbox.width, view)
    picture = picture_parts(shape, node_labels, view=view, mesh=mesh, size=size)
    bare(ax)
    return ax.imshow(picture, interpolation="antialiased")


def _draw_band(shape: Shape, node_labels: NDArray[np.int32], ax: Axes) -> AxesImage:
    """Draw a one-dimensional shape as a band, clear where it is not."""
    picture = np.zeros((1, shape.mask.size, 4))
    picture[0, shape.voxels] = np.column_stack([part_colours(node_labels), np.ones(shape.n_nodes)])
    left = shape.origin[0] - shape.spacing[0] / 2
    right = left + shape.mask.size * shape.spacing[0]
    bare(ax)
    return ax.imshow(picture, extent=(left, right, 0, (right - left) / 8), interpolation="nearest")


def _draw_region(shape: Shape, node_labels: NDArray[np.int32], ax: Axes, tone: float) -> AxesImage:
    """Draw the nodes' parts as far as the outline, on pixels finer than the grid."""
    rows, columns = shape.mask.shape
    scale = max(1, -(-FINE // max(rows, columns)))
    near = binary_dilation(shape.mask, np.ones((3, 3), bool)).repeat(scale, axis=0).repeat(scale, axis=1)
    index = (np.argwhere(near) + 0.5) / scale - 0.5
    colours = part_colours(Borders.of(shape, node_labels).at(index))
    picture = np.zeros((*near.shape, 4))
    picture[near, :3] = _toned(colours, tone)
    picture[near, 3] = 1.0
    image = ax.imshow(picture, extent=extent(shape), interpolation="antialiased", aspect="equal")
    clip_to(image, ax, contour_lines(shape, surface_level(shape)))
    bare(ax)
    return image


def _toned(colours: NDArray[np.float64], tone: float) -> NDArray[np.float64]:
    """Colours part of the way to white."""
    return np.asarray(colours + tone * (1 - colours))


def _middle(room: NDArray[np.float64], spacing: Sequence[float]) -> NDArray[np.float64]:
    """Return where a part is nearly as wide as anywhere, the nearest to its middle; room is 0 outside."""
    middle = np.argwhere(room > 0).mean(axis=0) * spacing
    wide = np.argwhere(room >= WIDE * room.max()) * np.asarray(spacing)
    return np.asarray(wide[((wide - middle) ** 2).sum(axis=1).argmin()])


def _number(shape: Shape, node_labels: NDArray[np.int32], ax: Axes, tone: float) -> list[Text]:
    """Write the label of each part where it is wide, if it is wide enough; white in dark parts."""
    points_per_unit = 72 / ax.figure.dpi * ax.bbox.width / np.ptp(ax.get_xlim())
    written = []
    for label in np.unique(node_labels[node_labels >= 0]):
        room = distance_transform_edt(shape.to_grid(node_labels == label, 0) > 0, shape.spacing)
        if room.max() * points_per_unit < ROOM:
            continue
        y, x = np.asarray(shape.origin) + _middle(room, shape.spacing)
        light = _toned(part_colours([label]), tone)[0] @ LIGHTNESS
        ink = INK if light > DARK else "white"
        written.append(
            ax.text(x, y, str(label), ha="center", va="center_baseline", fontsize=TEXT_SIZE - 1, color=ink)
        )
    return written
