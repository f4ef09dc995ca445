"""The one look of all pictures: colours, type sizes, empty figures and PNG files in memory."""

from __future__ import annotations

from io import BytesIO
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, LogLocator, NullLocator
from PIL import Image

from spem.errors import ParameterError

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from numpy.typing import ArrayLike, NDArray

# Okabe and Ito's palette, black last and yellow left out (too faint as a line on white).
COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#56B4E9", "#E69F00", "#000000")
# Colours of parts, by label: Okabe and Ito's, then each the farthest from those before it, by the least of
# its distances to normal, protan, deutan and tritan eyes.
PART_COLOURS = (
    *("#0072B2", "#E69F00", "#009E73", "#CC79A7", "#56B4E9", "#D55E00", "#F0E442"),
    *("#960F3C", "#96F0A5", "#785A78", "#F0D2FF", "#1E5A4B", "#8778F0", "#784B00"),
    *("#69784B", "#B4B478", "#4B3CA5", "#87B496", "#C31E2D", "#A5874B"),
)
# What no part explains.
NO_PART = "#B9BFC6"
DASHES = ("-", "--", "-.", ":")
MARKERS = ("o", "s", "^", "D", "v", "P", "X")
INK = "#22272e"
MUTED = "#6b7480"
SOLID = "#7d9cc0"
# Both read correctly with every common kind of colour blindness.
FIELD_CMAP = "viridis"
MAP_CMAP = "RdBu_r"
TITLE_SIZE = 9.0
TEXT_SIZE = 8.0


def new_figure(width: float, height: float) -> Figure:
    """Return an empty figure that draws without a screen and without global state.

    Parameters
    ----------
    width, height
        Size in inches.

    Examples
    --------
    >>> new_figure(4, 3).get_size_inches().tolist()
    [4.0, 3.0]
    """
    figure = Figure(figsize=(width, height), dpi=150, layout="constrained")
    FigureCanvasAgg(figure)
    return figure


def part_colours(labels: ArrayLike) -> NDArray[np.float64]:
    """Return the colour of each label; the same label has the same one everywhere.

    Labels beyond the palette begin it anew; negative ones are grey.

    Parameters
    ----------
    labels
        ``(n,)`` whole numbers.

    Returns
    -------
    colours
        ``(n, 3)`` red, green and blue, 0 to 1.

    Examples
    --------
    >>> part_colours([0, -1]).round(2).tolist()
    [[0.0, 0.45, 0.7], [0.73, 0.75, 0.78]]
    """
    palette = np.array([to_rgb(colour) for colour in (*PART_COLOURS, NO_PART)])
    number = np.asarray(labels, np.int64)
    chosen: NDArray[np.float64] = palette[np.where(number < 0, -1, number % len(PART_COLOURS))]
    return chosen


def bare(ax: Axes, title: str = "") -> None:
    """Leave nothing on an axis but its picture and a title.

    Examples
    --------
    >>> ax = new_figure(2, 2).add_subplot()
    >>> bare(ax, "P₁")
    >>> ax.get_title()
    'P₁'
    """
    ax.set_axis_off()
    ax.set_title(title, fontsize=TITLE_SIZE, color=INK, pad=4)


def framed(ax: Axes, xlabel: str, ylabel: str) -> None:
    """Give an axis of curves its labels, two spines and a faint grid.

    Examples
    --------
    >>> ax = new_figure(2, 2).add_subplot()
    >>> framed(ax, "recall", "precision")
    >>> ax.get_xlabel()
    'recall'
    """
    ax.set_xlabel(xlabel, fontsize=TEXT_SIZE, color=INK)
    ax.set_ylabel(ylabel, fontsize=TEXT_SIZE, color=INK)
    ax.tick_params(labelsize=TEXT_SIZE - 1, color=MUTED, labelcolor=INK)
    ax.spines[["top", "right"]].set_visible(False)
    ax.spines[["left", "bottom"]].set_color(MUTED)
    ax.grid(visible=True, color="#e3e6ea", linewidth=0.6)
    ax.set_axisbelow(True)


def length_axis(ax: Axes) -> None:
    """Make the horizontal axis logarithmic, with ticks written as plain numbers.

    Examples
    --------
    >>> ax = new_figure(2, 2).add_subplot()
    >>> length_axis(ax)
    >>> ax.get_xscale()
    'log'
    """
    ax.set_xscale("log")
    ax.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    ax.xaxis.set_minor_locator(NullLocator())
    ax.xaxis.set_major_formatter(FuncFormatter(lambda length, _: f"{length:g}"))


def figure_png(figure: Figure, dpi: float = 150) -> bytes:
    r"""Return a figure as the bytes of a PNG file with a transparent ground.

    Examples
    --------
    >>> figure_png(new_figure(1, 1))[:4]
    b'\x89PNG'
    """
    target = BytesIO()
    figure.savefig(target, format="png", dpi=dpi, transparent=True)
    return target.getvalue()


def image_png(pixels: ArrayLike, *, optimize: bool = True) -> bytes:
    r"""Return an ``(h, w, 4)`` or ``(h, w, 3)`` array of bytes as a PNG file.

    Parameters
    ----------
    pixels
        The picture.
    optimize
        Whether the smallest file is searched for, which takes five times as long and gains a fortieth.

    Raises
    ------
    ParameterError
        If the array is no picture.

    Examples
    --------
    >>> image_png(np.zeros((2, 2, 4), np.uint8))[:4]
    b'\x89PNG'
    """
    array = np.asarray(pixels)
    if array.ndim != 3 or array.shape[2] not in (3, 4) or array.dtype != np.uint8:
        msg = f"a picture is an (h, w, 4) array of uint8, not {array.shape} of {array.dtype}"
        raise ParameterError(msg)
    target = BytesIO()
    Image.fromarray(array).save(target, "PNG", optimize=optimize)
    return target.getvalue()
