"""The picture of Fig. 17: accuracy against the number of a projection."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from spem.paper.moments import Curves
from spem.plots.style import COLOURS, TEXT_SIZE, framed, new_figure

# As the paper has them: blue, red and black.
BINARY, SINGLE, STACKED = COLOURS[0], COLOURS[1], COLOURS[6]


def figure_accuracy(found: Curves) -> Figure:
    """Return a figure of mean accuracies with bands of one standard deviation.

    Examples
    --------
    >>> from spem.paper.moments import curves
    >>> rng = np.random.default_rng(0)
    >>> found = curves(rng.random((8, 7)), rng.random((8, 28)), "aaaabbbb", n_train=2, repeats=2)
    >>> len(figure_accuracy(found).axes[0].lines)
    3
    """
    figure = new_figure(6, 3.6)
    ax = figure.add_subplot()
    number = np.arange(1, len(found.single) + 1)
    lines = (
        ("projections 1 to n together", STACKED, "s", found.stacked),
        ("projection n alone", SINGLE, "o", found.single),
        ("silhouette", BINARY, "", (found.binary,) * number.size),
    )
    for name, colour, marker, each in lines:
        mean = np.array([classification.mean for classification in each])
        deviation = np.array([classification.deviation for classification in each])
        ax.fill_between(number, mean - deviation, mean + deviation, color=colour, alpha=0.12, linewidth=0)
        ax.plot(number, mean, color=colour, marker=marker, markersize=4, linewidth=1.4, label=name)
    framed(ax, "projection n", "accuracy, %")
    ax.set_xticks(number)
    ax.set_ylim(0, 100)
    ax.legend(fontsize=TEXT_SIZE, frameon=False, loc="lower left")
    return figure
