"""Precision against recall."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

from spem.errors import ParameterError
from spem.plots.style import COLOURS, DASHES, TEXT_SIZE, framed

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.lines import Line2D

    from spem.retrieval.evaluation import PrecisionRecall


def draw_precision_recall(curves: PrecisionRecall | Mapping[str, PrecisionRecall], ax: Axes) -> list[Line2D]:
    """Draw one precision-recall curve, or several with their names.

    Parameters
    ----------
    curves
        A curve, or curves by name.
    ax
        Axis to draw on.

    Raises
    ------
    ParameterError
        If there is no curve.

    Examples
    --------
    >>> from types import SimpleNamespace
    >>> from spem.plots.style import new_figure
    >>> curve = SimpleNamespace(recall=[0.5, 1.0], precision=[1.0, 0.6])
    >>> [line] = draw_precision_recall(curve, new_figure(3, 3).add_subplot())
    >>> line.get_ydata().tolist()
    [1.0, 0.6]
    """
    named = curves if isinstance(curves, Mapping) else {"": curves}
    if not named:
        msg = "no precision-recall curve to draw"
        raise ParameterError(msg)
    lines = [
        ax.plot(
            curve.recall,
            curve.precision,
            color=COLOURS[i % len(COLOURS)],
            linestyle=DASHES[i // len(COLOURS) % len(DASHES)],
            linewidth=1.6,
            label=name or "_",
            clip_on=False,
        )[0]
        for i, (name, curve) in enumerate(named.items())
    ]
    framed(ax, "recall", "precision")
    ax.set_xlim(0, 1)
    ax.set_ylim(0, 1.02)
    ax.set_aspect("equal")
    if any(named):
        ax.legend(loc="lower left", fontsize=TEXT_SIZE, frameon=False)
    return lines
