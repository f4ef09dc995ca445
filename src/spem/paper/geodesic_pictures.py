"""Pictures of single-source fields beside shortest ways (3.2)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from numpy.typing import NDArray

from spem.fields.isocontours import iso_contours
from spem.paper.geodesics import Way, difference
from spem.plots.fields import draw_outline, draw_values
from spem.plots.style import COLOURS, INK, MARKERS, MUTED, TEXT_SIZE, bare, framed, new_figure

Array = NDArray[np.float64]
_RINGS = 12
# Where ρ = ∞ stands on an axis of ρ, over the largest finite one.
_BEYOND = 1.8


def figure_angles(way: Way, rho: float, angles: Sequence[tuple[str, Array]]) -> Figure:
    """Draw lengths of shortest ways and −ρ log v, then the angles between gradients and ways."""
    height, width = way.shape.mask.shape
    panel = 2.3
    figure = new_figure(panel * (len(angles) + 1) + 0.8, panel * height / width + 0.5)
    first, *rest = figure.subplots(1, len(angles) + 1)
    _draw_rings(first, way, rho)
    for ax, (title, angle) in zip(rest, angles, strict=True):
        image = draw_values(way.shape, angle, ax, limits=(0.0, 90.0))
        draw_outline(way.shape, ax, width=0.8)
        bare(ax, title)
    bar = figure.colorbar(image, ax=rest, shrink=0.8, pad=0.01, extend="max")
    bar.set_label("angle between −∇v and the shortest way, degrees", size=TEXT_SIZE)
    bar.set_ticks([0, 30, 60, 90])
    bar.ax.tick_params(labelsize=TEXT_SIZE - 1)
    return figure


def figure_rates(shares: Array, mean: Mapping[str, Array], angle: Mapping[str, Array]) -> Figure:
    """Draw mean differences by ρ, and the median and ninth tenth of the angles, with those for ρ = ∞."""
    figure = new_figure(8.5, 3.4)
    left, right = figure.subplots(1, 2)
    for k, (name, values) in enumerate(mean.items()):
        left.loglog(shares, values, marker=MARKERS[k], markersize=3, color=COLOURS[k], label=name)
        median, tenths = angle[name].T
        for line, style, what in ((median, "-", "median"), (tenths, "--", "nine tenths")):
            right.semilogx(shares, line[1:], style, marker=MARKERS[k], markersize=3, color=COLOURS[k])
            right.plot([], [], style, color=COLOURS[k], label=f"{name}, {what}")
            right.plot(shares[0] * _BEYOND, line[0], marker=MARKERS[k], markersize=4, color=COLOURS[k])
    last = float(np.mean([values[-1] for values in mean.values()]))
    left.loglog(shares, last * shares / shares[-1], color=MUTED, linestyle=":", label="∝ ρ")
    framed(left, "ρ / inner radius", "mean difference / longest way")
    framed(right, "ρ / inner radius", "angle, degrees")
    ticks = [f"{share:.2g}" for share in shares]
    left.set_xticks(shares, ticks)
    right.set_xticks([*shares, shares[0] * _BEYOND], [*ticks, "∞"])
    right.set_ylim(0, 90)
    for ax in (left, right):
        ax.minorticks_off()
        ax.legend(fontsize=TEXT_SIZE - 1, frameon=False)
    return figure


def _draw_rings(ax: Axes, way: Way, rho: float) -> None:
    """Draw curves of equal distance from the source, and of −ρ log v at the same values."""
    draw_outline(way.shape, ax, width=0.8)
    levels = np.linspace(0.0, way.longest, _RINGS + 2)[1:-1]
    screened = way.distance + way.longest * difference(way, rho)
    for values, colour, name in ((way.distance, INK, "shortest way"), (screened, COLOURS[1], "−ρ log v")):
        lines = [line[:, ::-1] for level in iso_contours(way.shape, values, levels) for line in level]
        ax.add_collection(LineCollection(lines, colors=colour, linewidths=0.9, label=name))
    position = way.sources.position[0]
    ax.plot(position[1], position[0], "o", color=COLOURS[0], markersize=5)
    bare(ax, f"equal distance, ρ = {rho:.3g} voxels")
    ax.legend(fontsize=TEXT_SIZE - 1, frameon=False, loc="upper center", bbox_to_anchor=(0.5, 0.0), ncols=2)
