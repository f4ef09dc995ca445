"""Logarithms of single-source fields, which show them as deep as they reach."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.colors import ListedColormap

from spem.errors import ParameterError
from spem.fields.isocontours import equal_levels
from spem.plots.camera import picture_aspect, picture_size
from spem.plots.fields import CONTOURS, draw_line, draw_outline, draw_values
from spem.plots.layout import curve_panels, panels, value_bar
from spem.plots.raster import SHARPNESS
from spem.plots.streams import CLEARANCE, draw_contours, mark_source
from spem.plots.style import FIELD_CMAP, TEXT_SIZE, bare
from spem.plots.surfaces import picture_surface
from spem.plots.values import node_columns

if TYPE_CHECKING:
    from collections.abc import Sequence

    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from numpy.typing import ArrayLike, NDArray

    from spem.shapes.shape import Shape

_LINES = ListedColormap([(1.0, 1.0, 1.0, 0.75)])


def figure_logs(
    shape: Shape,
    log: ArrayLike,
    titles: Sequence[str],
    *,
    sources: ArrayLike | None = None,
    columns: int = 5,
) -> Figure:
    """Return a figure with a panel for log v of each single-source field, all on one colour scale.

    One-dimensional shapes are drawn as curves, two-dimensional ones with lines of equal log v,
    three-dimensional ones as surfaces that show log v one voxel below.

    Parameters
    ----------
    shape
        The shape.
    log
        ``(n_nodes, n_fields)`` logarithms; -inf has the colour of the least finite one.
    titles
        One title a panel.
    sources
        ``(n_fields, d)`` where the source of each is, to be marked in two dimensions.
    columns
        Most panels in a row.

    Raises
    ------
    ShapeError
        If the shape has more than three dimensions.
    ParameterError
        If titles or sources do not match the fields.

    Examples
    --------
    >>> from spem.shapes.shape import Shape
    >>> figure = figure_logs(Shape.from_mask(np.ones((3, 3))), -np.ones((9, 2)), ["a", "b"])
    >>> [ax.get_title() for ax in figure.axes[:2]]
    ['a', 'b']
    """
    fields = node_columns(shape, log)
    n = fields.shape[1]
    places = [None] * n if sources is None else list(np.asarray(sources, np.float64))
    for what, given in (("titles", titles), ("sources", places)):
        if len(given) != n:
            msg = f"{n} fields need as many {what}, not {len(given)}"
            raise ParameterError(msg)
    finite = fields[np.isfinite(fields)]
    low = min(float(finite.min()), -1e-9) if finite.size else -1.0
    shown = np.maximum(fields, low)
    if shape.ndim == 1:
        return _curves(shape, shown, titles, columns)
    figure, axes = panels(n, columns=columns, aspect=picture_aspect(shape), bar=True)
    for ax, column, title, place in zip(axes, shown.T, titles, places, strict=True):
        _draw(shape, column, ax, (low, 0.0), place)
        bare(ax, title)
    value_bar(figure, axes[0], FIELD_CMAP, (low, 0.0), "log v")
    return figure


def _curves(shape: Shape, log: NDArray[np.float64], titles: Sequence[str], columns: int) -> Figure:
    """Draw a curve for each field."""
    figure, axes = curve_panels(log.shape[1], columns=columns)
    for ax, column, title in zip(axes, log.T, titles, strict=True):
        draw_line(shape, column, ax)
        ax.set_title(title, fontsize=TEXT_SIZE)
        ax.set_ylabel("log v", fontsize=TEXT_SIZE)
    return figure


def _draw(
    shape: Shape,
    log: NDArray[np.float64],
    ax: Axes,
    limits: tuple[float, float],
    place: NDArray[np.float64] | None,
) -> None:
    """Draw one field of a silhouette or of a solid."""
    if shape.ndim == 3:
        size = picture_size(shape, SHARPNESS * ax.bbox.width)
        ax.imshow(picture_surface(shape, log, limits=limits, size=size), interpolation="antialiased")
        return
    draw_values(shape, log, ax, limits=limits)
    levels = equal_levels(limits, CONTOURS)
    draw_contours(shape, log, ax, levels=levels, cmap=_LINES, width=0.5, margin=CLEARANCE)
    draw_outline(shape, ax, width=0.7)
    if place is not None:
        mark_source(place, ax)
