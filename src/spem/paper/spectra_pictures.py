"""Pictures of SPEM beside heat and wave signatures: on a shape, and what codes of them score (3.3)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.cm import ScalarMappable

from spem.paper.findings import Table
from spem.plots.camera import picture_aspect
from spem.plots.fields import draw_outline, draw_values
from spem.plots.style import COLOURS, FIELD_CMAP, MARKERS, TEXT_SIZE, TITLE_SIZE, bare, framed, new_figure
from spem.retrieval.evaluation import MEASURES

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from numpy.typing import NDArray

    from spem.paper.spectra import KindScores
    from spem.shapes.shape import Shape

NAMES = {"spem": "SPEM", "hks": "HKS", "si-hks": "SI-HKS", "wks": "WKS"}
_PANEL = 1.25


def figure_features(
    shape: Shape, rows: Mapping[str, NDArray[np.floating]], titles: Mapping[str, Sequence[str]]
) -> Figure:
    """Return a figure with a kind a row and a feature a column, each on its own scale.

    Parameters
    ----------
    shape
        A two-dimensional shape.
    rows
        Kind → ``(n_nodes, n_columns)`` features.
    titles
        Kind → what each column is.

    Examples
    --------
    >>> from spem.shapes.shape import Shape
    >>> square = Shape.from_mask(np.ones((3, 3)))
    >>> figure = figure_features(square, {"wks": np.ones((9, 2))}, {"wks": ["a", "b"]})
    >>> len(figure.axes)
    3
    """
    columns = max(values.shape[1] for values in rows.values())
    height = _PANEL * min(picture_aspect(shape), 1.6) + 0.2
    figure = new_figure(columns * _PANEL + 0.6, len(rows) * height + 0.1)
    axes = figure.subplots(len(rows), columns, squeeze=False)
    for (kind, values), panels in zip(rows.items(), axes, strict=True):
        for j, ax in enumerate(panels):
            # a few nodes at the tips would take most of the colours
            low, high = np.quantile(values[:, j], [0.01, 0.99])
            high = high if high > low else low + 1.0
            draw_values(shape, values[:, j], ax, cmap=FIELD_CMAP, limits=(float(low), float(high)))
            draw_outline(shape, ax, width=0.5)
            bare(ax)
            ax.set_title(titles[kind][j], fontsize=TITLE_SIZE)
        panels[0].set_axis_on()
        panels[0].set(xticks=[], yticks=[])
        panels[0].spines[:].set_visible(False)
        panels[0].set_ylabel(NAMES.get(kind, kind), fontsize=TITLE_SIZE)
    bar = figure.colorbar(ScalarMappable(cmap=FIELD_CMAP), ax=list(axes.ravel()), shrink=0.4, aspect=25)
    bar.set_ticks([0, 1], labels=["least", "most"])
    bar.ax.tick_params(labelsize=TEXT_SIZE, length=0)
    return figure


def figure_scores(found: Sequence[KindScores]) -> Figure:
    """Return a figure with a row a collection: measures of each kind, and FT over the number of features."""
    figure = new_figure(7.6, 2.4 * len(found) + 0.4)
    axes = figure.subplots(len(found), 2, squeeze=False, width_ratios=[2.0, 1.0])
    for each, (bars, curves) in zip(found, axes, strict=True):
        width = 0.8 / len(each.rows)
        for k, (kind, row) in enumerate(each.rows.items()):
            place = np.arange(len(MEASURES)) + (k - (len(each.rows) - 1) / 2) * width
            heights = [row.mean[measure] for measure in MEASURES]
            bars.bar(place, heights, 0.92 * width, color=COLOURS[k], label=NAMES[kind])
            counts, tier = zip(*sorted(each.tiers[kind].items()), strict=True)
            look: dict[str, Any] = {"color": COLOURS[k], "marker": MARKERS[k], "markersize": 4}
            curves.plot(counts, tier, clip_on=False, **look)
        bars.set_xticks(range(len(MEASURES)), list(MEASURES))
        bars.set_ylim(0, 100)
        framed(bars, "", "%")
        bars.set_title(each.collection.name, fontsize=TITLE_SIZE, loc="left")
        curves.set_xticks(counts)
        framed(curves, "features of a node", "FT, %")
    handles, names = axes[0, 0].get_legend_handles_labels()
    figure.legend(handles, names, loc="outside upper right", ncols=4, fontsize=TEXT_SIZE, frameon=False)
    return figure


def table_scores(found: KindScores, seeds: int) -> Table:
    """Return the scores of each kind, with their deviation over seeds."""
    caption = (
        f"{found.collection.name}, {len(found.collection.items)} shapes: scores in percent, means over "
        f"{seeds} vocabularies. The last two columns: standard deviation of FT over these, and its standard "
        "error with another draw of classes."
    )
    rows = [
        (NAMES[kind], *row.row(), f"{row.deviation['FT']:.2f}", f"{row.class_error:.1f}")
        for kind, row in found.rows.items()
    ]
    return Table(caption, ("features", *MEASURES, "FT, seeds", "FT, classes"), tuple(rows))
