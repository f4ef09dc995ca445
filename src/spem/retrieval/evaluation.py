"""Retrieval scores of the Princeton Shape Benchmark (Shilane, Min, Kazhdan, Funkhouser 2004).

Each shape is a query in turn and all others are ranked for it, nearest first; equal distances are
ranked in order of index. Relevant are the other shapes of its class: R of them.

    NN   whether the first answer is relevant
    FT   relevant among the first R answers, over R
    ST   relevant among the first 2R answers, over R
    E    2 / (1/P + 1/R') with precision P and recall R' of the first 32 answers
    DCG  Σ relevant_i / max(1, log2 i), over the same sum of a perfect ranking

A query that is alone in its class has nothing to find; it is left out of all means and reported.
"""

from __future__ import annotations

from collections.abc import Hashable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from spem.errors import LabelError, ParameterError
from spem.retrieval.distances import rank_others

MEASURES = {
    "NN": "nearest neighbour",
    "FT": "first tier",
    "ST": "second tier",
    "E": "E-measure",
    "DCG": "discounted cumulative gain",
}
E_ANSWERS = 32


@dataclass(frozen=True, eq=False)
class Scores:
    """Retrieval scores of every query.

    Parameters
    ----------
    per_query
        Measure → ``(n,)`` score in [0, 1]; nan for skipped queries.
    labels
        ``(n,)`` class of each query.
    skipped
        Indices of the queries that are alone in their class.
    bulls_eye
        Bull's-eye score of the collection, in percent: see `bulls_eye`.
    """

    per_query: dict[str, NDArray[np.float64]]
    labels: tuple[Hashable, ...]
    skipped: tuple[int, ...]
    bulls_eye: float

    def mean(self) -> dict[str, float]:
        """Return the means over all queries that are not skipped, in percent."""
        return {name: 100 * float(np.nanmean(values)) for name, values in self.per_query.items()}

    def per_class(self) -> dict[Hashable, dict[str, float]]:
        """Return class → measure → mean over its queries, in percent; classes of one are left out."""
        kept = _members(self.labels, self.skipped)
        return {
            label: {name: 100 * float(values[rows].mean()) for name, values in self.per_query.items()}
            for label, rows in kept.items()
        }

    def __repr__(self) -> str:
        means = ", ".join(f"{name} {value:.1f}" for name, value in self.mean().items())
        return f"Scores({len(self.labels)} queries, {len(self.skipped)} skipped: {means})"


@dataclass(frozen=True, eq=False)
class PrecisionRecall:
    """Precision at given recalls.

    Parameters
    ----------
    recall
        ``(n_points,)`` recalls, from ``1 / n_points`` to 1.
    precision
        ``(n_points,)`` mean precision over all queries.
    per_class
        Class → ``(n_points,)`` mean precision over its queries.
    skipped
        Indices of the queries that are alone in their class.
    """

    recall: NDArray[np.float64]
    precision: NDArray[np.float64]
    per_class: dict[Hashable, NDArray[np.float64]]
    skipped: tuple[int, ...]


def evaluate(
    distances: ArrayLike, labels: Sequence[Hashable], *, candidates: ArrayLike | None = None
) -> Scores:
    """Score the ranking that distances give, each shape being a query in turn.

    A query has n - 1 answers, so with fewer than 33 shapes E is of all of these rather than of 32.

    Parameters
    ----------
    distances
        ``(n, n)`` distances, queries along the rows; the diagonal is not looked at.
    labels
        ``(n,)`` class of each shape.
    candidates
        ``(n, n)`` which shapes may answer each query, such as those of its size; all others by default. What
        is to be found are the candidates of its class.

    Returns
    -------
    Scores
        NN, FT, ST, E and DCG of every query, and the bull's-eye score of all.

    Raises
    ------
    ParameterError
        If the matrix is not square, holds nan, or does not fit the labels.
    LabelError
        If no class has two shapes.

    Examples
    --------
    >>> scores = evaluate([[0, 1, 5], [1, 0, 4], [5, 4, 0]], ["cat", "cat", "dog"])
    >>> scores.mean()["NN"], scores.skipped
    (100.0, (2,))
    """
    relevant, total, skipped = _relevance(distances, labels, candidates)
    n, answers = relevant.shape
    hits = relevant.cumsum(axis=1)
    rows, wanted = np.arange(n), np.maximum(total, 1)
    first = min(E_ANSWERS, answers)
    gain = 1 / np.maximum(1.0, np.log2(np.arange(1, answers + 1)))
    scores = {
        "NN": relevant[:, 0].astype(float),
        "FT": hits[rows, wanted - 1] / wanted,
        "ST": hits[rows, np.minimum(2 * wanted, answers) - 1] / wanted,
        "E": 2 * hits[:, first - 1] / (first + wanted),
        "DCG": relevant @ gain / gain.cumsum()[wanted - 1],
    }
    for values in scores.values():
        values[list(skipped)] = np.nan
    return Scores(scores, tuple(labels), skipped, _bulls_eye(relevant, total, skipped))


def bulls_eye(distances: ArrayLike, labels: Sequence[Hashable]) -> float:
    """Return the bull's-eye score, in percent: class members among the first 2C answers, over C.

    C is the size of the class, and the query is counted as its own first answer, as on MPEG-7.

    Parameters
    ----------
    distances
        ``(n, n)`` distances, queries along the rows; the diagonal is not looked at.
    labels
        ``(n,)`` class of each shape.

    Examples
    --------
    >>> bulls_eye([[0, 1, 5], [1, 0, 4], [5, 4, 0]], ["cat", "cat", "dog"])
    100.0
    """
    return _bulls_eye(*_relevance(distances, labels))


def average_precision(distances: ArrayLike, labels: Sequence[Hashable]) -> NDArray[np.float64]:
    """Return the average precision of each query: the mean of the precision at each relevant answer.

    Parameters
    ----------
    distances
        ``(n, n)`` distances, queries along the rows; the diagonal is not looked at.
    labels
        ``(n,)`` class of each shape.

    Returns
    -------
    numpy.ndarray
        ``(n,)`` in [0, 1]; nan for a query that is alone in its class.

    Raises
    ------
    ParameterError, LabelError
        As in `evaluate`.

    Examples
    --------
    >>> average_precision([[0, 1, 2], [1, 0, 3], [2, 3, 0]], ["a", "b", "a"])
    array([0.5, nan, 1. ])
    """
    relevant, total, _ = _relevance(distances, labels)
    precision = relevant.cumsum(axis=1) / np.arange(1, relevant.shape[1] + 1)
    average = (precision * relevant).sum(axis=1) / np.maximum(total, 1)
    return np.asarray(np.where(total > 0, average, np.nan))


def precision_recall(
    distances: ArrayLike, labels: Sequence[Hashable], *, n_points: int = 20
) -> PrecisionRecall:
    """Return precision against recall, averaged over queries.

    The precision of a query is taken where its i-th relevant answer appears, at recall i/R, and
    interpolated linearly between; below recall 1/R it is that of the first relevant answer.

    Parameters
    ----------
    distances
        ``(n, n)`` distances, queries along the rows; the diagonal is not looked at.
    labels
        ``(n,)`` class of each shape.
    n_points
        Number of recalls, evenly spaced up to 1.

    Raises
    ------
    ParameterError
        If `n_points` is below 1, or as in `evaluate`.

    Examples
    --------
    >>> precision_recall([[0, 1, 5], [1, 0, 4], [5, 4, 0]], ["cat", "cat", "dog"], n_points=2).precision
    array([1., 1.])
    """
    if n_points < 1:
        msg = f"n_points must be at least 1, not {n_points}"
        raise ParameterError(msg)
    relevant, total, skipped = _relevance(distances, labels)
    recall = np.arange(1, n_points + 1) / n_points
    kept = _members(labels, skipped)
    curves = np.zeros((len(relevant), n_points))
    for row in np.concatenate(list(kept.values())):
        found = np.arange(1, total[row] + 1)
        precision = found / (np.flatnonzero(relevant[row]) + 1)
        curves[row] = np.interp(recall, found / total[row], precision)
    per_class = {label: curves[rows].mean(axis=0) for label, rows in kept.items()}
    return PrecisionRecall(recall, np.delete(curves, list(skipped), axis=0).mean(axis=0), per_class, skipped)


def _bulls_eye(relevant: NDArray[np.bool_], total: NDArray[np.int64], skipped: tuple[int, ...]) -> float:
    """Return the mean share of each class among its first 2C answers, in percent."""
    n, answers = relevant.shape
    last = np.minimum(2 * (total + 1) - 1, answers)
    score = (1 + relevant.cumsum(axis=1)[np.arange(n), last - 1]) / (total + 1)
    return 100 * float(np.delete(score, list(skipped)).mean())


def _relevance(
    distances: ArrayLike, labels: Sequence[Hashable], candidates: ArrayLike | None = None
) -> tuple[NDArray[np.bool_], NDArray[np.int64], tuple[int, ...]]:
    """Return which ranked answers are relevant ``(n, n - 1)``, how many there are, and lone queries."""
    ranked = np.array(distances, float)
    n = len(labels)
    if ranked.shape != (n, n):
        msg = f"distances of shape {ranked.shape} do not fit {n} labels; a square matrix of them was expected"
        raise ParameterError(msg)
    np.fill_diagonal(ranked, 0.0)
    if np.isnan(ranked).any():
        msg = f"distances hold nan, first in row {np.flatnonzero(np.isnan(ranked).any(axis=1))[0]}"
        raise ParameterError(msg)
    number = {label: i for i, label in enumerate(dict.fromkeys(labels))}
    code = np.array([number[label] for label in labels], np.int64)
    alike = code == code[:, None]
    if candidates is not None:
        allowed = np.asarray(candidates, bool)
        if allowed.shape != (n, n):
            msg = f"candidates of shape {allowed.shape} do not fit {n} labels; expected {(n, n)}"
            raise ParameterError(msg)
        alike, ranked = alike & allowed, np.where(allowed, ranked, np.inf)
    total = alike.sum(axis=1) - alike.diagonal()
    if not total.any():
        among = "" if candidates is None else " among the candidates of one of them"
        msg = f"none of the {len(number)} classes has two shapes{among}, so no query has an answer; "
        raise LabelError(msg + "check the labels")
    order = rank_others(ranked)
    return np.take_along_axis(alike, order, axis=1), total, tuple(np.flatnonzero(total == 0).tolist())


def _members(labels: Sequence[Hashable], skipped: tuple[int, ...]) -> dict[Hashable, NDArray[np.int64]]:
    """Return the indices of each class that has two shapes or more, classes in order of appearance."""
    lone = set(skipped)
    rows: dict[Hashable, list[int]] = {}
    for index, label in enumerate(labels):
        if index not in lone:
            rows.setdefault(label, []).append(index)
    return {label: np.array(members) for label, members in rows.items()}
