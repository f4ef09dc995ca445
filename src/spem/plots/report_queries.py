"""The queries of a report that were answered worst and best."""

from __future__ import annotations

from collections import Counter
from typing import TYPE_CHECKING

import numpy as np

from spem.plots.markup import section, text
from spem.plots.report_gallery import Gallery

if TYPE_CHECKING:
    from numpy.typing import NDArray

N_QUERIES = 6
N_ANSWERS = 8
QUERIES_OF_A_CLASS = 2


def queries_section(gallery: Gallery, distances: NDArray[np.float64] | None) -> str:
    """Return the queries answered worst and best, with their first answers.

    Examples
    --------
    >>> queries_section(Gallery([], None, []), None)
    ''
    """
    if distances is None or gallery.labels is None:
        return ""
    labels = np.asarray(gallery.labels)
    quality = average_precisions(distances, labels)
    order = [int(i) for i in np.argsort(quality, kind="stable") if np.isfinite(quality[i])]
    if not order:
        return ""
    n_each = min(N_QUERIES, max(1, len(order) // 2))
    worst, best = (
        [_query(gallery, distances, labels, i, quality[i]) for i in _varied(ranked, labels)[:n_each]]
        for ranked in (order, order[::-1])
    )
    legend = (
        '<p class="note">✓ same class as the query, ✗ another class. Ordered by average precision, the'
        " mean of the precision at each shape of the query's class.</p>"
    )
    return section(
        "Queries",
        legend,
        f"<h3>Answered worst</h3>\n{''.join(worst)}",
        f"<h3>Answered best</h3>\n{''.join(best)}" if len(order) > 1 else "",
    )


def average_precisions(distances: NDArray[np.float64], labels: NDArray[np.str_]) -> NDArray[np.float64]:
    """Return the average precision of each shape as a query to all others.

    Parameters
    ----------
    distances
        ``(n, n)`` distances.
    labels
        ``(n,)`` classes.

    Returns
    -------
    precision
        ``(n,)`` in 0 to 1; NaN where no other shape has the query's class.

    Examples
    --------
    >>> d = np.array([[0, 1, 2.0], [1, 0, 3], [2, 3, 0]])
    >>> average_precisions(d, np.array(["a", "b", "a"]))
    array([0.5, nan, 1. ])
    """
    precision = np.full(len(labels), np.nan)
    for i in range(len(labels)):
        right = np.flatnonzero(labels[_answers(distances[i], i)] == labels[i])
        if right.size:
            precision[i] = np.mean(np.arange(1, right.size + 1) / (right + 1))
    return precision


def _varied(ranked: list[int], labels: NDArray[np.str_]) -> list[int]:
    """Keep the first few queries of each class, so that one class does not fill the list."""
    taken: Counter[str] = Counter()
    kept = []
    for i in ranked:
        taken[str(labels[i])] += 1
        if taken[str(labels[i])] <= QUERIES_OF_A_CLASS:
            kept.append(i)
    return kept


def _query(
    gallery: Gallery, distances: NDArray[np.float64], labels: NDArray[np.str_], query: int, quality: float
) -> str:
    """One query and its first answers, right and wrong ones told apart by sign and frame."""
    answers = []
    for i in _answers(distances[query], query)[:N_ANSWERS]:
        right = labels[i] == labels[query]
        kind, sign, said = ("right", "✓", "same class") if right else ("wrong", "✗", "another class")
        mark = f'<span class="mark" role="img" aria-label="{said}">{sign}</span> '
        answers.append(f'<li class="{kind}">{gallery.tile(int(i), mark)}</li>')
    return (
        f'<div class="query"><div class="asked">{gallery.tile(query)}'
        f"<p>{text(labels[query])}<br><small>{100 * quality:.0f} %</small></p></div>"
        f"<ol>{''.join(answers)}</ol></div>\n"
    )


def _answers(distance: NDArray[np.float64], query: int) -> NDArray[np.int64]:
    """Numbers of the other shapes, nearest first; ties in the order of the collection."""
    order = np.argsort(distance, kind="stable")
    others: NDArray[np.int64] = order[order != query]
    return others
