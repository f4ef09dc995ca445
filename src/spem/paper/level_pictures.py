"""Pictures of the level curves of a shape over ρ, and of how smooth they are (2.1)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.collections import LineCollection
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from numpy.typing import NDArray

from spem.fields.isocontours import iso_contours
from spem.plots.fields import draw_outline
from spem.plots.style import COLOURS, DASHES, FIELD_CMAP, MARKERS, MUTED, TEXT_SIZE, bare, framed, new_figure
from spem.shapes.shape import Shape

Array = NDArray[np.float64]
# The brightest end of the colours is too faint as a line on white.
_FAINT = 1.15


def figure_family(shape: Shape, limit: Array, fields: Mapping[float, Array], levels: Array) -> Figure:
    """Draw the level curves of a field for each ρ, after those of minus the distance to the boundary."""
    columns = (len(fields) + 2) // 2
    height, width = shape.mask.shape
    figure = new_figure(2.5 * columns + 0.6, 5.0 * min(height / width, 1.5) + 0.5)
    axes = figure.subplots(2, columns).ravel()
    for ax in axes:
        ax.set_axis_off()
    depths = np.linspace(limit.min(), 0.0, len(levels) + 1, endpoint=False)[1:]
    _draw(axes[0], shape, limit, depths, "distance")
    for ax, (rho, values) in zip(axes[1:], fields.items(), strict=False):
        image = _draw(ax, shape, values, levels, f"ρ = {rho:g}", Normalize(0.0, _FAINT))
    image.set_clim(0.0, _FAINT)
    bar = figure.colorbar(
        image, ax=axes, fraction=0.03, pad=0.01, shrink=0.8, boundaries=np.linspace(0, 1, 101)
    )
    bar.set_ticks([0.0, 0.2, 0.4, 0.6, 0.8, 1.0])
    bar.set_label("v", size=TEXT_SIZE)
    bar.ax.tick_params(labelsize=TEXT_SIZE - 1)
    return figure


def figure_smoothing(
    missed: tuple[Sequence[float], Mapping[str, Array]],
    by_level: tuple[Array, Array],
    by_area: tuple[Array, Array],
    rho: Sequence[float],
) -> Figure:
    """Draw what (2.1) leaves out by ρ, and the turns of level curves by v and by area."""
    figure = new_figure(10.5, 3.2)
    left, middle, right = figure.subplots(1, 3)
    _draw_missed(left, *missed)
    levels, turns = by_level
    for k, values in enumerate(turns):
        middle.plot(
            levels, values, marker=MARKERS[k], markersize=3, color=COLOURS[k], label=f"ρ = {rho[k]:g}"
        )
    areas, turns = by_area
    right.plot(areas, turns[0], color=MUTED, linestyle="--", label="distance")
    for k, values in enumerate(turns[1:]):
        right.plot(areas, values, marker=MARKERS[k], markersize=3, color=COLOURS[k], label=f"ρ = {rho[k]:g}")
    framed(middle, "level v", "total curvature / 2π")
    framed(right, "share of the shape within the curve", "total curvature / 2π")
    for ax in (middle, right):
        ax.set_yscale("log")
        ax.set_yticks([1, 2, 5, 10, 20], ["1", "2", "5", "10", "20"])
        ax.minorticks_off()
        ax.invert_xaxis()
    right.legend(fontsize=TEXT_SIZE - 1, frameon=False)
    return figure


def _draw_missed(ax: Axes, shares: Sequence[float], missed: Mapping[str, Array]) -> None:
    """Draw the share of v that (2.1) leaves out, with its term of curvature and without."""
    x = np.asarray(shares)
    for k, (name, values) in enumerate(missed.items()):
        ax.loglog(x, values[:, 0], marker=MARKERS[k], markersize=3, color=COLOURS[k], label=name)
        ax.loglog(x, values[:, 1], color=COLOURS[k], linestyle=DASHES[1], linewidth=0.9)
    first = next(iter(missed.values()))
    for column, power in enumerate((2, 1)):
        line = first[-1, column] * (x / x[-1]) ** power
        ax.loglog(x, line, color=MUTED, linestyle=":", linewidth=1.0, label="" if column else "∝ ρ², ∝ ρ")
    framed(ax, "ρ / inner radius", "share of v left out by (2.1)\n(dashed: without curvature)")
    ax.set_xticks(x, [f"{value:g}" for value in x])
    ax.minorticks_off()
    ax.legend(fontsize=TEXT_SIZE - 1, frameon=False)


def _draw(
    ax: Axes, shape: Shape, values: Array, levels: Array, title: str, norm: Normalize | None = None
) -> ScalarMappable:
    """Draw the outline and level curves of one field, coloured by level."""
    draw_outline(shape, ax, width=0.8)
    colour = ScalarMappable(norm or Normalize(levels.min(), -0.1 * levels.min()), colormaps[FIELD_CMAP])
    for level, lines in zip(levels, iso_contours(shape, values, levels), strict=True):
        # plots have columns to the right and rows downward
        ax.add_collection(
            LineCollection([line[:, ::-1] for line in lines], colors=[colour.to_rgba(level)], linewidths=0.8)
        )
    bare(ax, title)
    return colour
