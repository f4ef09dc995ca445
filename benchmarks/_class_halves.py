"""Choosing on one half of the classes and reporting on the other: what a choice among settings is worth.

Scores of a whole collection pick their own best setting. Here the classes are split in two at random, again
and again; the setting of the best first tier among the shapes of one half is scored among those of the other,
which had no say. All settings see the same halves.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spem.retrieval.evaluation import evaluate

Array = NDArray[Any]
SPLITS, RESAMPLES = 10, 2000


@dataclass(frozen=True)
class Choice:
    """What was chosen on one half of the classes, and what it gave on the other.

    Parameters
    ----------
    setting
        Name of the setting of the best FT on the half that chose.
    chosen
        Its FT there.
    reported
        Its FT on the other half.
    default
        FT of the default on the other half.
    gain
        Mean difference of the two on the half that chose.
    """

    setting: str
    chosen: float
    reported: float
    default: float
    gain: float


def first_tier(distances: Sequence[Array], labels: Array) -> Array:
    """Return the FT of each query in percent, mean over distance matrices of several seeds."""
    found = [evaluate(matrix, labels.tolist()).per_query["FT"] for matrix in distances]
    return np.asarray(100 * np.mean(found, axis=0))


def by_class(values: Array, labels: Array) -> Array:
    """Return the mean of each class."""
    return np.array([values[labels == label].mean() for label in np.unique(labels)])


def error_of_classes(values: Array, labels: Array) -> float:
    """Return the standard error of the mean under another draw of classes."""
    means = by_class(values, labels)
    drawn = np.random.default_rng(0).choice(means, (RESAMPLES, means.size))
    return float(drawn.mean(axis=1).std())


def choices(
    distances: Mapping[str, Sequence[Array]], labels: Array, default: str, splits: int = SPLITS
) -> list[Choice]:
    """Choose among settings on one half of the classes and score on the other, each half choosing once.

    Parameters
    ----------
    distances
        Setting → distance matrices of all shapes, one a seed; their vocabularies hold none of the shapes.
    labels
        Class of each shape.
    default
        The setting to compare with.
    splits
        Number of draws, each of two halves.
    """
    classes, found = np.unique(labels), []
    for split in range(splits):
        order = np.random.default_rng(split).permutation(classes)
        halves = [np.isin(labels, part) for part in np.array_split(order, 2)]
        scores = [
            {name: _score(matrices, labels, half) for name, matrices in distances.items()} for half in halves
        ]
        for here, there in (scores, scores[::-1]):
            best = max(here, key=lambda name: here[name])
            gain = here[best] - here[default]
            found.append(Choice(best, here[best], there[best], there[default], gain))
    return found


def _score(matrices: Sequence[Array], labels: Array, half: Array) -> float:
    """Return the mean FT when only the shapes of some classes are searched."""
    return float(first_tier([matrix[np.ix_(half, half)] for matrix in matrices], labels[half]).mean())
