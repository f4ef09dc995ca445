"""Classification of codes: repeated splits into training and test shapes, and a linear SVM (5.4)."""

from __future__ import annotations

from collections.abc import Hashable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from spem.codes.arguments import whole_number
from spem.errors import LabelError, ParameterError


@dataclass(frozen=True, eq=False)
class Classification:
    """How often shapes were given their class, over several splits.

    Parameters
    ----------
    classes
        The classes, in order of appearance.
    accuracies
        ``(repeats,)`` share of the test shapes that was given their class, in [0, 1].
    confusion
        ``(n_classes, n_classes)`` number of test shapes of the class of the row that were given the class of
        the column, over all splits.
    errors
        ``(n_shapes,)`` share of its tests in which a shape was given another class; nan where it was in no
        test.
    n_train
        Number of training shapes of each class.
    """

    classes: tuple[Hashable, ...]
    accuracies: NDArray[np.float64]
    confusion: NDArray[np.int64]
    errors: NDArray[np.float64]
    n_train: int

    @property
    def mean(self) -> float:
        """Mean accuracy over the splits, in percent."""
        return 100 * float(self.accuracies.mean())

    @property
    def deviation(self) -> float:
        """Standard deviation of the accuracy from split to split, in percentage points; 0 of one split."""
        return 100 * float(self.accuracies.std(ddof=1)) if self.accuracies.size > 1 else 0.0

    def per_class(self) -> dict[Hashable, float]:
        """Return class → share of its test shapes that was given it, in percent."""
        right = 100 * self.confusion.diagonal() / self.confusion.sum(axis=1)
        return dict(zip(self.classes, right.tolist(), strict=True))

    def mistaken(self) -> list[tuple[Hashable, Hashable, int]]:
        """Return class, the class taken for it, and how often, the most frequent first."""
        wrong = self.confusion - np.diag(self.confusion.diagonal())
        order = np.argsort(-wrong, axis=None, kind="stable")[: np.count_nonzero(wrong)]
        pairs = zip(*np.unravel_index(order, wrong.shape), strict=True)
        return [(self.classes[row], self.classes[column], int(wrong[row, column])) for row, column in pairs]

    def __repr__(self) -> str:
        splits = f"{self.accuracies.size} splits, {self.n_train} shapes of each class for training"
        return (
            f"Classification({len(self.classes)} classes, {splits}: {self.mean:.1f} ± {self.deviation:.1f} %)"
        )


def classify_vectors(
    vectors: ArrayLike,
    labels: Sequence[Hashable],
    *,
    n_train: int = 10,
    repeats: int = 10,
    classifier: Any = None,
    rng: np.random.Generator | None = None,
) -> Classification:
    """Train a classifier on some shapes of each class and test it on the others, several times.

    Parameters
    ----------
    vectors
        ``(n_shapes, n_code)`` one vector a shape.
    labels
        ``(n_shapes,)`` class of each shape.
    n_train
        Number of shapes drawn from each class for training; all others are tests.
    repeats
        Number of splits.
    classifier
        A classifier of scikit-learn, fitted anew to the training shapes of each split; see `linear_svm` for
        the default.
    rng
        Draws the splits; seed 0 by default, so that codes of the same shapes are tested on the same splits.

    Raises
    ------
    LabelError
        When there are fewer than two classes, one has no shape left to test, or a label is None or NaN.
    ParameterError
        When vectors and labels do not fit, vectors are not finite, or a number is below 1.

    Examples
    --------
    >>> vectors = [[0.0, 0.1], [0.1, 0.0], [0.0, 0.0], [5.0, 5.1], [5.1, 5.0], [5.0, 5.0]]
    >>> found = classify_vectors(vectors, ["cat"] * 3 + ["dog"] * 3, n_train=2, repeats=4)
    >>> found.mean, found.per_class()
    (100.0, {'cat': 100.0, 'dog': 100.0})
    """
    from sklearn.base import clone

    values = _checked(vectors, labels, n_train, repeats)
    classes = tuple(dict.fromkeys(labels))
    number = {label: i for i, label in enumerate(classes)}
    code = np.array([number[label] for label in labels], np.int64)
    _check_sizes(code, classes, n_train)
    drawing = np.random.default_rng(0) if rng is None else rng
    model = linear_svm() if classifier is None else classifier
    confusion, accuracies = np.zeros((len(classes),) * 2, np.int64), []
    tested, wrong = np.zeros(len(code)), np.zeros(len(code))
    for train, test in split(code, n_train, repeats, drawing):
        given = clone(model).fit(values[train], code[train]).predict(values[test])
        accuracies.append(float((given == code[test]).mean()))
        np.add.at(confusion, (code[test], given), 1)
        tested[test] += 1
        wrong[test] += given != code[test]
    errors = np.divide(wrong, tested, out=np.full(len(code), np.nan), where=tested > 0)
    return Classification(classes, np.array(accuracies), confusion, errors, n_train)


def linear_svm(blocks: Sequence[int] = (), *, penalty: float = 1.0) -> Any:
    """Return a linear support vector machine on standardised entries, one class against one.

    Where vectors have more entries than there are training shapes, as codes have, these are told apart
    without an error, and a larger `penalty` gives the same machine. It counts where vectors are short.

    Parameters
    ----------
    blocks
        Lengths of the kinds of codes that vectors are made of, one beside the other. Each is brought to unit
        length once its entries are standardised, so that a long kind of code weighs no more than a short one.
    penalty
        What an error in training costs.

    Examples
    --------
    >>> linear_svm().fit([[0.0], [1.0], [4.0], [5.0]], [0, 0, 1, 1]).predict([[0.5], [4.5]])
    array([0, 1])
    >>> vectors = [[0.0, 1.0, 3.0], [1.0, 0.0, 2.5], [4.0, 5.0, 0.0], [5.0, 4.0, 0.5]]
    >>> linear_svm(blocks=(2, 1)).fit(vectors, [0, 0, 1, 1]).predict(vectors)
    array([0, 0, 1, 1])
    """
    from sklearn.compose import ColumnTransformer
    from sklearn.pipeline import make_pipeline
    from sklearn.preprocessing import Normalizer, StandardScaler
    from sklearn.svm import SVC

    machine = SVC(kernel="linear", C=penalty)
    if not blocks:
        return make_pipeline(StandardScaler(), machine)
    ends = np.cumsum([0, *blocks]).tolist()
    parts = [(f"block {i}", Normalizer(), slice(*ends[i : i + 2])) for i in range(len(blocks))]
    return make_pipeline(StandardScaler(), ColumnTransformer(parts), machine)


def split(
    labels: Sequence[Hashable] | NDArray[Any], n_train: int, repeats: int, rng: np.random.Generator
) -> Iterator[tuple[NDArray[np.int64], NDArray[np.int64]]]:
    """Draw splits with the same number of training shapes in each class.

    Parameters
    ----------
    labels
        ``(n_shapes,)`` class of each shape.
    n_train
        Number of training shapes of each class.
    repeats
        Number of splits.
    rng
        Draws them.

    Yields
    ------
    tuple
        Rows of the training shapes and of the others, ascending.

    Examples
    --------
    >>> [(train, test)] = split(["cat"] * 3 + ["dog"] * 2, 1, 1, np.random.default_rng(0))
    >>> len(train), len(test)
    (2, 3)
    """
    members: dict[Hashable, list[int]] = {}
    for row, label in enumerate(labels.tolist() if isinstance(labels, np.ndarray) else labels):
        members.setdefault(label, []).append(row)
    for _ in range(repeats):
        train = np.zeros(len(labels), bool)
        for rows in members.values():
            train[rng.permutation(rows)[:n_train]] = True
        yield np.flatnonzero(train), np.flatnonzero(~train)


def _checked(
    vectors: ArrayLike, labels: Sequence[Hashable], n_train: int, repeats: int
) -> NDArray[np.float64]:
    """Check vectors against labels, and numbers against their range."""
    try:
        values = np.asarray(vectors, np.float64)
        unlabelled = [row for row, label in enumerate(labels) if label is None or _is_nan(label)]
    except (TypeError, ValueError) as error:
        msg = f"expected numbers, one vector a shape, and labels that can be compared: {error}"
        raise ParameterError(msg) from error
    if unlabelled:
        msg = f"row {unlabelled[0]} has no label ({labels[unlabelled[0]]}); give it one, or leave it out"
        raise LabelError(msg)
    if values.ndim != 2 or not values.shape[1] or len(values) != len(labels) or not np.isfinite(values).all():
        msg = f"vectors of shape {values.shape} for {len(labels)} labels: expected one finite vector a label"
        raise ParameterError(msg)
    for name, number in {"n_train": n_train, "repeats": repeats}.items():
        whole_number(name, number)
    return values


def _is_nan(label: Hashable) -> bool:
    """Tell labels that are no number, as tables have where one is missing; a label must be hashable."""
    hash(label)
    return isinstance(label, float) and label != label


def _check_sizes(code: NDArray[np.int64], classes: Sequence[Hashable], n_train: int) -> None:
    """Refuse classes of which no shape would be left to test."""
    counts = np.bincount(code)
    smallest = int(counts.argmin()) if counts.size else 0
    if len(classes) < 2:
        msg = f"{len(classes)} class: expected two or more to tell apart; check the labels"
        raise LabelError(msg)
    if counts[smallest] <= n_train:
        msg = (
            f"class {classes[smallest]!r} has {counts[smallest]} shapes; "
            f"expected more than the {n_train} for training; train on fewer"
        )
        raise LabelError(msg)
