"""Where the panels of a figure stand: sizes in inches, with no more room than titles and scale need."""

from __future__ import annotations

from math import ceil
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.patches import Patch

from spem.errors import ParameterError
from spem.plots.style import INK, MUTED, TEXT_SIZE, new_figure

if TYPE_CHECKING:
    from collections.abc import Sequence

    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.legend import Legend
    from numpy.typing import ArrayLike

# Width of a panel by how many stand in a row; of more, the last.
WIDTHS = (3.6, 2.7, 2.2, 1.9)
# Panels of tall shapes are narrower instead of higher than this many widths, but leave room for a title.
TALLEST = 1.6
NARROWEST = 0.95
MARGIN, GAP, TITLE = 0.06, 0.12, 0.27
# From the last panel to the scale, its width, and its words.
BAR = (0.12, 0.1, 0.24)
BAR_HEIGHT = 2.0
# Room below a scale for its least value.
BAR_FOOT = 0.19
# From the last panel to the key of colours, and the room of each entry: its patch, a letter, its height.
KEY_GAP, KEY_PATCH, KEY_LETTER, KEY_HEIGHT = 0.08, 0.3, 0.061, 0.175


def panels(
    n_panels: int,
    *,
    columns: int = 5,
    aspect: float = 1.0,
    width: float | None = None,
    titled: bool = True,
    bar: bool = False,
    key: Sequence[str] = (),
) -> tuple[Figure, list[Axes]]:
    """Return a figure with a grid of `n_panels` axes for pictures, at most `columns` in a row, in even rows.

    Parameters
    ----------
    n_panels
        Number of axes wanted, at least one.
    columns
        Most axes in a row.
    aspect
        Height of the pictures over their width.
    width
        Most width of a panel, in inches; by default the more, the fewer stand in a row.
    titled
        Whether room is left for titles.
    bar
        Whether room is left for `colour_bar`.
    key
        Words that room is left for, for `colour_key`.

    Raises
    ------
    ParameterError
        If there is nothing to draw.

    Examples
    --------
    >>> figure, axes = panels(7)
    >>> len(axes)
    7
    """
    down, across = _grid(n_panels, columns)
    width = width or WIDTHS[min(across, len(WIDTHS)) - 1]
    height = width * min(aspect, TALLEST)
    width = max(min(width, height / aspect), NARROWEST)
    above = TITLE if titled else 0.0
    step = above + (GAP if down > 1 else 0.0)
    right = across * (width + GAP) - GAP + MARGIN
    tall = 2 * MARGIN + above + down * height + (down - 1) * step
    full = right + (sum(BAR) if bar else MARGIN) + _key_room(key, tall)[0], tall
    figure = new_figure(*full)
    figure.set_layout_engine("none")
    grid = figure.add_gridspec(
        down,
        across,
        left=MARGIN / full[0],
        right=right / full[0],
        bottom=MARGIN / full[1],
        top=1 - (MARGIN + above) / full[1],
        wspace=GAP / width,
        hspace=step / height,
    )
    return figure, [figure.add_subplot(grid[divmod(i, across)]) for i in range(n_panels)]


def curve_panels(n_panels: int, *, columns: int = 5) -> tuple[Figure, list[Axes]]:
    """Return a figure with a grid of `n_panels` axes that keep room for ticks and labels.

    Examples
    --------
    >>> figure, axes = curve_panels(2)
    >>> figure.get_size_inches().tolist()
    [5.4, 2.1]
    """
    down, across = _grid(n_panels, columns)
    width = WIDTHS[min(across, len(WIDTHS)) - 1]
    figure = new_figure(across * width, down * round(0.6 * width + TITLE + 0.21, 2))
    return figure, [figure.add_subplot(down, across, i + 1) for i in range(n_panels)]


def colour_bar(
    figure: Figure, ax: Axes, cmap: str, limits: tuple[float, float], words: Sequence[str]
) -> None:
    """Draw one slim scale for all panels, in the room that `panels` left beside the first row.

    Parameters
    ----------
    figure
        From `panels`, with ``bar=True``.
    ax
        Its first axis.
    cmap
        Matplotlib colour map.
    limits
        Values at the ends of the colour map.
    words
        What to write along the scale, evenly spaced.

    Examples
    --------
    >>> figure, axes = panels(1, bar=True)
    >>> colour_bar(figure, axes[0], "viridis", (0, 1), ["0", "1"])
    >>> len(figure.axes)
    2
    """
    width, height = figure.get_size_inches()
    row = ax.get_subplotspec().get_position(figure)  # type: ignore[union-attr]
    tall = min(0.9 * row.height, BAR_HEIGHT / height)
    left = 1 - (BAR[1] + BAR[2]) / width
    room = figure.add_axes((left, (row.y0 + row.y1 - tall) / 2, BAR[1] / width, tall))
    bar = figure.colorbar(ScalarMappable(Normalize(*limits), cmap), cax=room)
    bar.set_ticks(list(np.linspace(*limits, len(words))), labels=list(words))
    bar.ax.tick_params(length=0, labelsize=TEXT_SIZE, labelcolor=MUTED)
    bar.outline.set_visible(False)


def value_bar(figure: Figure, ax: Axes, cmap: str, limits: tuple[float, float], what: str) -> None:
    r"""Draw the scale of `colour_bar` with its ends above and below, where there is room for digits.

    Parameters
    ----------
    figure, ax, cmap, limits
        As for `colour_bar`.
    what
        What the scale is of, to stand above.

    Examples
    --------
    >>> figure, axes = panels(1, bar=True)
    >>> value_bar(figure, axes[0], "viridis", (-12.5, 0), "log v")
    >>> figure.axes[-1].get_title(), figure.axes[-1].get_xlabel()
    ('log v\n0', '−12.5')
    """
    colour_bar(figure, ax, cmap, limits, [""])
    bar = figure.axes[-1]
    above, below = (f"{end:.3g}".replace("-", "−") for end in reversed(limits))
    place = bar.get_position()
    foot = min(max(place.y0, BAR_FOOT / figure.get_figheight()), place.y1 - place.height / 4)
    bar.set_position((place.x0, foot, place.width, place.y1 - foot))
    bar.set_title(f"{what}\n{above}", fontsize=TEXT_SIZE, color=MUTED, pad=4)
    bar.set_xlabel(below, fontsize=TEXT_SIZE, color=MUTED, labelpad=4)


def colour_key(figure: Figure, colours: ArrayLike, words: Sequence[str]) -> Legend:
    """Draw what each colour means, in the room that `panels` left beside the panels.

    Parameters
    ----------
    figure
        From `panels`, with the same words as its `key`.
    colours
        ``(n, 3)`` red, green and blue, 0 to 1.
    words
        ``(n,)`` what each means.

    Examples
    --------
    >>> words = ["black", "white"]
    >>> figure, axes = panels(1, key=words)
    >>> len(colour_key(figure, [[0, 0, 0], [1, 1, 1]], words).get_texts())
    2
    """
    width, height = figure.get_size_inches()
    room, columns = _key_room(words, float(height))
    return figure.legend(
        [Patch(facecolor=colour) for colour in np.asarray(colours)],
        words,
        loc="center left",
        bbox_to_anchor=(1 - (room + MARGIN - KEY_GAP) / width, 0.5),
        ncols=columns,
        frameon=False,
        borderpad=0,
        borderaxespad=0,
        handlelength=0.9,
        handleheight=0.9,
        handletextpad=0.5,
        columnspacing=1.0,
        labelspacing=0.42,
        fontsize=TEXT_SIZE,
        labelcolor=INK,
    )


def _key_room(words: Sequence[str], height: float) -> tuple[float, int]:
    """Width and number of columns of a key beside panels of a height, in inches."""
    if not words:
        return 0.0, 0
    columns = ceil(len(words) / max(1, int(height / KEY_HEIGHT)))
    return KEY_GAP + columns * (KEY_PATCH + KEY_LETTER * max(map(len, words))), columns


def _grid(n_panels: int, columns: int) -> tuple[int, int]:
    """Rows and columns of panels; rows are as even as can be."""
    if n_panels < 1:
        msg = "nothing to draw: at least one panel is needed"
        raise ParameterError(msg)
    down = ceil(n_panels / columns)
    return down, ceil(n_panels / down)
