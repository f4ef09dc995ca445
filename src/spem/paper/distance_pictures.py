"""Pictures of −ρ log v beside the distance that it tends to (3.2)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from spem.paper.distance import Case
from spem.plots.fields import draw_outline, draw_values
from spem.plots.style import (
    COLOURS,
    DASHES,
    INK,
    MARKERS,
    MUTED,
    TEXT_SIZE,
    bare,
    framed,
    new_figure,
)

Array = NDArray[np.float64]
# Ends of the colours, in units of ρ: log 2 on the skeleton is well inside.
_ENDS = (-1.5, 1.5)


def figure_errors(shares: Array, mean: Mapping[str, Array], disk: Case, error: Array) -> Figure:
    """Draw mean errors by ρ, and −ρ log v along the radius of a disk."""
    figure = new_figure(8.5, 3.6)
    left, right = figure.subplots(1, 2)
    for k, (name, values) in enumerate(mean.items()):
        left.loglog(shares, values, marker=MARKERS[k], markersize=3, color=COLOURS[k], label=name)
    middle = float(np.exp(np.mean([np.log(values[-1]) for values in mean.values()])))
    left.loglog(shares, middle * shares / shares[-1], color=MUTED, linestyle=":", label="∝ ρ")
    framed(left, "ρ / inner radius", "mean error / inner radius")
    left.set_xticks(shares, [f"{share:.2g}" for share in shares])
    left.minorticks_off()
    left.legend(fontsize=TEXT_SIZE - 1, frameon=False)
    depth = disk.distance / disk.radius
    order = np.argsort(depth)
    right.plot([0, 1], [0, 1], color=INK, linewidth=1.0, label="distance")
    for k in range(0, len(shares), 2):
        right.plot(
            depth[order],
            (depth + error[k])[order],
            color=COLOURS[k // 2],
            linestyle=DASHES[k // 2],
            label=f"ρ = {shares[k]:.2g} R",
        )
        grid = np.linspace(0.0, 0.97, 100)
        right.plot(
            grid, grid + shares[k] / 2 * np.log(1 - grid), color=COLOURS[k // 2], linestyle=":", linewidth=0.9
        )
    framed(right, "distance to the boundary / R", "−ρ log v / R, on a disk")
    right.set_ylim(0, 1)
    right.legend(fontsize=TEXT_SIZE - 1, frameon=False)
    return figure


def figure_where(cases: Sequence[Case], errors: Sequence[Array], shares: Array) -> Figure:
    """Draw (−ρ log v − d)/ρ on silhouettes, for the largest, a middle and the smallest ρ."""
    columns = (0, len(shares) // 2, len(shares) - 1)
    heights = [case.shape.mask.shape[0] / case.shape.mask.shape[1] for case in cases]
    figure = new_figure(8.0, 2.4 * sum(heights) + 0.3)
    axes = figure.subplots(len(cases), 3, squeeze=False, height_ratios=heights)
    for row, case, error in zip(axes, cases, errors, strict=True):
        for ax, k in zip(row, columns, strict=True):
            image = draw_values(case.shape, error[k] / shares[k], ax, symmetric=True, limits=_ENDS)
            draw_outline(case.shape, ax, width=0.8)
            bare(ax, f"ρ = {shares[k] * case.radius:.3g} voxels")
    bar = figure.colorbar(image, ax=axes, shrink=0.6, pad=0.01, extend="both")
    bar.set_label("(−ρ log v − d) / ρ", size=TEXT_SIZE)
    bar.ax.tick_params(labelsize=TEXT_SIZE - 1)
    return figure
