"""Values against ρ: profiles at chosen nodes, basis vectors, and the variance of the maps."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.ticker import MaxNLocator

from spem.errors import ParameterError
from spem.plots.camera import Camera, principal_view
from spem.plots.fields import draw_outline
from spem.plots.figures import map_name
from spem.plots.raster import render_surface
from spem.plots.style import COLOURS, DASHES, INK, MARKERS, MUTED, TEXT_SIZE, bare, framed, length_axis
from spem.plots.surfaces import shape_surface
from spem.plots.values import require_drawable

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.container import BarContainer
    from matplotlib.lines import Line2D
    from numpy.typing import ArrayLike, NDArray

    from spem.embedding.maps import Maps
    from spem.fields.hyperfield import Hyperfield
    from spem.shapes.shape import Shape

PICTURE_PIXELS = (480, 480)
# A range of ρ over more than this ratio is shown on a logarithmic axis.
LOGARITHMIC_RATIO = 20.0
LINEAR_TICKS = 5


def draw_profiles(
    hyperfield: Hyperfield, nodes: ArrayLike, ax: Axes, *, shape_ax: Axes | None = None
) -> list[Line2D]:
    """Draw v against ρ at chosen nodes, and the nodes on the shape (Fig. 2 of the paper).

    Parameters
    ----------
    hyperfield
        The fields of one shape; infinite ρ is left out.
    nodes
        ``(k,)`` node numbers.
    ax
        Axis of the curves.
    shape_ax
        Axis of the shape with the nodes marked; an inset of `ax` by default.

    Raises
    ------
    ParameterError
        If a node does not exist.
    ShapeError
        If the shape has more than three dimensions.

    Examples
    --------
    >>> from types import SimpleNamespace
    >>> from spem.plots.style import new_figure
    >>> from spem.shapes.shape import Shape
    >>> shape, rho = Shape.from_mask(np.ones((3, 3))), np.array([1.0, 2.0, np.inf])
    >>> hyperfield = SimpleNamespace(shape=shape, rho=rho, fields=lambda: np.ones((9, 3)))
    >>> lines = draw_profiles(hyperfield, [4, 0], new_figure(4, 3).add_subplot())
    >>> lines[0].get_xdata().tolist()
    [1.0, 2.0]
    """
    shape = hyperfield.shape
    require_drawable(shape)
    chosen = np.atleast_1d(np.asarray(nodes, np.int64))
    if chosen.size == 0 or chosen.min() < 0 or chosen.max() >= shape.n_nodes:
        msg = f"{shape.name}: nodes must be some of 0 to {shape.n_nodes - 1}, not {chosen.tolist()}"
        raise ParameterError(msg)
    finite = np.isfinite(hyperfield.rho)
    values = np.asarray(hyperfield.fields())[chosen][:, finite]
    lines = _curves(hyperfield.rho[finite], values.T, ax)
    framed(ax, "ρ", "v")
    ax.set_ylim(0, 1.02)
    if shape_ax is None:
        shape_ax = ax.inset_axes((0.66, 0.05, 0.32, 0.5))
    _mark_nodes(shape, chosen, shape_ax)
    return lines


def draw_basis(maps: Maps, ax: Axes) -> list[Line2D]:
    """Draw the basis vectors of the maps, Φ, over ρ (eq. 4.4); infinite ρ is left out.

    Examples
    --------
    >>> from types import SimpleNamespace
    >>> from spem.plots.style import new_figure
    >>> maps = SimpleNamespace(rho=np.array([1.0, 2.0]), basis=np.eye(2))
    >>> len(draw_basis(maps, new_figure(4, 3).add_subplot()))
    2
    """
    finite = np.isfinite(maps.rho)
    basis = np.asarray(maps.basis)[finite]
    ax.axhline(0, color=MUTED, linewidth=0.7)
    names = [map_name(j).replace("P", "Φ") for j in range(basis.shape[1])]
    lines = _curves(maps.rho[finite], basis, ax, names)
    framed(ax, "ρ", "basis vector")
    ax.legend(fontsize=TEXT_SIZE - 1, frameon=False, ncols=max(1, (len(names) + 5) // 6))
    return lines


def draw_variance(maps: Maps, ax: Axes) -> BarContainer:
    """Draw the part of the variance that each map leaves to the following ones, on a log axis.

    Examples
    --------
    >>> from types import SimpleNamespace
    >>> from spem.plots.style import new_figure
    >>> maps = SimpleNamespace(explained=np.array([0.9, 0.1]))
    >>> len(draw_variance(maps, new_figure(4, 3).add_subplot()))
    2
    """
    explained = np.asarray(maps.explained, np.float64)
    floor = max(float(explained[explained > 0].min(initial=1.0)) / 3, 1e-18)
    bars = ax.bar(range(explained.size), np.maximum(explained, floor) - floor, bottom=floor, color=COLOURS[0])
    ax.set_yscale("log")
    ax.set_ylim(floor, 1.5)
    framed(ax, "", "part of the variance")
    ax.grid(visible=False, axis="x")
    ax.set_xticks(range(explained.size), [map_name(j) for j in range(explained.size)])
    return bars


def _curves(
    rho: NDArray[np.float64], values: NDArray[np.float64], ax: Axes, names: list[str] | None = None
) -> list[Line2D]:
    """Draw columns of values over ρ, told apart by colour, dash and a marker."""
    lines = [
        ax.plot(
            rho,
            column,
            color=COLOURS[j % len(COLOURS)],
            linestyle=DASHES[j // len(COLOURS) % len(DASHES)],
            marker=MARKERS[j % len(MARKERS)],
            # One marker a curve, each elsewhere and away from the ends, where curves and axes meet.
            markevery=[round((len(rho) - 1) * (0.25 + 0.6 * (j + 0.5) / values.shape[1]))],
            markersize=4.5,
            linewidth=1.4,
            label=names[j] if names else "_",
        )[0]
        for j, column in enumerate(values.T)
    ]
    if rho.size and rho.max() > LOGARITHMIC_RATIO * rho.min():
        length_axis(ax)
    else:
        ax.xaxis.set_major_locator(MaxNLocator(LINEAR_TICKS))
    return lines


def _mark_nodes(shape: Shape, nodes: NDArray[np.int64], ax: Axes) -> None:
    """Draw a shape with a marker at each node, in the colours of their curves."""
    points = shape.points[nodes]
    if shape.ndim == 3:
        rotation = principal_view(shape.points)
        surface = shape_surface(shape)
        picture = render_surface(
            surface.vertices, surface.faces, view=rotation, size=PICTURE_PIXELS, colour="#d5dbe3"
        )
        ax.imshow(picture, interpolation="antialiased")
        seen = Camera.fit(surface.vertices, rotation, PICTURE_PIXELS).project(points)[:, :2]
    elif shape.ndim == 2:
        draw_outline(shape, ax)
        seen = points[:, ::-1]
    else:
        ax.plot(shape.points[:, 0], np.zeros(shape.n_nodes), ".", color=MUTED, markersize=2)
        seen = np.stack([points[:, 0], np.zeros(len(points))], axis=1)
    bare(ax)
    for j, (x, y) in enumerate(seen):
        ax.plot(
            x,
            y,
            marker=MARKERS[j % len(MARKERS)],
            color=COLOURS[j % len(COLOURS)],
            markeredgecolor=INK if shape.ndim == 3 else "white",
            markersize=5.5,
            markeredgewidth=0.6,
        )
