"""Stacks of fields seen at an angle: the schematic of the hyperfield (Fig. 6)."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.collections import LineCollection
from matplotlib.patches import PathPatch
from matplotlib.path import Path
from matplotlib.transforms import Affine2D

from spem.errors import ParameterError
from spem.plots.extension import extend_values
from spem.plots.level import surface_level
from spem.plots.plane import contour_lines, extent, require_dimension
from spem.plots.style import FIELD_CMAP, INK, TEXT_SIZE, bare
from spem.plots.values import node_columns

if TYPE_CHECKING:
    from collections.abc import Sequence

    from matplotlib.axes import Axes
    from matplotlib.transforms import Transform
    from numpy.typing import ArrayLike, NDArray

    from spem.shapes.shape import Shape

# How slices lie: their height over that of the upright picture, and how far the far side is to the right.
SQUEEZE, SHEAR = 0.42, 0.45
# From slice to slice, in heights of a slice.
STEP = 1.02
# Lines of equal value on a slice.
LINES = 7
# Colour of the edge of a slice.
RIM = "#b9bfc6"


def draw_stack(
    shape: Shape,
    values: ArrayLike,
    ax: Axes,
    words: Sequence[str],
    *,
    limits: tuple[float, float] = (0.0, 1.0),
    title: str = "",
) -> None:
    """Draw fields of a two-dimensional shape as slices that lie above each other, the first at the bottom.

    Parameters
    ----------
    shape
        A two-dimensional shape.
    values
        ``(n_nodes, n_fields)`` fields.
    ax
        Axis to draw on.
    words
        A word for each slice, to its left.
    limits
        Values at the ends of the colour map; what lies beyond has the colour of the end.
    title
        What the stack is.

    Raises
    ------
    ShapeError
        If the shape is not two-dimensional.
    ParameterError
        If there is not one word for each field.

    Examples
    --------
    >>> from spem.plots.style import new_figure
    >>> from spem.shapes.shape import Shape
    >>> ax = new_figure(2, 3).add_subplot()
    >>> draw_stack(Shape.from_mask(np.ones((3, 4))), np.ones((12, 2)), ax, ["ρ₁", "ρ₂"])
    >>> len(ax.images)
    2
    """
    require_dimension(shape, 2, "a stack of slices")
    fields = node_columns(shape, values)
    if len(words) != fields.shape[1]:
        msg = f"{fields.shape[1]} slices need as many words, not {len(words)}"
        raise ParameterError(msg)
    left, right, bottom, top = extent(shape)
    lift = STEP * SQUEEZE * (bottom - top)
    for k, (column, word) in enumerate(zip(fields.T, words, strict=True)):
        # Down the picture is toward the viewer; upward in the stack is less of y.
        tilt = Affine2D.from_values(1, 0, -SHEAR, SQUEEZE, SHEAR * bottom, -lift * k)
        frame = tilt.transform([(left, top), (right, top), (right, bottom), (left, bottom)])
        ax.fill(*frame.T, facecolor="white", edgecolor=RIM, linewidth=0.6, alpha=0.82, zorder=k)
        _draw_slice(shape, column, ax, tilt + ax.transData, limits, k)
        x, y = frame[3]
        ax.text(x - 0.02 * (right - left), y, word, ha="right", va="bottom", fontsize=TEXT_SIZE)
    bare(ax, title)
    wide = right - left + SHEAR * (bottom - top)
    height = lift * (fields.shape[1] - 1) + SQUEEZE * (bottom - top)
    ax.set(
        xlim=(left - 0.25 * wide, left + 1.02 * wide),
        ylim=(SQUEEZE * bottom + 0.02 * height, SQUEEZE * bottom - 1.02 * height),
    )
    ax.set_aspect("equal")


def _draw_slice(
    shape: Shape,
    values: NDArray[np.float64],
    ax: Axes,
    where: Transform,
    limits: tuple[float, float],
    order: int,
) -> None:
    """Draw one field with its lines of equal value and its outline, above the slices of lower order."""
    level = surface_level(shape)
    grid = extend_values(shape, values, level)
    outline = Path.make_compound_path(*[Path(line) for line in contour_lines(shape, level)])
    image = ax.imshow(
        grid,
        cmap=FIELD_CMAP,
        vmin=limits[0],
        vmax=limits[1],
        extent=extent(shape),
        interpolation="bilinear",
        transform=where,
        zorder=order + 0.2,
    )
    steps = np.linspace(*limits, LINES + 2)[1:-1]
    traced = [line for step in steps for line in contour_lines(shape, grid, float(step))]
    lines = LineCollection(traced, colors="white", linewidths=0.4, alpha=0.75, transform=where)
    lines.set_zorder(order + 0.3)
    ax.add_collection(lines, autolim=False)
    for artist in (image, lines):
        artist.set_clip_path(outline, where)
    rim = PathPatch(outline, fill=False, edgecolor=INK, linewidth=0.6, transform=where, zorder=order + 0.4)
    ax.add_patch(rim)
