"""Lines of equal value, arrows and streamlines of fields on silhouettes."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.collections import LineCollection
from scipy.ndimage import binary_dilation, map_coordinates

from spem.errors import ParameterError
from spem.fields.isocontours import equal_levels
from spem.plots.extension import extend_values
from spem.plots.level import surface_level
from spem.plots.plane import clip_to, contour_lines, frame, require_dimension
from spem.plots.style import COLOURS, FIELD_CMAP
from spem.plots.values import node_values, value_limits

if TYPE_CHECKING:
    from collections.abc import Iterable

    from matplotlib.axes import Axes
    from matplotlib.colors import Colormap
    from matplotlib.lines import Line2D
    from matplotlib.quiver import Quiver
    from numpy.typing import ArrayLike, NDArray

    from spem.shapes.shape import Shape

    Window = tuple[tuple[float, float], tuple[float, float]]

LEVELS = 24
# Voxels below the outline where lines of log v end: nearer, they would come and go with the cuts.
CLEARANCE = 1.0
# Length of an arrow, in the distance between arrows.
ARROW = 0.8


def draw_contours(
    shape: Shape,
    values: ArrayLike,
    ax: Axes,
    *,
    levels: int | ArrayLike = LEVELS,
    cmap: str | Colormap = FIELD_CMAP,
    limits: tuple[float, float] | None = None,
    width: float = 0.8,
    margin: float = 0.0,
) -> LineCollection:
    """Draw lines of equal value on a two-dimensional shape, each in its colour, up to the outline.

    Parameters
    ----------
    shape
        A two-dimensional shape.
    values
        ``(n_nodes,)`` one value a node; -inf stands below all others.
    ax
        Axis to draw on; its limits become those of the shape's grid.
    levels
        Values of the lines, or their number at equal steps.
    cmap
        Colour map.
    limits
        Values at its ends; by default the least and greatest finite value.
    width
        Of the lines, in points.
    margin
        Voxels below the outline where lines end. Those of log v run on along the boundary where v is 0,
        closer than the grid can tell.

    Raises
    ------
    ShapeError
        If the shape is not two-dimensional.
    ParameterError
        If there is not one value for each node, or no level.

    Examples
    --------
    >>> from spem.plots.style import new_figure
    >>> from spem.shapes.shape import Shape
    >>> ax = new_figure(2, 2).add_subplot()
    >>> shape = Shape.from_mask(np.ones((3, 4)))
    >>> len(draw_contours(shape, shape.points[:, 1], ax, levels=5).get_paths())
    5
    """
    require_dimension(shape, 2, "a line of equal value")
    nodal = node_values(shape, values)
    steps = equal_levels(nodal, levels) if isinstance(levels, int) else np.ravel(np.asarray(levels))
    low, high = limits or value_limits(nodal, symmetric=False)
    surface = surface_level(shape)
    grid = extend_values(shape, np.maximum(nodal, min(low, float(steps.min()) - 1)), surface)
    # Farther out than interpolation reaches, values mean nothing.
    grid[~binary_dilation(shape.mask, np.ones((3, 3)))] = np.nan
    traced = [
        (piece, value)
        for value in steps
        for line in contour_lines(shape, grid, float(value))
        for piece in (_below(shape, line, surface, margin) if margin else [line])
    ]
    drawn = LineCollection([line for line, _ in traced], cmap=cmap, linewidths=width)
    drawn.set_array(np.array([value for _, value in traced]))
    drawn.set_clim(low, high)
    ax.add_collection(drawn)
    clip_to(drawn, ax, contour_lines(shape, surface))
    frame(shape, ax)
    return drawn


def _below(
    shape: Shape, line: NDArray[np.float64], surface: NDArray[np.float64], margin: float
) -> list[NDArray[np.float64]]:
    """Pieces of a line (x, y) that lie deeper than a margin."""
    index = (line[:, ::-1] - np.asarray(shape.origin)) / np.asarray(shape.spacing)
    deep = map_coordinates(surface, index.T, order=1) > margin
    pieces = np.split(line, np.flatnonzero(np.diff(deep)) + 1)
    return [piece for piece in pieces[0 if deep[0] else 1 :: 2] if len(piece) > 1]


def draw_directions(
    shape: Shape,
    vectors: ArrayLike,
    ax: Axes,
    *,
    window: Window | None = None,
    every: int = 1,
    colour: str = COLOURS[0],
) -> Quiver:
    """Draw an arrow at the nodes of a two-dimensional shape, as long as its vector (Fig. 5b).

    Parameters
    ----------
    shape
        A two-dimensional shape.
    vectors
        ``(n_nodes, 2)`` vectors, of length one or less: `spem.fields.gradients.unit_vectors` makes them so.
    ax
        Axis to draw on; its limits become the window.
    window
        Ends of the part to draw along each axis, in the shape's own coordinates; all by default.
    every
        Draw one node in this many along each axis.
    colour
        Of the arrows.

    Raises
    ------
    ShapeError
        If the shape is not two-dimensional.
    ParameterError
        If there is not one vector for each node, or the window holds no node.

    Examples
    --------
    >>> from spem.plots.style import new_figure
    >>> from spem.shapes.shape import Shape
    >>> ax = new_figure(2, 2).add_subplot()
    >>> draw_directions(Shape.from_mask(np.ones((3, 4))), np.ones((12, 2)), ax).N
    12
    """
    require_dimension(shape, 2, "a field of arrows")
    arrows = np.asarray(vectors, np.float64)
    if arrows.shape != (shape.n_nodes, 2):
        msg = f"{shape.name}: vectors must be ({shape.n_nodes}, 2), one a node, not {arrows.shape}"
        raise ParameterError(msg)
    points = shape.points
    low, high = (-np.inf, np.inf) if window is None else np.transpose(window)
    index = np.stack(np.unravel_index(shape.voxels, shape.mask.shape), axis=1)
    chosen = ((points >= low) & (points <= high) & (index % every == 0)).all(axis=1)
    if not chosen.any():
        msg = f"{shape.name}: no node of every {every} lies in the window {window}"
        raise ParameterError(msg)
    (y, x), (down, right) = points[chosen].T, arrows[chosen].T
    length = ARROW * every * min(shape.spacing)
    drawn = ax.quiver(
        x,
        y,
        right,
        down,
        angles="xy",
        scale_units="xy",
        scale=1 / length,
        pivot="mid",
        color=colour,
        units="xy",
    )
    drawn.width = 0.12 * length
    frame(shape, ax)
    if window is not None:
        (top, bottom), (left, rim) = window
        ax.set(xlim=(left, rim), ylim=(bottom, top))
    return drawn


def draw_streamlines(
    shape: Shape,
    lines: Iterable[NDArray[np.float64]],
    ax: Axes,
    *,
    colour: str = COLOURS[0],
    width: float = 0.7,
) -> LineCollection:
    """Draw streamlines of a two-dimensional shape (Fig. 5c).

    Parameters
    ----------
    shape
        A two-dimensional shape.
    lines
        `spem.fields.streamlines.Streamlines`, or polylines ``(k, 2)`` in the shape's own coordinates.
    ax
        Axis to draw on; its limits become those of the shape's grid.
    colour, width
        Of the lines; the width in points.

    Raises
    ------
    ShapeError
        If the shape is not two-dimensional.

    Examples
    --------
    >>> from spem.plots.style import new_figure
    >>> from spem.shapes.shape import Shape
    >>> ax = new_figure(2, 2).add_subplot()
    >>> len(draw_streamlines(Shape.from_mask(np.ones((2, 2))), [np.zeros((3, 2))], ax).get_paths())
    1
    """
    require_dimension(shape, 2, "a streamline")
    drawn = LineCollection(
        [line[:, ::-1] for line in lines],
        colors=colour,
        linewidths=width,
        capstyle="round",
        joinstyle="round",
    )
    ax.add_collection(drawn)
    frame(shape, ax)
    return drawn


def mark_source(position: ArrayLike, ax: Axes) -> Line2D:
    """Mark where a source of a two-dimensional shape is.

    Parameters
    ----------
    position
        ``(2,)`` coordinates, in the shape's own.
    ax
        Axis to draw on.

    Examples
    --------
    >>> from spem.plots.style import new_figure
    >>> mark_source([1.0, 2.0], new_figure(2, 2).add_subplot()).get_xdata()
    array([2.])
    """
    y, x = np.asarray(position, np.float64)
    return ax.plot(
        [x],
        [y],
        "o",
        markersize=4.5,
        color=COLOURS[1],
        markeredgecolor="white",
        markeredgewidth=0.7,
        zorder=5,
        clip_on=False,
    )[0]
