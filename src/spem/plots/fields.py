"""Values on the nodes of shapes of one and two dimensions, and on slices through volumes."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.collections import LineCollection

from spem.errors import ParameterError
from spem.plots.extension import extend_values
from spem.plots.level import surface_level
from spem.plots.plane import clip_to, contour_lines, extent, frame, require_dimension
from spem.plots.style import COLOURS, FIELD_CMAP, INK, MAP_CMAP, bare, framed
from spem.plots.values import node_values, value_limits

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.colors import Colormap
    from matplotlib.image import AxesImage
    from matplotlib.lines import Line2D
    from numpy.typing import ArrayLike, NDArray

    from spem.shapes.shape import Shape

CONTOURS = 9


def draw_values(
    shape: Shape,
    values: ArrayLike,
    ax: Axes,
    *,
    cmap: str | Colormap | None = None,
    symmetric: bool = False,
    limits: tuple[float, float] | None = None,
    contours: bool = False,
    boundary: float | None = None,
) -> AxesImage:
    """Draw node values of a two-dimensional shape as an image in its own coordinates.

    Axis 0 goes down and axis 1 right, as in the image file. Colours are interpolated between the
    nodes and end at the outline; outside it nothing is drawn.

    Parameters
    ----------
    shape
        A two-dimensional shape.
    values
        ``(n_nodes,)`` one value a node.
    ax
        Axis to draw on.
    cmap
        Matplotlib colour map; by default one for signed or for unsigned values.
    symmetric
        Whether values are signed, coloured about zero.
    limits
        Values at the ends of the colour map; by default those of `values`.
    contours
        Whether to draw lines of equal value.
    boundary
        Value on the outline, where it is known.

    Raises
    ------
    ShapeError
        If the shape is not two-dimensional.

    Examples
    --------
    >>> from spem.plots.style import new_figure
    >>> from spem.shapes.shape import Shape
    >>> ax = new_figure(2, 2).add_subplot()
    >>> draw_values(Shape.from_mask(np.ones((2, 3))), range(6), ax).get_extent()
    [-1.5, 3.5, 2.5, -1.5]
    """
    require_dimension(shape, 2, "an image")
    nodal = node_values(shape, values)
    level = surface_level(shape)
    grid = extend_values(shape, nodal, level, boundary=boundary)
    ends = limits or value_limits(nodal, symmetric=symmetric)
    image = _draw_grid(shape, grid, level, (0, 1), ax, cmap or (MAP_CMAP if symmetric else FIELD_CMAP), ends)
    if contours:
        lines = [
            line
            for value in np.linspace(*ends, CONTOURS + 2)[1:-1]
            for line in contour_lines(shape, grid, float(value))
        ]
        drawn = LineCollection(lines, colors="white", linewidths=0.5, alpha=0.75)
        ax.add_collection(drawn)
        drawn.set_clip_path(image.get_clip_path())
    return image


def draw_outline(shape: Shape, ax: Axes, *, colour: str = INK, width: float = 1.0) -> LineCollection:
    """Draw the boundary of a two-dimensional shape, where its cuts lie.

    Parameters
    ----------
    shape
        A two-dimensional shape.
    ax
        Axis to draw on; its limits become those of the shape's grid.
    colour, width
        Of the line; the width in points.

    Raises
    ------
    ShapeError
        If the shape is not two-dimensional.

    Examples
    --------
    >>> from spem.plots.style import new_figure
    >>> from spem.shapes.shape import Shape
    >>> ax = new_figure(2, 2).add_subplot()
    >>> len(draw_outline(Shape.from_mask(np.ones((4, 4))), ax).get_paths())
    1
    """
    require_dimension(shape, 2, "an outline")
    lines = LineCollection(
        contour_lines(shape, surface_level(shape)),
        colors=colour,
        linewidths=width,
        capstyle="round",
    )
    ax.add_collection(lines)
    frame(shape, ax)
    return lines


def draw_slice(
    shape: Shape,
    values: ArrayLike,
    ax: Axes,
    *,
    axis: int,
    index: int | None = None,
    symmetric: bool = False,
    limits: tuple[float, float] | None = None,
) -> AxesImage:
    """Draw the node values on one plane of voxels of a three-dimensional shape.

    Parameters
    ----------
    shape
        A three-dimensional shape.
    values
        ``(n_nodes,)`` one value a node.
    ax
        Axis to draw on.
    axis
        Axis across the plane, 0, 1 or 2; the first of the other two goes down.
    index
        Position of the plane on the grid; that of the median node by default.
    symmetric, limits
        As in `draw_values`; limits are those of the whole shape by default.

    Raises
    ------
    ShapeError
        If the shape is not three-dimensional.
    ParameterError
        If there is no such plane.

    Examples
    --------
    >>> from spem.plots.style import new_figure
    >>> from spem.shapes.shape import Shape
    >>> ax = new_figure(2, 2).add_subplot()
    >>> draw_slice(Shape.from_mask(np.ones((3, 3, 3))), np.ones(27), ax, axis=0).get_array().shape
    (5, 5)
    """
    require_dimension(shape, 3, "a slice")
    nodal = node_values(shape, values)
    if axis not in (0, 1, 2):
        msg = f"{shape.name}: axis must be 0, 1 or 2, not {axis}"
        raise ParameterError(msg)
    if index is None:
        index = int(np.median(np.unravel_index(shape.voxels, shape.mask.shape)[axis]))
    if not 0 <= index < shape.mask.shape[axis]:
        msg = f"{shape.name}: axis {axis} has planes 0 to {shape.mask.shape[axis] - 1}, not {index}"
        raise ParameterError(msg)
    down, right = (a for a in range(3) if a != axis)
    level = surface_level(shape)
    grid, cut = (np.take(a, index, axis=axis) for a in (extend_values(shape, nodal, level), level))
    ends = limits or value_limits(nodal, symmetric=symmetric)
    return _draw_grid(shape, grid, cut, (down, right), ax, MAP_CMAP if symmetric else FIELD_CMAP, ends)


def draw_line(shape: Shape, values: ArrayLike, ax: Axes, *, colour: str = COLOURS[0]) -> Line2D:
    """Draw node values of a one-dimensional shape as a curve, broken where the shape is.

    Parameters
    ----------
    shape
        A one-dimensional shape.
    values
        ``(n_nodes,)`` one value a node.
    ax
        Axis to draw on.
    colour
        Of the curve.

    Raises
    ------
    ShapeError
        If the shape is not one-dimensional.

    Examples
    --------
    >>> from spem.plots.style import new_figure
    >>> from spem.shapes.shape import Shape
    >>> ax = new_figure(2, 2).add_subplot()
    >>> draw_line(Shape.from_mask([1, 1, 1]), [1, 2, 1], ax).get_ydata().tolist()
    [nan, 1.0, 2.0, 1.0, nan]
    """
    require_dimension(shape, 1, "a curve over positions")
    grid = shape.to_grid(node_values(shape, values))
    position = shape.origin[0] + shape.spacing[0] * np.arange(grid.size)
    framed(ax, "position", "")
    return ax.plot(position, grid, color=colour, linewidth=1.4)[0]


def _draw_grid(
    shape: Shape,
    grid: NDArray[np.float64],
    level: NDArray[np.float64],
    axes: tuple[int, int],
    ax: Axes,
    cmap: str | Colormap,
    limits: tuple[float, float],
) -> AxesImage:
    """Draw a plane of the grid with its first axis down, as far as its level is positive."""
    low, high = limits
    image = ax.imshow(
        grid,
        cmap=cmap,
        vmin=low,
        vmax=high,
        extent=extent(shape, axes),
        interpolation="bilinear",
        aspect="equal",
    )
    clip_to(image, ax, contour_lines(shape, level, 0.0, axes))
    bare(ax)
    return image
