"""Joint histograms of two maps beside their shapes, in a logarithmic scale of counts."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.colors import LogNorm

from spem.embedding.histograms import joint_histogram, map_limits
from spem.plots.figures import map_name
from spem.plots.style import FIELD_CMAP, TEXT_SIZE, bare, framed, new_figure
from spem.plots.surfaces import draw_surface

if TYPE_CHECKING:
    from collections.abc import Sequence

    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.image import AxesImage
    from numpy.typing import ArrayLike

    from spem.embedding.maps import Maps

# Shape, histogram, histogram, shape: widths of a pair of panels, and of the gap between pairs.
PAIR, GAP = (0.7, 1.0, 1.0, 0.7), 0.12


def draw_joint_histogram(
    share: ArrayLike,
    limits: tuple[tuple[float, float], tuple[float, float]],
    ax: Axes,
    *,
    names: tuple[str, str] = ("", ""),
    shades: tuple[float, float] | None = None,
) -> AxesImage:
    """Draw a joint histogram as an image, empty bins left white, as Fig. 18 has it.

    Parameters
    ----------
    share
        ``(bins, bins)`` from `joint_histogram`, x along axis 0.
    limits
        Least and greatest value of x, then of y.
    ax
        Axis to draw on.
    names
        What x and y are.
    shades
        Shares at the ends of the colour map; by default the least above zero and the greatest.

    Examples
    --------
    >>> from spem.plots.style import new_figure
    >>> ax = new_figure(2, 2).add_subplot()
    >>> image = draw_joint_histogram([[0.5, 0.0], [0.0, 0.5]], ((0, 1), (-1, 1)), ax, names=("P₄", "P₃"))
    >>> image.get_extent(), ax.get_xlabel()
    ([0, 1, -1, 1], 'P₄')
    """
    counts = np.asarray(share, np.float64).T
    filled = np.ma.masked_equal(counts, 0.0)
    low, high = shades or (float(filled.min()), float(filled.max()))
    (left, right), (bottom, top) = limits
    image = ax.imshow(
        filled,
        norm=LogNorm(low, max(high, np.nextafter(low, 1.0)), clip=True),
        cmap=FIELD_CMAP,
        extent=(left, right, bottom, top),
        origin="lower",
        aspect="auto",
        interpolation="nearest",
    )
    framed(ax, *names)
    ax.grid(visible=False)
    ax.tick_params(labelsize=TEXT_SIZE - 1)
    return image


def figure_joint_histograms(
    several: Sequence[Maps],
    names: Sequence[str],
    *,
    x: int = 3,
    y: int = 2,
    limits: tuple[tuple[float, float], tuple[float, float]] | None = None,
    bins: int = 32,
) -> Figure:
    """Return a figure with the joint histograms of solids beside them, two solids a pair, two pairs a row.

    Parameters
    ----------
    several
        Maps of an even number of three-dimensional shapes: two poses of a kind follow each other.
    names
        A name a shape.
    x, y
        Numbers of the maps, from zero.
    limits
        Least and greatest value of x, then of y; by default those of these shapes.
    bins
        Bins along each axis.

    Raises
    ------
    ShapeError
        If a shape is not three-dimensional.

    Examples
    --------
    >>> import spem
    >>> ball = spem.maps(spem.synthetic.ball(radius=4.0, spacing=1.0), 4)
    >>> len(figure_joint_histograms([ball, ball], ["ball", "ball"]).axes)
    10
    """
    values = [maps.values for maps in several]
    ends = limits or (map_limits(values, x), map_limits(values, y))
    shares = [joint_histogram(v[:, x], v[:, y], ends, bins) for v in values]
    shades = (1 / max(map(len, values)), max(float(share.max()) for share in shares))
    rows = -(-len(several) // 4)
    figure = new_figure(10.0, 1.7 * rows + 0.3)
    axes = figure.subplots(rows, 9, squeeze=False, width_ratios=(*PAIR, GAP, *PAIR))
    for ax in axes.ravel():
        ax.set_axis_off()
    for i, (maps, share) in enumerate(zip(several, shares, strict=True)):
        row, first = axes[i // 4], 5 * (i // 2 % 2)
        body, ax = (row[first], row[first + 1]) if i % 2 == 0 else (row[first + 3], row[first + 2])
        draw_surface(maps.shape, None, body)
        bare(body, names[i])
        ax.set_axis_on()
        image = draw_joint_histogram(share, ends, ax, shades=shades)
        ax.tick_params(labelleft=i % 2 == 0, labelbottom=i // 4 == rows - 1)
        ax.set_ylabel(map_name(y) if i % 2 == 0 else "", fontsize=TEXT_SIZE)
        ax.set_xlabel(map_name(x) if i // 4 == rows - 1 else "", fontsize=TEXT_SIZE)
    bar = figure.colorbar(image, ax=list(axes.ravel()), aspect=40, pad=0.01)
    bar.set_label("share of the nodes", fontsize=TEXT_SIZE)
    bar.ax.tick_params(labelsize=TEXT_SIZE - 1)
    return figure
