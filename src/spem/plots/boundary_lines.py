"""The outline of a two-dimensional shape, coloured by the sources on it."""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.collections import LineCollection
from scipy.spatial import KDTree

from spem.errors import ParameterError
from spem.plots.level import surface_level
from spem.plots.plane import contour_lines, frame, require_dimension

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from numpy.typing import ArrayLike, NDArray

    from spem.fields.boundary.sources import Sources


def draw_boundary(
    sources: Sources, colours: ArrayLike, ax: Axes, *, widths: float | ArrayLike = 2.0
) -> LineCollection:
    """Draw the outline of a shape, each stretch in the colour of its source.

    Stretches without a source are left out.

    Parameters
    ----------
    sources
        Sources of a two-dimensional shape.
    colours
        ``(n_sources, 3)`` red, green and blue, 0 to 1.
    ax
        Axis to draw on; its limits become those of the shape's grid.
    widths
        Of the line in points: one, or ``(n_sources,)``.

    Raises
    ------
    ShapeError
        If the shape is not two-dimensional.
    ParameterError
        If there is not one colour and one width for each source.

    Examples
    --------
    >>> from spem.fields.operator import assemble
    >>> from spem.fields.boundary.sources import point_sources
    >>> from spem.plots.style import new_figure
    >>> from spem.shapes.shape import Shape
    >>> sources = point_sources(assemble(Shape.from_mask(np.ones((2, 2)))))
    >>> ax = new_figure(2, 2).add_subplot()
    >>> len(draw_boundary(sources, np.eye(3)[np.arange(8) // 4], ax).get_paths()) >= 2
    True
    """
    shape = sources.system.shape
    require_dimension(shape, 2, "an outline")
    colour = np.asarray(colours, np.float64)
    width = np.asarray(widths, np.float64)
    if colour.shape != (sources.n_sources, 3) or width.shape not in {(), (sources.n_sources,)}:
        msg = f"{shape.name}: {sources.n_sources} sources need as many colours and widths,"
        msg += f" not {colour.shape} and {width.shape}"
        raise ParameterError(msg)
    style = np.column_stack([colour, np.broadcast_to(width, len(colour))])
    kinds, kind = np.unique(style, axis=0, return_inverse=True)
    kind = np.append(kind.reshape(-1), -1)  # the last entry serves points of no source
    nearest = KDTree(sources.points.position)
    lines, chosen = [], []
    for line in contour_lines(shape, surface_level(shape)):
        at = kind[sources.group[nearest.query(line[:, ::-1])[1]]]
        for first, stop in pairwise(_changes(at)):
            if at[first] >= 0:
                lines.append(_stretch(line, first, stop))
                chosen.append(at[first])
    drawn = LineCollection(
        lines, colors=kinds[chosen, :3], linewidths=kinds[chosen, 3], capstyle="round", joinstyle="round"
    )
    ax.add_collection(drawn)
    frame(shape, ax)
    return drawn


def _changes(values: NDArray[np.int64]) -> NDArray[np.int64]:
    """Begins of the runs of equal values, and the end of the last."""
    inner = np.flatnonzero(values[1:] != values[:-1]) + 1
    return np.concatenate([[0], inner, [len(values)]])


def _stretch(line: NDArray[np.float64], first: int, stop: int) -> NDArray[np.float64]:
    """Vertices first to stop, reaching half way to those beside them."""
    before, after = max(first - 1, 0), min(stop, len(line) - 1)
    start, end = (line[before] + line[first]) / 2, (line[stop - 1] + line[after]) / 2
    return np.concatenate([[start], line[first:stop], [end]])
