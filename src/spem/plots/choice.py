"""The error of a decomposition against the number of its parts."""

from __future__ import annotations

from typing import TYPE_CHECKING

from matplotlib.ticker import MaxNLocator

from spem.plots.style import COLOURS, MUTED, TEXT_SIZE, framed, new_figure

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.lines import Line2D

    from spem.decomposition.choice import ErrorCurve

SIZE = (3.6, 2.6)


def figure_error_curve(curve: ErrorCurve) -> Figure:
    """Return a figure of the error against the number of parts.

    Examples
    --------
    >>> import numpy as np
    >>> from spem.decomposition.choice import ErrorCurve
    >>> len(figure_error_curve(ErrorCurve(np.arange(1, 5), np.array([0.9, 0.4, 0.3, 0.29]))).axes)
    1
    """
    figure = new_figure(*SIZE)
    draw_error_curve(curve, figure.add_subplot())
    return figure


def draw_error_curve(curve: ErrorCurve, ax: Axes) -> Line2D:
    """Draw the error against the number of parts, with the suggested number marked.

    Parameters
    ----------
    curve
        The errors.
    ax
        Axis to draw on.

    Examples
    --------
    >>> import numpy as np
    >>> from spem.decomposition.choice import ErrorCurve
    >>> from spem.plots.style import new_figure
    >>> ax = new_figure(2, 2).add_subplot()
    >>> draw_error_curve(ErrorCurve(np.arange(1, 4), np.array([0.9, 0.4, 0.3])), ax).get_xdata()
    array([1, 2, 3])
    """
    framed(ax, "number of parts k", "error")
    line = ax.plot(curve.counts, curve.errors, "o-", color=COLOURS[0], markersize=3, linewidth=1.4)[0]
    error = curve.errors[curve.counts == curve.suggested][0]
    ax.plot([curve.suggested], [error], "o", markersize=9, color="none", markeredgecolor=COLOURS[1])
    ax.annotate(
        f"k = {curve.suggested}",
        (curve.suggested, error),
        xytext=(8, 8),
        textcoords="offset points",
        fontsize=TEXT_SIZE,
        color=MUTED,
    )
    ax.set_ylim(bottom=0)
    ax.xaxis.set_major_locator(MaxNLocator(integer=True))
    return line
