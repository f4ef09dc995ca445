"""Nodal domains of several silhouettes: a shape a row, a projection a column."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.patches import Patch

from spem.errors import ParameterError
from spem.plots.camera import picture_aspect
from spem.plots.extension import extend_values
from spem.plots.fields import draw_outline
from spem.plots.figures import map_name
from spem.plots.level import surface_level
from spem.plots.map_grid import NAME, TALLEST, WIDTH
from spem.plots.plane import clip_to, contour_lines, require_dimension
from spem.plots.style import TEXT_SIZE, TITLE_SIZE, bare, new_figure

if TYPE_CHECKING:
    from collections.abc import Sequence

    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from numpy.typing import ArrayLike

    from spem.embedding.maps import Maps

# Negative, neither, positive: the ends and the middle of the colours of maps.
DOMAIN_COLOURS = ("#3a77b5", "#eef0f2", "#c8423f")
_LEGEND = 0.3


def figure_domains(
    several: Sequence[Maps],
    thresholds: ArrayLike,
    names: Sequence[str] | None = None,
    *,
    width: float = WIDTH,
) -> Figure:
    """Return a figure of the nodal domains of maps, as Fig. 16 has them.

    Parameters
    ----------
    several
        Maps of silhouettes, with values on the scale of the thresholds.
    thresholds
        ``(n_maps, 2)`` negative and positive threshold of each of the maps to draw.
    names
        A name a row; those of the shapes by default.
    width
        Width of a panel, in inches.

    Raises
    ------
    ParameterError
        If there are no maps, or not a name for each shape.
    ShapeError
        If a shape is not of two dimensions.

    Examples
    --------
    >>> import spem
    >>> maps = spem.maps(spem.synthetic.disk(radius=8.0, spacing=1.0), n_maps=2)
    >>> figure = figure_domains([maps, maps], [[-1.0, 1.0], [-0.5, 0.5]])
    >>> [ax.get_title() for ax in figure.axes]
    ['P₁', 'P₂', '', '']
    """
    limits = np.asarray(thresholds, np.float64)
    titles = [maps.shape.name for maps in several] if names is None else list(names)
    if not several or len(titles) != len(several):
        msg = f"nodal domains: expected a name for each of at least one shape, got {len(titles)} names of "
        msg += f"{len(several)} shapes"
        raise ParameterError(msg)
    heights = [width * min(picture_aspect(maps.shape), TALLEST) for maps in several]
    figure = new_figure(NAME + width * len(limits), sum(heights) + 0.25 + _LEGEND)
    axes = figure.subplots(len(several), len(limits), squeeze=False, height_ratios=heights)
    for i, (maps, row, title) in enumerate(zip(several, axes, titles, strict=True)):
        for j, ax in enumerate(row):
            draw_domains(maps, j, limits[j], ax)
            if i == 0:
                ax.set_title(map_name(j), fontsize=TITLE_SIZE)
        row[0].text(
            -0.04,
            0.5,
            title,
            transform=row[0].transAxes,
            rotation=90,
            ha="right",
            va="center",
            size=TEXT_SIZE,
        )
    words = ("negative domain", "neither", "positive domain")
    keys = [Patch(color=colour, label=word) for colour, word in zip(DOMAIN_COLOURS, words, strict=True)]
    figure.legend(handles=keys, loc="outside lower center", ncols=3, fontsize=TEXT_SIZE, frameon=False)
    return figure


def draw_domains(maps: Maps, j: int, thresholds: ArrayLike, ax: Axes) -> None:
    """Draw the negative and the positive domain of one map, cut where its interpolation crosses.

    Parameters
    ----------
    maps
        Maps of a silhouette.
    j
        Which of them, from zero.
    thresholds
        Negative and positive threshold.
    ax
        Axis to draw on.

    Raises
    ------
    ShapeError
        If the shape is not of two dimensions.

    Examples
    --------
    >>> import spem
    >>> from spem.plots.style import new_figure
    >>> ax = new_figure(2, 2).add_subplot()
    >>> draw_domains(spem.maps(spem.synthetic.disk(radius=8.0, spacing=1.0)), 1, (-0.5, 0.5), ax)
    >>> len(ax.collections) > 0
    True
    """
    shape = maps.shape
    require_dimension(shape, 2, "nodal domains")
    level = surface_level(shape)
    grid = extend_values(shape, maps.values[:, j], level)
    low, high = np.asarray(thresholds, np.float64).tolist()
    rows, columns = shape.axes
    # Equal thresholds leave no room between; levels have to ascend.
    levels = [-np.inf, low, max(high, np.nextafter(low, np.inf)), np.inf]
    filled = ax.contourf(columns, rows, np.nan_to_num(grid), levels, colors=DOMAIN_COLOURS, antialiased=True)
    clip_to(filled, ax, contour_lines(shape, level))
    draw_outline(shape, ax, width=0.6)
    bare(ax)
