"""The maps of several shapes side by side: a shape a row, a map a column, one colour scale a column."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize

from spem.errors import ParameterError
from spem.plots.camera import picture_aspect
from spem.plots.fields import draw_line, draw_outline, draw_values
from spem.plots.figures import map_name
from spem.plots.style import MAP_CMAP, MUTED, TEXT_SIZE, TITLE_SIZE, bare, new_figure
from spem.plots.surfaces import draw_surface
from spem.plots.values import value_limits

if TYPE_CHECKING:
    from collections.abc import Sequence

    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from spem.embedding.maps import Maps
    from spem.shapes.shape import Shape

# Width of a panel, and room for a colour bar below and for the names at the left, in inches.
WIDTH, BAR, NAME = 1.15, 0.3, 0.25
# Panels of tall shapes are no higher than this many widths.
TALLEST = 1.8


def figure_map_grid(
    several: Sequence[Maps],
    names: Sequence[str] | None = None,
    *,
    which: Sequence[int] | None = None,
    width: float = WIDTH,
) -> Figure:
    """Return a figure with a row for each shape and a column for each map, as Fig. 13 has them.

    All panels of a column share one colour scale about zero, drawn below it, so that the same colour is the
    same value of the same map in every shape. Of one-dimensional shapes they are curves of one scale.

    Parameters
    ----------
    several
        Maps of shapes of one dimension, of the same ρ.
    names
        A name a row; those of the shapes by default.
    which
        Numbers of the maps to draw, from zero; by default all that every shape has.
    width
        Width of a panel, in inches.

    Raises
    ------
    ParameterError
        If there are no maps, or not a name for each shape.
    ShapeError
        If the shapes have more than three dimensions.

    Examples
    --------
    >>> from types import SimpleNamespace
    >>> from spem.shapes.shape import Shape
    >>> shape = Shape.from_mask(np.ones((3, 3)))
    >>> maps = SimpleNamespace(shape=shape, values=np.ones((9, 2)), basis=np.eye(2), centred=False)
    >>> figure = figure_map_grid([maps, maps, maps])
    >>> [ax.get_title() for ax in figure.axes[:3]]
    ['P₁', 'P₂', '']
    """
    titles = [maps.shape.name for maps in several] if names is None else list(names)
    if not several or len(titles) != len(several):
        msg = f"a grid of maps: expected a name for each of at least one shape, got {len(titles)}"
        msg += f" names of {len(several)} shapes"
        raise ParameterError(msg)
    columns = list(range(min(m.values.shape[1] for m in several)) if which is None else which)
    heights = [width * _aspect(maps.shape) for maps in several]
    figure = new_figure(NAME + width * len(columns), sum(heights) + BAR + 0.25)
    axes = figure.subplots(len(several), len(columns), squeeze=False, height_ratios=heights)
    limits = [
        value_limits(np.concatenate([m.values[:, j] for m in several]), symmetric=True) for j in columns
    ]
    for i, (maps, row, title) in enumerate(zip(several, axes, titles, strict=True)):
        for j, ends, ax in zip(columns, limits, row, strict=True):
            _draw(maps, j, ends, ax)
            if i == 0:
                ax.set_title(map_name(j), fontsize=TITLE_SIZE)
        _name(row[0], title, curve=maps.shape.ndim == 1)
    if several[0].shape.ndim > 1:
        for ends, column in zip(limits, axes.T, strict=True):
            _bar(figure, list(column), ends)
    return figure


def _aspect(shape: Shape) -> float:
    """Return the height of a panel over its width; curves need room for their labels."""
    return 0.9 if shape.ndim == 1 else min(picture_aspect(shape), TALLEST)


def _draw(maps: Maps, j: int, limits: tuple[float, float], ax: Axes) -> None:
    """Draw one map in the way of its shape's dimension."""
    shape, values = maps.shape, maps.values[:, j]
    # On the surface v = 1 for every ρ; the mean field that centred maps lack is not known here.
    boundary = None if maps.centred else float(np.asarray(maps.basis)[:, j].sum())
    if shape.ndim == 1:
        draw_line(shape, values, ax)
        ax.set_ylim(*limits)
        return
    if shape.ndim == 2:
        draw_values(shape, values, ax, symmetric=True, limits=limits, boundary=boundary)
        draw_outline(shape, ax, width=0.5)
    else:
        draw_surface(shape, values, ax, cut=-1, symmetric=True, limits=limits)
    bare(ax)


def _name(ax: Axes, title: str, *, curve: bool) -> None:
    """Write the name of a row at its left."""
    if not curve:
        ax.set_axis_on()
        ax.set(xticks=[], yticks=[])
        ax.spines[:].set_visible(False)
    ax.set_ylabel(title, fontsize=TEXT_SIZE)


def _bar(figure: Figure, column: list[Axes], limits: tuple[float, float]) -> None:
    """Draw the colour scale of a column below it."""
    bar = figure.colorbar(
        ScalarMappable(Normalize(*limits), MAP_CMAP),
        ax=column,
        location="bottom",
        aspect=12,
        pad=0.01,
        fraction=0.03,
        shrink=0.7,
    )
    words = [f"{end:.2g}".replace("-", "−") for end in limits]
    bar.set_ticks(list(limits), labels=words)
    bar.ax.tick_params(length=0, labelsize=TEXT_SIZE - 1, labelcolor=MUTED)
    bar.outline.set_visible(False)
