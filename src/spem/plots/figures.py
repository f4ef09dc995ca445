"""Figures with a panel for each field or each map of a shape of any dimension that can be drawn."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from spem.errors import ParameterError
from spem.plots.camera import picture_aspect, picture_size, principal_view, view_rotation
from spem.plots.fields import draw_line, draw_outline, draw_slice, draw_values
from spem.plots.layout import colour_bar, curve_panels, panels
from spem.plots.raster import SHARPNESS, render_surface
from spem.plots.style import FIELD_CMAP, MAP_CMAP, TEXT_SIZE, bare, figure_png
from spem.plots.surfaces import shape_surface, surface_values
from spem.plots.values import node_columns, value_limits

if TYPE_CHECKING:
    from collections.abc import Sequence

    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from numpy.typing import ArrayLike, NDArray

    from spem.embedding.maps import Maps
    from spem.plots.camera import View
    from spem.shapes.shape import Shape

# Panels of the map pictures in reports, in inches: narrow beside their titles.
MAP_WIDTH = 1.5


def figure_fields(
    shape: Shape,
    values: ArrayLike,
    titles: Sequence[str] | None = None,
    *,
    contours: bool = True,
    view: View | None = None,
    columns: int = 5,
) -> Figure:
    """Return a figure with a panel for each field, all on one colour scale from 0 to 1.

    One-dimensional shapes are drawn as curves, two-dimensional ones as images, three-dimensional
    ones cut open.

    Parameters
    ----------
    shape
        The shape.
    values
        ``(n_nodes, n_fields)`` or ``(n_nodes,)`` fields.
    titles
        One title a panel.
    contours
        Whether to draw lines of equal value in images.
    view
        View of three-dimensional shapes; their broad side by default.
    columns
        Most panels in a row.

    Raises
    ------
    ShapeError
        If the shape has more than three dimensions.
    ParameterError
        If the titles do not match the fields.

    Examples
    --------
    >>> from spem.shapes.shape import Shape
    >>> figure = figure_fields(Shape.from_mask(np.ones((3, 3))), np.ones((9, 2)), ["ρ = 1", "ρ = 2"])
    >>> [ax.get_title() for ax in figure.axes[:2]]
    ['ρ = 1', 'ρ = 2']
    """
    fields = node_columns(shape, values)
    n_fields = fields.shape[1]
    captions = _titles(titles, n_fields)
    figure, axes = _panels(shape, n_fields, columns, view, None, titled=titles is not None)
    limits, surface = [(0.0, 1.0)] * n_fields, [1.0] * n_fields
    _fill(shape, fields, axes, limits, surface, symmetric=False, contours=contours, view=view)
    _caption(shape, axes, captions)
    if shape.ndim > 1:
        colour_bar(figure, axes[0], FIELD_CMAP, (0.0, 1.0), ["0", "v", "1"])
    return figure


def figure_maps(
    maps: Maps,
    *,
    n_maps: int | None = None,
    view: View | None = None,
    columns: int = 5,
    width: float | None = None,
) -> Figure:
    """Return a figure with a panel for each SPEM map, each coloured about zero on its own scale.

    Parameters
    ----------
    maps
        The maps of one shape.
    n_maps
        Number of leading maps to draw; all by default.
    view
        View of three-dimensional shapes; their broad side by default.
    columns
        Most panels in a row.
    width
        Most width of a panel, in inches; by default the more, the fewer stand in a row.

    Raises
    ------
    ShapeError
        If the shape has more than three dimensions.

    Examples
    --------
    >>> from types import SimpleNamespace
    >>> from spem.shapes.shape import Shape
    >>> shape = Shape.from_mask(np.ones((3, 3)))
    >>> share, basis = np.array([0.97, 0.03]), np.eye(2)
    >>> maps = SimpleNamespace(
    ...     shape=shape, values=np.ones((9, 2)), explained=share, basis=basis, centred=False
    ... )
    >>> figure_maps(maps).axes[0].get_title()
    'P₁  97 %'
    """
    values = node_columns(maps.shape, maps.values)[:, :n_maps]
    figure, axes = _panels(maps.shape, values.shape[1], columns, view, width, titled=True)
    limits = [value_limits(column, symmetric=True) for column in values.T]
    # On the surface v = 1 for every ρ; the mean field that centred maps lack is not known here.
    surface = [None if maps.centred else float(vector.sum()) for vector in np.asarray(maps.basis).T]
    surface = surface[: values.shape[1]]
    _fill(maps.shape, values, axes, limits, surface, symmetric=True, contours=False, view=view)
    titles = [f"{map_name(j)}  {_percent(maps.explained[j])}" for j in range(values.shape[1])]
    _caption(maps.shape, axes, titles)
    if maps.shape.ndim > 1:
        colour_bar(figure, axes[0], MAP_CMAP, (-1.0, 1.0), ["−", "0", "+"])
    return figure


def map_picture(maps: Maps, n_maps: int = 4) -> bytes:
    r"""Return the leading maps, two in a row, as a small PNG file that can be read on a phone.

    Examples
    --------
    >>> from types import SimpleNamespace
    >>> from spem.shapes.shape import Shape
    >>> shape = Shape.from_mask(np.ones((3, 3)))
    >>> maps = SimpleNamespace(
    ...     shape=shape, values=np.ones((9, 1)), explained=np.ones(1), basis=np.ones((1, 1)), centred=False
    ... )
    >>> map_picture(maps)[:4]
    b'\x89PNG'
    """
    return figure_png(figure_maps(maps, n_maps=n_maps, columns=2, width=MAP_WIDTH))


def figure_slices(shape: Shape, values: ArrayLike, *, symmetric: bool = False) -> Figure:
    """Return a figure with the three slices through the median node of a volume.

    Parameters
    ----------
    shape
        A three-dimensional shape.
    values
        ``(n_nodes,)`` one value a node.
    symmetric
        Whether values are signed, coloured about zero.

    Raises
    ------
    ShapeError
        If the shape is not three-dimensional.

    Examples
    --------
    >>> from spem.shapes.shape import Shape
    >>> len(figure_slices(Shape.from_mask(np.ones((3, 3, 3))), np.ones(27)).axes)
    3
    """
    reach = max(n * h for n, h in zip(shape.mask.shape, shape.spacing, strict=True)) / 2
    figure, axes = panels(3)
    for axis, ax in enumerate(axes):
        draw_slice(shape, values, ax, axis=axis, symmetric=symmetric)
        # All three on one scale: equal squares about the middle of each slice.
        x, y = np.mean(ax.get_xlim()), np.mean(ax.get_ylim())
        ax.set(xlim=(x - reach, x + reach), ylim=(y + reach, y - reach))
        down, right = (a for a in range(3) if a != axis)
        bare(ax, f"axis {down} ↓  axis {right} →")
    return figure


def map_name(j: int) -> str:
    """Return the symbol of map `j`, counted from zero.

    Examples
    --------
    >>> map_name(11)
    'P₁₂'
    """
    return "P" + str(j + 1).translate(str.maketrans("0123456789", "₀₁₂₃₄₅₆₇₈₉"))


def _fill(
    shape: Shape,
    values: NDArray[np.float64],
    axes: list[Axes],
    limits: list[tuple[float, float]],
    boundary: Sequence[float | None],
    *,
    symmetric: bool,
    contours: bool,
    view: View | None,
) -> None:
    """Draw a column of values on each axis, in the way of the shape's dimension."""
    if shape.ndim == 3:
        _fill_surfaces(shape, values, axes, limits, boundary, symmetric=symmetric, view=view)
        return
    for ax, column, ends, known in zip(axes, values.T, limits, boundary, strict=True):
        if shape.ndim == 1:
            draw_line(shape, column, ax)
            if not symmetric:
                ax.set_ylim(-0.02, 1.05)
        else:
            draw_values(
                shape, column, ax, symmetric=symmetric, limits=ends, contours=contours, boundary=known
            )
            draw_outline(shape, ax, width=0.7)


def _fill_surfaces(
    shape: Shape,
    values: NDArray[np.float64],
    axes: list[Axes],
    limits: list[tuple[float, float]],
    boundary: Sequence[float | None],
    *,
    symmetric: bool,
    view: View | None,
) -> None:
    """Draw each column on one surface, cut open across the axis that faces the viewer most.

    Fields are 1 on the surface; maps, constant on it too, are shown as they are one voxel below.
    """
    rotation = principal_view(shape.points) if view is None else view_rotation(view)
    surface = shape_surface(shape, int(np.abs(rotation[2]).argmax()), toward=rotation[2])
    size = picture_size(shape, SHARPNESS * axes[0].bbox.width, rotation)
    for ax, column, ends, known in zip(axes, values.T, limits, boundary, strict=True):
        shown = surface_values(shape, surface, column, boundary=known)
        picture = render_surface(
            surface.vertices,
            surface.faces,
            shown if symmetric else np.where(surface.section, shown, 1.0),
            view=rotation,
            size=size,
            cmap=MAP_CMAP if symmetric else FIELD_CMAP,
            limits=ends,
            unlit=surface.cut_faces,
        )
        ax.imshow(picture, interpolation="antialiased")
        bare(ax)


def _panels(
    shape: Shape, n_panels: int, columns: int, view: View | None, width: float | None, *, titled: bool
) -> tuple[Figure, list[Axes]]:
    """Axes for curves or for pictures, in the way of the shape's dimension."""
    if shape.ndim == 1:
        return curve_panels(n_panels, columns=columns)
    aspect = picture_aspect(shape, view)
    return panels(n_panels, columns=columns, aspect=aspect, width=width, titled=titled, bar=True)


def _titles(titles: Sequence[str] | None, n_panels: int) -> list[str]:
    """One title a panel."""
    if titles is None:
        return [""] * n_panels
    if len(titles) != n_panels:
        msg = f"{n_panels} fields need as many titles, not {len(titles)}"
        raise ParameterError(msg)
    return list(titles)


def _caption(shape: Shape, axes: list[Axes], titles: list[str]) -> None:
    """Write the titles; curves keep their axes."""
    for ax, title in zip(axes, titles, strict=True):
        if shape.ndim == 1:
            ax.set_title(title, fontsize=TEXT_SIZE)
        else:
            bare(ax, title)


def _percent(fraction: float) -> str:
    """Write a fraction as a percentage with two digits, and as many nines as it has."""
    percent = 100 * float(fraction)
    if percent < 0.01:
        return "< 0.01 %"
    if percent > 99:
        return f"{min(percent, 99.99):.2f} %" if fraction < 1 else "100 %"
    return f"{percent:.2g} %"
