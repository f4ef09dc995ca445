"""Pictures of random walks and of their intervals (3.1)."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

import spem
from spem.plots.fields import draw_outline, draw_values
from spem.plots.streams import draw_streamlines
from spem.plots.style import COLOURS, MUTED, framed, new_figure

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from spem.fields.walks.killed import Walk
    from spem.paper.walk import Check


def figure_walks(walk: Walk, rng: np.random.Generator) -> Figure:
    """Draw some walkers on the field of a two-dimensional shape, and how the share of arrivals settles.

    They start at the node of least v.

    Parameters
    ----------
    walk
        A killed walk.
    rng
        Randomness.

    Examples
    --------
    >>> from spem.fields.walks.killed import killed_walk
    >>> from spem.shapes.synthetic import disk
    >>> len(figure_walks(killed_walk(disk(4.0, 1.0), 2.0), np.random.default_rng(0)).axes)
    2
    """
    shape, v = walk.system.shape, spem.field(walk.system.shape, walk.rho)
    start = int(np.argmin(v))
    paths = spem.sample_paths(walk, start, 9, rng)
    figure = new_figure(7.2, 3.4)
    left, right = figure.subplots(1, 2, width_ratios=(1, 1.3))
    draw_values(shape, v, left, cmap="Greys", limits=(0, 2), boundary=1.0)
    draw_outline(shape, left, width=0.8)
    for arrived, colour in ((True, COLOURS[0]), (False, COLOURS[1])):
        draw_streamlines(
            shape, [p.points for p in paths if p.arrived == arrived], left, colour=colour, width=0.6
        )
    lost = np.array([path.points[-1] for path in paths if not path.arrived]).reshape(-1, 2)
    left.plot(lost[:, 1], lost[:, 0], ".", color=COLOURS[1], markersize=5)
    left.plot(*shape.points[start][::-1], "o", color="black", markersize=4)
    left.set_axis_off()
    _draw_settling(walk, start, float(v[start]), right, rng)
    return figure


def figure_intervals(checks: list[Check]) -> Figure:
    """Draw where v lies in each interval, shape by shape.

    Parameters
    ----------
    checks
        Walks on several shapes, each at one share of the size or at several.

    Examples
    --------
    >>> from spem.paper.walk import check_walks
    >>> from spem.shapes.synthetic import ball
    >>> check = check_walks(ball(2.0, 1.0), 0.5, 3, 50, 3, np.random.default_rng(0))
    >>> len(figure_intervals([check]).axes)
    1
    """
    figure = new_figure(7.2, 3.0)
    ax = figure.add_subplot()
    names = list(dict.fromkeys(check.shape.name for check in checks))
    shares = sorted({check.share for check in checks})
    for check in checks:
        alone = check.estimate.alone()
        place = (2 * check.values - alone.lower - alone.upper) / (alone.upper - alone.lower)
        across = names.index(check.shape.name) + np.linspace(-0.35, 0.35, place.size)
        ax.plot(across, place, ".", color=COLOURS[shares.index(check.share)], markersize=3)
    ax.axhspan(-1, 1, color="#eef1f4", zorder=0)
    ax.set(xticks=range(len(names)), xticklabels=names, ylim=(-1.9, 1.9))
    framed(ax, "", "v in its 99 % interval (±1: its ends)")
    for share, colour in zip(shares, COLOURS, strict=False):
        ax.plot([], [], ".", color=colour, label=f"ρ = {share:g} of the size")
    ax.legend(fontsize=7, frameon=False, ncols=2, loc="upper right")
    ax.tick_params(axis="x", rotation=25)
    return figure


def _draw_settling(walk: Walk, start: int, v: float, ax: Axes, rng: np.random.Generator) -> None:
    """Draw the share that arrives of ever more walks, with its interval."""
    counts = [10 * 4**k for k in range(6)]
    found = [spem.estimate_field(walk, nodes=[start], n_walks=n, rng=rng) for n in counts]
    middle = [float(f.mean[0]) for f in found]
    reach = [[m - float(f.lower[0]), float(f.upper[0]) - m] for m, f in zip(middle, found, strict=True)]
    ax.errorbar(counts, middle, np.transpose(reach), fmt="o", color=COLOURS[0], capsize=3, markersize=4)
    ax.axhline(v, color=MUTED, linewidth=0.9, label="v of the solver")
    ax.legend(fontsize=7, frameon=False, loc="upper right")
    ax.set_xscale("log")
    framed(ax, "walks", "share that arrives, with its 99 % interval")
