"""The queries of a report that were answered worst and best."""

from __future__ import annotations

from collections import Counter
from typing import TYPE_CHECKING

import numpy as np

from spem.plots.markup import section, text
from spem.plots.report_gallery import Gallery
from spem.retrieval.distances import rank_others
from spem.retrieval.evaluation import average_precision

if TYPE_CHECKING:
    from numpy.typing import NDArray

N_QUERIES = 6
N_ANSWERS = 8
# Answers of imperfect queries shown beyond as many as their class has: what comes later says little.
FURTHER_ANSWERS = 2
PERFECT = 1 - 1e-9
PRAISE = "<p>Every query was answered perfectly: all of its class came first.</p>"
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
    if max(Counter(gallery.labels).values(), default=0) < 2:
        return ""
    quality, answers = average_precision(distances, gallery.labels), rank_others(distances)
    order = [int(i) for i in np.argsort(quality, kind="stable") if np.isfinite(quality[i])]
    n_each = min(N_QUERIES, max(1, len(order) // 2))
    imperfect = [i for i in order if quality[i] < PERFECT]
    worst, best = (
        [_query(gallery, answers[i], labels, i, quality[i]) for i in _varied(ranked, labels)[:n_each]]
        for ranked in (imperfect, order[::-1])
    )
    legend = (
        '<p class="note">✓ same class as the query, ✗ another class. Ordered by average precision, the'
        " mean of the precision at each shape of the query's class.</p>"
    )
    return section(
        "Queries",
        legend,
        f"<h3>Answered worst</h3>\n{''.join(worst)}" if worst else PRAISE,
        f"<h3>Answered best</h3>\n{''.join(best)}" if len(order) > 1 else "",
    )


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
    gallery: Gallery, ranked: NDArray[np.int64], labels: NDArray[np.str_], query: int, quality: float
) -> str:
    """One query and its first answers, right and wrong ones told apart by sign and frame."""
    answers = []
    relevant = int(np.count_nonzero(labels == labels[query])) - 1
    further = FURTHER_ANSWERS if quality < PERFECT else 0
    for i in ranked[: min(N_ANSWERS, relevant + further)]:
        right = labels[i] == labels[query]
        kind, sign, said = ("right", "✓", "same class") if right else ("wrong", "✗", "another class")
        mark = f'<span class="mark" role="img" aria-label="{said}">{sign}</span> '
        answers.append(f'<li class="{kind}">{gallery.tile(int(i), mark)}</li>')
    return (
        f'<div class="query"><div class="asked"><p>class {text(labels[query])}</p>{gallery.tile(query)}'
        f"<p><small>{_share(quality)}</small></p></div>"
        f"<ol>{''.join(answers)}</ol></div>\n"
    )


def _share(quality: float) -> str:
    """Average precision as a percentage; 100 % is said of perfect ones only."""
    percent = 100 * quality
    return f"{percent:.0f} %" if quality >= PERFECT else f"{min(percent, 99.9):.3g} %"
