"""Retrieval scores."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from spem.errors import LabelError, ParameterError
from spem.retrieval.evaluation import MEASURES, average_precision, bulls_eye, evaluate, precision_recall

LABELS = ["a", "a", "a", "b", "b", "c"]
# Rankings, by hand:  0: 3 1 4 2 5 -> 0 1 0 1 0      3: 0 1 4 2 5 -> 0 0 1 0 0
#                     1: 2 0 3 4 5 -> 1 1 0 0 0      4: 3 0 1 2 5 -> 1 0 0 0 0
#                     2: 3 4 5 0 1 -> 0 0 0 1 1      5: alone
RANKS = [[3, 1, 4, 2, 5], [2, 0, 3, 4, 5], [3, 4, 5, 0, 1], [0, 1, 4, 2, 5], [3, 0, 1, 2, 5], [0, 1, 2, 3, 4]]
L3, L4, L5 = 1 / np.log2(3), 0.5, 1 / np.log2(5)


def from_ranks(ranks: list[list[int]]) -> np.ndarray:
    """Return distances that give these rankings, with a diagonal that would mislead."""
    distances = np.full((len(ranks), len(ranks)), -5.0)
    for query, answers in enumerate(ranks):
        distances[query, answers] = np.arange(len(answers))
        distances[query, query] = query
    return distances


def test_hand_computed_scores():
    """NN, FT, ST, E and DCG of six shapes agree with a calculation by hand."""
    scores = evaluate(from_ranks(RANKS), LABELS)
    assert tuple(scores.per_query) == tuple(MEASURES)
    expected = {
        "NN": [0, 1, 0, 0, 1],
        "FT": [1 / 2, 1, 0, 0, 1],
        "ST": [1, 1, 1 / 2, 0, 1],
        # Five answers in all, so that E = 2 * hits / (5 + R).
        "E": [4 / 7, 4 / 7, 4 / 7, 2 / 6, 2 / 6],
        # Gains 1, 1, 1/log2(3), 1/2, 1/log2(5); two relevant answers are ideally worth 2, one 1.
        "DCG": [(1 + L4) / 2, 2 / 2, (L4 + L5) / 2, L3, 1],
    }
    for name, values in expected.items():
        np.testing.assert_allclose(scores.per_query[name], [*values, np.nan], err_msg=name)
        assert scores.mean()[name] == pytest.approx(100 * np.mean(values))
        assert scores.per_class()["a"][name] == pytest.approx(100 * np.mean(values[:3]))
        assert scores.per_class()["b"][name] == pytest.approx(100 * np.mean(values[3:]))
    assert scores.skipped == (5,)
    assert list(scores.per_class()) == ["a", "b"]


def test_hand_computed_average_precision():
    """The mean of the precision at each relevant answer; nan where there is none to find."""
    position = np.array([0.0, 1, 2, 10, 11, 12, 1.5, 30])
    labels = ["a", "a", "a", "b", "b", "b", "b", "c"]
    quality = average_precision(np.abs(position[:, None] - position), labels)
    assert np.nanargmin(quality) == 6
    assert quality[3] == pytest.approx((1 + 1 + 3 / 4) / 3)
    assert np.flatnonzero(np.isnan(quality)).tolist() == [7]


def test_scores_hold_the_bulls_eye():
    """The scores of a collection have its bull's-eye score beside the measures of each query."""
    distances = np.random.default_rng(3).random((9, 9))
    labels = list("aaabbbbcd")
    assert evaluate(distances, labels).bulls_eye == bulls_eye(distances, labels)


def test_hand_computed_bulls_eye():
    """Members among the first 2C answers, query included, over C."""
    # Class a, C = 3: the query and 5 answers hold all three. Class b, C = 2: the query and 3 answers
    # hold both for queries 3 and 4.
    assert bulls_eye(from_ranks(RANKS), LABELS) == pytest.approx(100)
    ranks = [
        [2, 3, 4, 1, 5],
        [2, 3, 0, 4, 5],
        [3, 0, 1, 4, 5],
        [2, 0, 1, 4, 5],
        [5, 0, 1, 2, 3],
        [0, 1, 2, 4, 3],
    ]
    # C = 2, three answers: queries 0 and 4 find theirs at 4 and 1, 5 at 4; the others within three.
    assert bulls_eye(from_ranks(ranks), ["a", "a", "b", "b", "c", "c"]) == pytest.approx(
        100 * (4 + 2 * 0.5) / 6
    )


def test_hand_computed_precision_recall():
    """Precision at recall i/R is i over the rank of the i-th relevant answer."""
    curve = precision_recall(from_ranks(RANKS), LABELS, n_points=2)
    by_query = np.array([[1 / 2, 2 / 4], [1, 1], [1 / 4, 2 / 5], [1 / 3, 1 / 3], [1, 1]])
    np.testing.assert_allclose(curve.recall, [0.5, 1])
    np.testing.assert_allclose(curve.precision, by_query.mean(axis=0))
    np.testing.assert_allclose(curve.per_class["a"], by_query[:3].mean(axis=0))
    assert curve.skipped == (5,)
    between = precision_recall(from_ranks(RANKS), LABELS, n_points=4).per_class["a"]
    np.testing.assert_allclose(between[2], by_query[:3].mean())


def test_ties_are_ranked_by_index():
    """Where all distances are equal the answers come in order of index."""
    scores = evaluate(np.zeros((4, 4)), ["a", "b", "a", "b"])
    np.testing.assert_array_equal(scores.per_query["NN"], [0, 0, 1, 0])
    infinite = evaluate(np.full((4, 4), np.inf), ["a", "b", "a", "b"])
    np.testing.assert_array_equal(infinite.per_query["NN"], [0, 0, 1, 0])


def test_perfect_ranking_is_a_hundred_and_e_has_its_ceiling():
    """Classes of twenty ranked perfectly give 100 but for E, whose ceiling is 74.51."""
    labels = np.repeat(np.arange(5), 20)
    distances = (labels[:, None] != labels).astype(float)
    mean = evaluate(distances, labels.tolist()).mean()
    assert mean.pop("E") == pytest.approx(200 * 19 / (32 + 19))
    assert mean == pytest.approx(dict.fromkeys(mean, 100))
    assert bulls_eye(distances, labels.tolist()) == pytest.approx(100)
    np.testing.assert_allclose(precision_recall(distances, labels.tolist()).precision, 1)


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 2**32 - 1), st.integers(3, 40))
def test_order_of_shapes_and_monotone_maps_change_nothing(seed, n):
    """Scores are those of the shapes, whatever their order, and of the ranking alone."""
    rng = np.random.default_rng(seed)
    labels = rng.integers(0, max(2, n // 4), n)
    labels[:2] = 0
    distances = rng.random((n, n))
    scores = evaluate(distances, labels.tolist())
    order = rng.permutation(n)
    shuffled = evaluate(distances[np.ix_(order, order)], labels[order].tolist())
    bent = evaluate(np.exp(5 * distances) - 7, labels.tolist())
    for name in MEASURES:
        np.testing.assert_allclose(shuffled.per_query[name], scores.per_query[name][order])
        np.testing.assert_array_equal(bent.per_query[name], scores.per_query[name])
        kept = scores.per_query[name][~np.isnan(scores.per_query[name])]
        assert ((kept >= 0) & (kept <= 1 + 1e-12)).all()
    assert scores.mean()["FT"] <= scores.mean()["ST"] + 1e-9


def test_a_class_of_one_counts_as_a_wrong_answer_only():
    """A lone shape is skipped as a query and still stands in the way of others."""
    distances = np.array([[0, 2, 1], [2, 0, 3], [1, 3, 0.0]])
    scores = evaluate(distances, ["a", "a", "b"])
    assert scores.skipped == (2,)
    assert scores.mean()["NN"] == 50


def test_bad_input_is_refused():
    """Matrices that do not fit the labels, nan and labels without a pair are refused."""
    with pytest.raises(ParameterError, match="do not fit 3 labels"):
        evaluate(np.zeros((2, 3)), ["a", "a", "b"])
    with pytest.raises(ParameterError, match="nan, first in row 1"):
        evaluate([[0, 1.0], [np.nan, 0]], ["a", "a"])
    with pytest.raises(LabelError, match="none of the 2 classes has two shapes"):
        evaluate(np.zeros((2, 2)), ["a", "b"])
    with pytest.raises(LabelError, match="none of the 0 classes"):
        evaluate(np.zeros((0, 0)), [])
    with pytest.raises(ParameterError, match="n_points must be at least 1"):
        precision_recall(np.zeros((2, 2)), ["a", "a"], n_points=0)


def test_nan_on_the_diagonal_is_not_looked_at():
    """A method that leaves the diagonal undefined is scored all the same."""
    assert evaluate([[np.nan, 1], [1, np.nan]], ["a", "a"]).mean()["NN"] == 100
