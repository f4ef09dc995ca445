"""Components of parts one by one: what each weighs inside a shape and on its boundary."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.colors import LinearSegmentedColormap, to_hex

from spem.plots.boundary_lines import draw_boundary
from spem.plots.camera import picture_aspect, picture_size, principal_view, view_rotation
from spem.plots.fields import draw_line, draw_values
from spem.plots.layout import curve_panels, panels
from spem.plots.raster import SHARPNESS, render_surface
from spem.plots.style import TEXT_SIZE, bare, part_colours
from spem.plots.surfaces import shape_surface, surface_values
from spem.plots.values import require_drawable

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.colors import Colormap
    from matplotlib.figure import Figure
    from numpy.typing import NDArray

    from spem.decomposition.parts import Parts
    from spem.plots.camera import View
    from spem.shapes.shape import Shape

# Colour of no weight in a shape and on its boundary; where it weighs most, the boundary is darker.
PALE = np.array([0.935, 0.945, 0.955])
OUTLINE = np.array([0.68, 0.71, 0.74])
DARK = 0.72
# Widths of the boundary in points, from no weight to the largest.
WIDTHS = (0.7, 3.0)
# Steps of the colour of a boundary.
STEPS = 32


def figure_components(
    parts: Parts, *, view: View | None = None, columns: int = 4, width: float | None = None
) -> Figure:
    """Return a figure with a panel for each component: its weight at the nodes and at the sources.

    In each panel both go from pale to the colour of the part, each up to its largest value there. Of parts
    of the region (Figure 8) the nodes show a row of S and the outline a column of A of (4.3); of parts of the
    boundary (Figure 11) it is the other way round. Three-dimensional shapes show the nodes' weights just
    below the surface.

    Parameters
    ----------
    parts
        Parts of one shape.
    view
        View of a three-dimensional shape; its broad side by default.
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
    >>> line = Shape.from_mask([1, 1])
    >>> toy = SimpleNamespace(shape=line, over="region", n_parts=1, components=np.ones((1, 2)), basis=None)
    >>> toy.intensity = np.ones(1)
    >>> figure_components(toy).axes[0].get_title()
    '0   100 %'
    """
    shape = parts.shape
    require_drawable(shape)
    region = parts.over == "region"
    nodes, sources = (parts.components, parts.basis) if region else (parts.basis, parts.components)
    drawn = _not_empty(parts)
    if shape.ndim == 1:
        figure, axes = curve_panels(drawn.size, columns=columns)
    else:
        aspect = picture_aspect(shape, view)
        figure, axes = panels(drawn.size, columns=columns, aspect=aspect, width=width)
    if shape.ndim == 3:
        _draw_surfaces(shape, drawn, nodes, axes, view)
    for j, ax in zip(drawn, axes, strict=True):
        if shape.ndim == 1:
            draw_line(shape, nodes[j], ax, colour=to_hex(part_colours([j])[0]))
        elif shape.ndim == 2:
            _draw_plane(parts, j, nodes[j], sources[j], ax)
        title = f"{j}   {100 * float(parts.intensity[j]):.0f} %"
        if shape.ndim == 1:
            ax.set_title(title, fontsize=TEXT_SIZE)
        else:
            bare(ax, title)
    return figure


def _not_empty(parts: Parts) -> NDArray[np.int64]:
    """Numbers of the parts that the shape has; of none, all."""
    there = np.flatnonzero((parts.components > 0).any(axis=1))
    return there if there.size else np.arange(parts.n_parts)


def _ramp(label: int) -> Colormap:
    """Colours from pale to that of a part."""
    return LinearSegmentedColormap.from_list("part", [PALE, part_colours([label])[0]])


def _draw_plane(
    parts: Parts, label: int, nodes: NDArray[np.float64], sources: NDArray[np.float64], ax: Axes
) -> None:
    """Draw the weights of one component in a two-dimensional shape and along its outline."""
    top = max(float(nodes.max()), 1e-300)
    draw_values(parts.shape, nodes, ax, cmap=_ramp(label), limits=(0.0, top))
    share = np.round(sources / max(float(sources.max()), 1e-300) * STEPS) / STEPS
    colours = OUTLINE + share[:, None] * (DARK * part_colours([label]) - OUTLINE)
    draw_boundary(parts.sources, colours, ax, widths=WIDTHS[0] + share * (WIDTHS[1] - WIDTHS[0]))


def _draw_surfaces(
    shape: Shape, drawn: NDArray[np.int64], nodes: NDArray[np.float64], axes: list[Axes], view: View | None
) -> None:
    """Draw each component on the surface of a three-dimensional shape."""
    rotation = principal_view(shape.points) if view is None else view_rotation(view)
    surface = shape_surface(shape)
    size = picture_size(shape, SHARPNESS * axes[0].bbox.width, rotation)
    for j, ax in zip(drawn, axes, strict=True):
        weights = nodes[j]
        picture = render_surface(
            surface.vertices,
            surface.faces,
            surface_values(shape, surface, weights),
            view=rotation,
            size=size,
            cmap=_ramp(j),
            limits=(0.0, max(float(weights.max()), 1e-300)),
        )
        ax.imshow(picture, interpolation="antialiased")
