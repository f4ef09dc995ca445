"""The pictures of `how it works` that no other page has, drawn at the build from shapes made here."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle
from sphinx.application import Sphinx

import spem
from spem.codes.features import node_features, sweep_bands
from spem.codes.vocabulary import nearest_centers
from spem.plots.fields import draw_outline
from spem.plots.sources import figure_superposition
from spem.plots.style import COLOURS, INK, MUTED, bare, framed, new_figure, part_colours

_DPI = 130


def setup(app: Sphinx) -> dict[str, Any]:
    """Draw before pages are read."""
    app.connect("config-inited", lambda app, config: draw(Path(app.srcdir) / "drawn"))
    return {"parallel_read_safe": True, "parallel_write_safe": True}


def draw(folder: Path) -> None:
    """Draw every picture that is not there yet, or is older than this file."""
    folder.mkdir(exist_ok=True)
    for name, make in PICTURES.items():
        path = folder / f"{name}.png"
        if not path.is_file() or path.stat().st_mtime < Path(__file__).stat().st_mtime:
            make().savefig(path, dpi=_DPI)


def grid() -> Figure:
    """Draw the nodes of a small disk, and where its boundary cuts the edges between voxels."""
    radius, spacing = 4.4, 1.0
    disk = spem.synthetic.disk(radius=radius, spacing=spacing, offset=0.2)
    figure = new_figure(7.0, 3.4)
    left, right = figure.subplots(1, 2)
    for ax in (left, right):
        _draw_grid(disk, ax, radius)
    left.set_title("the shape on its grid", fontsize=9)
    right.set_title("one corner", fontsize=9)
    right.set_xlim(1.2, 5.4)
    right.set_ylim(5.4, 1.2)
    words = (("node", "o", INK), ("cut", "o", COLOURS[1]))
    for label, marker, colour in words:
        right.plot([], [], marker, color=colour, markersize=5, label=label)
    right.legend(loc="lower right", fontsize=8, framealpha=1.0)
    return figure


def _draw_grid(shape: spem.Shape, ax: Axes, radius: float) -> None:
    """Draw nodes, edges, cuts and the exact circle."""
    points, spacing = shape.points, np.asarray(shape.spacing)
    number = np.full(shape.mask.size, -1)
    number[shape.voxels] = np.arange(shape.n_nodes)
    for axis in range(2):
        stride = int(np.prod(shape.mask.shape[axis + 1 :]))
        start = np.flatnonzero(number[shape.voxels + stride] >= 0)
        end = points[number[shape.voxels[start] + stride]]
        ax.plot(
            *np.stack([points[start], end])[:, :, ::-1].transpose(2, 0, 1), color="#c3cad2", lw=0.8, zorder=1
        )
    along, sign = shape.cuts.direction // 2, 2.0 * (shape.cuts.direction % 2) - 1
    start = points[number[shape.cuts.voxel]]
    end = start.copy()
    end[np.arange(len(end)), along] += sign * shape.cuts.fraction * spacing[along]
    ax.plot(*np.stack([start, end])[:, :, ::-1].transpose(2, 0, 1), color=COLOURS[1], lw=1.0, zorder=2)
    ax.plot(end[:, 1], end[:, 0], "o", color=COLOURS[1], markersize=3, zorder=3)
    ax.plot(points[:, 1], points[:, 0], "o", color=INK, markersize=3, zorder=3)
    ax.add_patch(Circle((0, 0), radius, fill=False, color=MUTED, lw=1.0))
    ax.set_aspect("equal")
    ax.set_xlim(-5.4, 5.4)
    ax.set_ylim(5.4, -5.4)
    ax.axis("off")


def curves() -> Figure:
    """Draw the field of an interval for four ρ, beside its closed form."""
    line = spem.synthetic.interval(length=10.0, spacing=0.25)
    x = line.points[:, 0] - line.points[:, 0].mean()
    fine = np.linspace(-5, 5, 401)
    figure = new_figure(5.6, 2.9)
    ax = figure.subplots()
    for colour, rho in zip(COLOURS, (0.5, 1.0, 2.0, 5.0), strict=False):
        ax.plot(fine, np.cosh(fine / rho) / np.cosh(5 / rho), color=colour, lw=1.3, label=f"ρ = {rho:g}")
        ax.plot(x, spem.field(line, rho), "o", color=colour, markersize=2.4)
    framed(ax, "position", "v")
    ax.set_ylim(0, 1.03)
    figure.legend(loc="outside right center", fontsize=8, frameon=False)
    return figure


def superposition() -> Figure:
    """Draw the fields of both ends of an interval, and their sum, for two ρ."""
    sources = spem.sources(spem.synthetic.interval(length=10.0, spacing=0.1))
    return figure_superposition([spem.source_fields(sources, rho) for rho in (1.0, 4.0)])


def words() -> Figure:
    """Draw the nodes of four creatures in the colour of the word that they are nearest to."""
    rng = np.random.default_rng(3)
    kinds = ("hand", "hand", "fish", "fish")
    shapes = [spem.creatures.creature(kind, voxels=5000, rng=rng) for kind in kinds]
    [part] = spem.encode(shapes, features="spem", n_centers=8, voxels=5000).model.parts
    figure = new_figure(8.0, 2.4)
    for ax, shape, kind in zip(figure.subplots(1, 4), shapes, kinds, strict=True):
        [maps] = node_features(sweep_bands(shape, part.settings), part.settings)
        nearest = nearest_centers(part.normalisations[0].apply(maps), part.centers[0])
        picture = np.ones((*shape.mask.shape, 3))
        picture[shape.mask] = part_colours(nearest)[:, :3]
        rows, columns = shape.axes
        half = shape.spacing[0] / 2
        ax.imshow(picture, extent=(columns[0] - half, columns[-1] + half, rows[-1] + half, rows[0] - half))
        draw_outline(shape, ax, width=0.8)
        bare(ax, kind)
    return figure


PICTURES: dict[str, Callable[[], Figure]] = {
    "grid": grid,
    "curves": curves,
    "superposition": superposition,
    "words": words,
}
