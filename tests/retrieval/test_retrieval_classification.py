"""Repeated splits of vectors into training and test shapes."""

from __future__ import annotations

import numpy as np
import pytest
from sklearn.neighbors import KNeighborsClassifier

from spem.errors import LabelError, ParameterError
from spem.retrieval.classification import Classification, classify_vectors, linear_svm, split

LABELS = ["cat"] * 6 + ["dog"] * 8 + ["cow"] * 5


def apart(noise: float = 0.05) -> np.ndarray:
    """Vectors of three classes, each near an axis of its own."""
    rng = np.random.default_rng(1)
    axis = {label: i for i, label in enumerate(dict.fromkeys(LABELS))}
    return np.eye(3)[[axis[label] for label in LABELS]] + noise * rng.standard_normal((len(LABELS), 3))


def test_classes_apart_are_told_apart():
    """Every test shape is given its class, in every split."""
    found = classify_vectors(apart(), LABELS, n_train=3, repeats=5)
    assert (found.mean, found.deviation) == (100.0, 0.0)
    assert found.classes == ("cat", "dog", "cow")
    assert found.confusion.tolist() == [[15, 0, 0], [0, 25, 0], [0, 0, 10]]
    assert found.mistaken() == []
    assert np.nanmax(found.errors) == 0


def test_a_shape_with_the_wrong_label_is_the_error():
    """It is wrong whenever it is tested, and the confusion says what for."""
    labels = [*LABELS]
    labels[0] = "dog"
    found = classify_vectors(apart(), labels, n_train=4, repeats=20, classifier=KNeighborsClassifier(3))
    assert found.errors[0] == 1.0
    assert found.mistaken()[0][:2] == ("dog", "cat")
    assert found.per_class()["dog"] < 100.0


def test_figures_follow_from_the_confusion():
    """Mean, accuracy of classes and errors of shapes count the same tests."""
    vectors = np.random.default_rng(0).standard_normal((len(LABELS), 4))
    found = classify_vectors(vectors, LABELS, n_train=2, repeats=7)
    right, total = found.confusion.diagonal().sum(), found.confusion.sum()
    assert total == 7 * (len(LABELS) - 3 * 2)
    assert found.mean == pytest.approx(100 * right / total)
    assert sum(count for *_, count in found.mistaken()) == total - right
    assert found.deviation == pytest.approx(100 * found.accuracies.std(ddof=1))
    assert "7 splits, 2 shapes of each class" in repr(found)


def test_splits_have_as_many_of_each_class():
    """Training and test rows are disjoint, cover all, and differ from split to split."""
    seen = set()
    for train, test in split(LABELS, 4, 6, np.random.default_rng(0)):
        assert np.array_equal(np.sort(np.concatenate([train, test])), np.arange(len(LABELS)))
        assert all(sum(LABELS[i] == label for i in train) == 4 for label in set(LABELS))
        seen.add(tuple(train))
    assert len(seen) == 6


def test_default_splits_are_the_same_for_all_codes():
    """Codes of the same shapes are compared on the same splits; another generator draws others."""
    vectors = np.random.default_rng(0).standard_normal((len(LABELS), 4))
    first, again = (classify_vectors(vectors, LABELS, n_train=2) for _ in range(2))
    other = classify_vectors(vectors, LABELS, n_train=2, rng=np.random.default_rng(5))
    assert np.array_equal(first.confusion, again.confusion)
    assert not np.array_equal(first.accuracies, other.accuracies)


def test_scale_of_entries_does_not_count():
    """The default classifier standardises what it is given."""
    vectors = apart(0.5)
    plain = classify_vectors(vectors, LABELS, n_train=3)
    scaled = classify_vectors(vectors * [1.0, 100.0, 0.01] + 3.0, LABELS, n_train=3)
    assert np.array_equal(plain.confusion, scaled.confusion)


def test_blocks_weigh_the_same_however_long():
    """A code that knows the class is heard beside a hundred times longer one that does not."""
    noise = np.random.default_rng(2).standard_normal((len(LABELS), 300))
    vectors = np.hstack([noise, apart()])
    plain = classify_vectors(vectors, LABELS, n_train=3)
    blocks = classify_vectors(vectors, LABELS, n_train=3, classifier=linear_svm((300, 3)))
    assert blocks.mean > 90 > plain.mean


def test_one_split_has_no_deviation():
    """A single accuracy deviates by nothing, and shapes that were in no test have no error."""
    found = classify_vectors(apart(), LABELS, n_train=4, repeats=1)
    assert found.deviation == 0.0
    assert np.isnan(found.errors).sum() == 12


def test_arguments_that_do_not_fit_are_refused():
    """Classes too small, one class alone, other numbers of vectors, not finite, no split."""
    with pytest.raises(LabelError, match="class 'cow' has 5 shapes; expected more than the 5"):
        classify_vectors(apart(), LABELS, n_train=5)
    with pytest.raises(LabelError, match="1 class: expected two"):
        classify_vectors(apart(), ["cat"] * len(LABELS), n_train=2)
    with pytest.raises(ParameterError, match="for 2 labels: expected one finite vector"):
        classify_vectors(apart(), ["cat", "dog"])
    with pytest.raises(ParameterError, match="one finite vector"):
        classify_vectors(np.full((len(LABELS), 2), np.nan), LABELS, n_train=2)
    with pytest.raises(ParameterError, match="repeats=0 must be a whole number of at least 1"):
        classify_vectors(apart(), LABELS, repeats=0)


def test_a_perfect_classification_is_written_in_percent():
    """As all scores are."""
    found = Classification(("a", "b"), np.array([1.0, 0.5]), np.eye(2, dtype=np.int64), np.zeros(2), 1)
    assert (found.mean, found.per_class()) == (75.0, {"a": 100.0, "b": 100.0})


@pytest.mark.parametrize("missing", [None, float("nan"), np.nan])
def test_missing_labels_are_no_class(missing):
    """As an empty cell of a table is read."""
    with pytest.raises(LabelError, match="row 1 has no label"):
        classify_vectors(apart(), [LABELS[0], missing, *LABELS[2:]])


@pytest.mark.parametrize("name", ["n_train", "repeats"])
@pytest.mark.parametrize("number", [0, 1.5, True, None, "2"])
def test_numbers_of_splits_are_whole(name, number):
    """One at least."""
    with pytest.raises(ParameterError, match=f"{name}=.* must be a whole number of at least 1"):
        classify_vectors(apart(), LABELS, **{name: number})


def test_vectors_of_words_and_labels_of_lists_are_refused():
    """And vectors without an entry."""
    for vectors, labels in (
        ("words", LABELS),
        (apart(), [[label] for label in LABELS]),
        (apart()[:, :0], LABELS),
    ):
        with pytest.raises(ParameterError, match="expected"):
            classify_vectors(vectors, labels)
