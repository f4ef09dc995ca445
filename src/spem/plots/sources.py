"""Figures of single-source fields: one source in three ways, clipped log-fields, superposition in 1-D."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.collections import LineCollection
from matplotlib.patches import Rectangle

from spem.decomposition.measurements import Centre, measurements
from spem.fields.boundary.sources import check_source
from spem.fields.gradients import source_gradient, unit_vectors
from spem.fields.streamlines import even_nodes, source_streamlines
from spem.plots.camera import Camera, picture_aspect, picture_size, principal_view, view_rotation
from spem.plots.fields import draw_outline, draw_values
from spem.plots.layout import TALLEST, curve_panels, panels, value_bar
from spem.plots.plane import require_dimension
from spem.plots.raster import render_surface
from spem.plots.streams import CLEARANCE, draw_contours, draw_directions, draw_streamlines, mark_source
from spem.plots.style import COLOURS, FIELD_CMAP, MUTED, TEXT_SIZE, bare, framed
from spem.plots.surfaces import picture_surface, shape_surface

if TYPE_CHECKING:
    from collections.abc import Sequence

    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from numpy.typing import NDArray

    from spem.fields.boundary.sources import Sources
    from spem.fields.superposition.fields import SourceFields
    from spem.plots.camera import View
    from spem.plots.streams import Window
    from spem.shapes.shape import Shape

# Side of the part that arrows are shown of, as a share of the longer side of the shape.
WINDOW = 0.3
LINES = 60
PIXELS = 480
FIGURE_CENTRES: tuple[Centre, ...] = ("median", "mean")


def figure_source(
    fields: SourceFields, source: int, *, window: Window | None = None, n_lines: int = LINES
) -> Figure:
    """Return log v^{p_i} with lines of equal value, arrows along its gradient, and streamlines (Fig. 5).

    Parameters
    ----------
    fields
        Fields of boundary sources of a two-dimensional shape.
    source
        Number of the source.
    window
        Part of the shape that arrows are shown of: its ends along each axis, in the shape's own coordinates;
        by default around the node with the smallest value.
    n_lines
        Number of streamlines, from nodes spread evenly.

    Raises
    ------
    ShapeError
        If the shape is not two-dimensional.
    ParameterError
        If there is no such source, or the window holds no node.

    Examples
    --------
    >>> from spem.fields.operator import assemble
    >>> from spem.fields.superposition.fields import solve_sources
    >>> from spem.fields.boundary.sources import point_sources
    >>> from spem.shapes.shape import Shape
    >>> fields = solve_sources(point_sources(assemble(Shape.from_mask(np.ones((6, 12))))), np.inf)
    >>> [ax.get_title() for ax in figure_source(fields, 0).axes[:3]]
    ['log v', '∇v/|∇v|', 'streamlines']
    """
    system = fields.sources.system
    shape = system.shape
    require_dimension(shape, 2, "the field of a source")
    slope, log = source_gradient(fields, source), fields.log[source]
    low = float(log[np.isfinite(log)].min())
    figure, axes = panels(3, aspect=picture_aspect(shape), bar=True)
    draw_values(shape, np.maximum(log, low), axes[0], limits=(low, 0.0))
    limits = low, low / 2
    draw_contours(shape, log, axes[0], cmap="gray_r", limits=limits, width=0.5, margin=CLEARANCE)
    draw_outline(shape, axes[1], width=0.7)
    part = window or _window(shape, log)
    draw_directions(shape, unit_vectors(slope), axes[1], window=part)
    _draw_frame(part, axes[0])
    _draw_frame(part, axes[1])
    draw_streamlines(shape, source_streamlines(fields, source, even_nodes(system, n_lines)), axes[2])
    for ax, title in zip(axes, ("log v", "∇v/|∇v|", "streamlines"), strict=True):
        if ax is not axes[1]:
            draw_outline(shape, ax, width=0.7)
            mark_source(fields.sources.position[source], ax)
        bare(ax, title)
    value_bar(figure, axes[0], FIELD_CMAP, (low, 0.0), "log v")
    return figure


def figure_solid_source(
    fields: SourceFields, source: int, *, view: View | None = None, n_lines: int = LINES
) -> Figure:
    """Return log v^{p_i} one voxel below the surface of a solid, and streamlines through it.

    Parameters
    ----------
    fields
        Fields of boundary sources of a three-dimensional shape.
    source
        Number of the source.
    view
        Elevation and azimuth in degrees, a rotation, or None to look at the broad side.
    n_lines
        Number of streamlines, from nodes spread evenly.

    Raises
    ------
    ShapeError
        If the shape is not three-dimensional.
    ParameterError
        If there is no such source.

    Examples
    --------
    >>> from spem.fields.operator import assemble
    >>> from spem.fields.superposition.fields import solve_sources
    >>> from spem.fields.boundary.sources import point_sources
    >>> from spem.shapes.shape import Shape
    >>> fields = solve_sources(point_sources(assemble(Shape.from_mask(np.ones((3, 3, 5))))), np.inf)
    >>> [ax.get_title() for ax in figure_solid_source(fields, 0).axes[:2]]
    ['log v', 'streamlines']
    """
    system = fields.sources.system
    shape = system.shape
    require_dimension(shape, 3, "the field of a source in a solid")
    lines = source_streamlines(fields, source, even_nodes(system, n_lines))
    log = fields.log[source]
    low = float(log[np.isfinite(log)].min())
    rotation = principal_view(shape.points) if view is None else view_rotation(view)
    figure, axes = panels(2, aspect=picture_aspect(shape, rotation), bar=True)
    surface = shape_surface(shape)
    size = picture_size(shape, PIXELS, rotation)
    depth = picture_surface(shape, np.maximum(log, low), view=rotation, limits=(low, 0.0), size=size)
    axes[0].imshow(depth, interpolation="antialiased")
    picture = render_surface(surface.vertices, surface.faces, view=rotation, size=size, colour="#d5dbe3")
    axes[1].imshow(picture, interpolation="antialiased")
    camera = Camera.fit(surface.vertices, rotation, size)
    seen = [camera.project(line)[:, :2] for line in lines]
    axes[1].add_collection(LineCollection(seen, colors=COLOURS[0], linewidths=0.6))
    for ax, title in zip(axes, ("log v", "streamlines"), strict=True):
        bare(ax, title)
    x, y, _ = camera.project(fields.sources.position[[source]])[0]
    mark_source((y, x), axes[1])
    value_bar(figure, axes[0], FIELD_CMAP, (low, 0.0), "log v")
    return figure


def figure_measurements(fields: SourceFields, source: int) -> Figure:
    """Return the clipped log-field of one source, centred by the median and by the mean (4.2, Fig. 7).

    Parameters
    ----------
    fields
        Fields of all boundary sources of a two-dimensional shape: the centres are taken over them.
    source
        Number of the source.

    Raises
    ------
    ShapeError
        If the shape is not two-dimensional.
    ParameterError
        If there is no such source.

    Examples
    --------
    >>> from spem.fields.operator import assemble
    >>> from spem.fields.superposition.fields import solve_sources
    >>> from spem.fields.boundary.sources import point_sources
    >>> from spem.shapes.shape import Shape
    >>> fields = solve_sources(point_sources(assemble(Shape.from_mask(np.ones((6, 12))))), np.inf)
    >>> [ax.get_title() for ax in figure_measurements(fields, 0).axes[:2]]
    ['centred by the median', 'centred by the mean']
    """
    shape = fields.sources.system.shape
    require_dimension(shape, 2, "a clipped log-field")
    check_source(fields.sources, source)
    shown = [measurements(fields, centre)[source] for centre in FIGURE_CENTRES]
    limits = 0.0, max(float(np.max(shown)), 1e-9)
    figure, axes = panels(len(shown), aspect=picture_aspect(shape), bar=True)
    for ax, values, centre in zip(axes, shown, FIGURE_CENTRES, strict=True):
        draw_values(shape, values, ax, limits=limits)
        draw_outline(shape, ax, width=0.7)
        mark_source(fields.sources.position[source], ax)
        bare(ax, f"centred by the {centre}")
    value_bar(figure, axes[0], FIELD_CMAP, limits, "y")
    return figure


def figure_superposition(slices: Sequence[SourceFields]) -> Figure:
    """Return the fields of the sources of a one-dimensional shape, and their sum, for several ρ (Fig. 4).

    Parameters
    ----------
    slices
        Fields of the same sources, one for each ρ: a row each, with a column for each source and one for
        the sum.

    Raises
    ------
    ShapeError
        If the shape is not one-dimensional.
    ParameterError
        If there is nothing to draw.

    Examples
    --------
    >>> from spem.fields.operator import assemble
    >>> from spem.fields.superposition.fields import solve_sources
    >>> from spem.fields.boundary.sources import point_sources
    >>> from spem.shapes.shape import Shape
    >>> sources = point_sources(assemble(Shape.from_mask(np.ones(9))))
    >>> len(figure_superposition([solve_sources(sources, rho) for rho in (1.0, 5.0)]).axes)
    6
    """
    across = 1 + (slices[0].sources.n_sources if slices else 0)
    figure, axes = curve_panels(across * len(slices), columns=across)
    for k, fields in enumerate(slices):
        require_dimension(fields.sources.system.shape, 1, "a superposition of curves")
        lit = np.eye(across - 1)
        values, ends = (np.vstack([rows, rows.sum(axis=0)]) for rows in (fields.values, lit))
        row = axes[k * across : (k + 1) * across]
        for j, (ax, field, end) in enumerate(zip(row, values, ends, strict=True)):
            last = j == across - 1
            _draw_curve(fields.sources, field, end, ax, COLOURS[int(last)])
            ax.set_xlabel("position" if k == len(slices) - 1 else "")
            ax.set_title(f"{'sum' if last else f'source {j + 1}'}, ρ = {fields.rho:.3g}", fontsize=TEXT_SIZE)
    return figure


def _draw_curve(
    sources: Sources, field: NDArray[np.float64], end: NDArray[np.float64], ax: Axes, colour: str
) -> None:
    """Draw a field on a line up to its values on the boundary, one a source; broken where the shape is."""
    shape, group = sources.system.shape, sources.group
    place = sources.points.position[:, 0]
    # In the voxel model the boundary lies on voxels outside, where the grid has no value.
    free = np.abs(shape.axes[0][:, None] - place).min(axis=1, initial=np.inf) > 1e-9 * shape.spacing[0]
    position = np.concatenate([shape.axes[0][free], place])
    value = np.concatenate([shape.to_grid(field)[free], np.where(group >= 0, end[group], 0.0)])
    order = np.argsort(position, kind="stable")
    ax.plot(position[order], value[order], color=colour, linewidth=1.4)
    framed(ax, "", "")
    ax.set_ylim(-0.02, 1.05)


def _window(shape: Shape, log: NDArray[np.float64]) -> Window:
    """Return a part of the shape around the node with the smallest value, as high over wide as a picture."""
    low = shape.points.min(axis=0) - shape.spacing
    high = shape.points.max(axis=0) + shape.spacing
    width = WINDOW * float(np.max(high - low)) + 2 * max(shape.spacing)
    half = np.array([width * min(picture_aspect(shape), TALLEST), width]) / 2
    middle = shape.points[np.where(np.isfinite(log), log, np.inf).argmin()]
    middle = np.clip(middle, np.minimum(low + half, high), np.maximum(high - half, low))
    (top, left), (bottom, right) = middle - half, middle + half
    return (float(top), float(bottom)), (float(left), float(right))


def _draw_frame(window: Window, ax: Axes) -> None:
    """Draw the rim of a part of the shape."""
    (top, bottom), (left, right) = window
    ax.add_patch(Rectangle((left, top), right - left, bottom - top, fill=False, color=MUTED, linewidth=0.8))
