"""Distances between shapes by class: within, between, and whether the nearest shape is kin (Fig. 18)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, eq=False)
class ClassDistances:
    """What distances say of classes.

    Parameters
    ----------
    classes
        The classes, sorted.
    distances
        ``(n_classes, n_classes)`` mean distance of two different shapes of two classes, or of one.
    nearest
        Share of the shapes whose nearest other one is of the same class.
    apart
        For each class, whether that holds of all of its shapes.

    Examples
    --------
    >>> points = np.array([0.0, 1.0, 5.0, 6.0])
    >>> found = ClassDistances.of(np.abs(points[:, None] - points), ["a", "a", "b", "b"])
    >>> found.within, found.between, found.nearest, found.pair("a", "b")
    (1.0, 5.0, 1.0, (5.0, 1, True))
    """

    classes: tuple[str, ...]
    distances: NDArray[np.float64]
    nearest: float
    apart: tuple[bool, ...]

    @classmethod
    def of(cls, distances: NDArray[np.float64], labels: Sequence[str]) -> ClassDistances:
        """Sum up the distances ``(n, n)`` of shapes by their labels; two shapes a class at least."""
        label = np.asarray(labels)
        classes = np.unique(label)
        alone = np.where(np.eye(len(label), dtype=bool), np.nan, distances)
        mean = [[np.nanmean(alone[np.ix_(label == a, label == b)]) for b in classes] for a in classes]
        kin = label[np.nanargmin(alone, axis=1)] == label
        return cls(
            tuple(map(str, classes)),
            np.array(mean),
            float(kin.mean()),
            tuple(bool(kin[label == a].all()) for a in classes),
        )

    @property
    def within(self) -> float:
        """Mean distance within a class, over classes."""
        return float(np.diag(self.distances).mean())

    @property
    def between(self) -> float:
        """Mean distance between two classes, over pairs of classes."""
        return float(self._pairs.mean())

    def pair(self, first: str, second: str) -> tuple[float, int, bool]:
        """Return the distance of two classes, its rank among all pairs of them, and if both are apart."""
        a, b = self.classes.index(first), self.classes.index(second)
        distance = float(self.distances[a, b])
        return distance, 1 + int((self._pairs < distance).sum()), self.apart[a] and self.apart[b]

    @property
    def _pairs(self) -> NDArray[np.float64]:
        """Distances of every two different classes."""
        return np.asarray(self.distances[np.triu_indices(len(self.classes), 1)])
