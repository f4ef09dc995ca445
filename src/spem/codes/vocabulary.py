"""The vocabulary: k-means centres of node features, and the residuals of nodes from them (5.1, 5.2)."""

from __future__ import annotations

import warnings
from dataclasses import dataclass
from typing import Any, Self

import numpy as np
from numba import njit
from numpy.random import RandomState
from numpy.typing import ArrayLike, NDArray
from sklearn.base import BaseEstimator, OneToOneFeatureMixin, TransformerMixin
from sklearn.cluster import KMeans
from sklearn.exceptions import ConvergenceWarning
from sklearn.utils.validation import check_is_fitted, validate_data

from spem.errors import ParameterError


@njit(cache=True, nogil=True, fastmath={"contract"})
def _nearest(features: NDArray[Any], columns: NDArray[Any], labels: NDArray[np.int32]) -> None:
    """Write the index of each row's nearest centre; centres are columns, so that they are the lanes."""
    n_features, n_centers = columns.shape
    distance = np.empty(n_centers, columns.dtype)
    for i in range(features.shape[0]):
        distance[:] = 0
        for j in range(n_features):
            x = features[i, j]
            for c in range(n_centers):
                distance[c] += (x - columns[j, c]) * (x - columns[j, c])
        best = 0
        for c in range(1, n_centers):
            if distance[c] < distance[best]:
                best = c
        labels[i] = best


@njit(cache=True, nogil=True)
def _accumulate(
    features: NDArray[Any],
    centers: NDArray[Any],
    labels: NDArray[np.int32],
    levels: NDArray[np.int64],
    counts: NDArray[np.int64],
    sums: NDArray[np.float64],
    squares: NDArray[np.float64],
) -> None:
    """Add each row's difference from its centre, and its square, to what that centre has at its level."""
    for i in range(features.shape[0]):
        c = labels[i]
        row = levels[i] * centers.shape[0] + c
        counts[row] += 1
        for j in range(features.shape[1]):
            difference = np.float64(features[i, j]) - centers[c, j]
            sums[row, j] += difference
            squares[row, j] += difference * difference


def nearest_centers(features: NDArray[np.floating], centers: NDArray[np.floating]) -> NDArray[np.int32]:
    """Assign each node to its nearest centre (5.1); of equally near ones the first.

    Parameters
    ----------
    features
        ``(n_nodes, n_features)``; distances are computed in its precision.
    centers
        ``(n_centers, n_features)``.

    Returns
    -------
    NDArray
        ``(n_nodes,)`` index of the centre.

    Examples
    --------
    >>> nearest_centers(np.array([[0.1], [0.9]]), np.array([[0.0], [1.0]]))
    array([0, 1], dtype=int32)
    """
    rows = np.ascontiguousarray(features)
    labels = np.empty(len(rows), np.int32)
    _nearest(rows, np.ascontiguousarray(centers.T, rows.dtype), labels)
    return labels


@dataclass(frozen=True, eq=False)
class Residuals:
    """What the nodes of one shape differ from their centres by, summed centre by centre.

    Nodes of several levels are summed apart: n_rows is n_levels · n_centers, level after level.

    Parameters
    ----------
    counts
        ``(n_rows,)`` number of nodes assigned to each centre.
    sums
        ``(n_rows, n_features)`` sums R of the differences (5.2).
    squares
        ``(n_rows, n_features)`` sums of the squared differences.
    """

    counts: NDArray[np.int64]
    sums: NDArray[np.float64]
    squares: NDArray[np.float64]

    def excess(self, spreads: NDArray[np.floating]) -> NDArray[np.float64]:
        """Return how far the squares exceed those of as many nodes of mean square `spreads`, one a centre."""
        repeated = np.tile(spreads, (len(self.counts) // len(spreads), 1))
        return np.asarray(self.squares - self.counts[:, None] * repeated)

    @property
    def spreads(self) -> NDArray[np.float64]:
        """``(n_rows, n_features)`` mean squared difference; zero for a centre without a node."""
        return np.asarray(self.squares / np.maximum(self.counts, 1)[:, None])


def sum_residuals(
    features: NDArray[np.floating],
    centers: NDArray[np.floating],
    levels: NDArray[np.integer] | None = None,
    n_levels: int = 1,
) -> Residuals:
    """Sum, for each centre, the differences of the nodes assigned to it from it (5.2), and their squares.

    Parameters
    ----------
    features
        ``(n_nodes, n_features)`` node features of one shape.
    centers
        ``(n_centers, n_features)``.
    levels
        ``(n_nodes,)`` level of each node, below `n_levels`; those of each are summed apart. All 0 by default.
    n_levels
        Number of levels.

    Returns
    -------
    Residuals
        Counts, sums and sums of squares; zero for a centre without a node.

    Examples
    --------
    >>> found = sum_residuals(np.array([[0.0], [0.5], [2.0]]), np.array([[0.0], [1.5], [9.0]]))
    >>> found.sums.ravel(), found.squares.ravel()
    (array([0.5, 0.5, 0. ]), array([0.25, 0.25, 0.  ]))
    >>> sum_residuals(np.array([[0.0], [0.5]]), np.zeros((1, 1)), np.array([0, 1]), 2).sums.ravel()
    array([0. , 0.5])
    """
    rows = np.ascontiguousarray(features)
    each = np.zeros(len(rows), np.int64) if levels is None else np.asarray(levels, np.int64)
    n_rows = n_levels * len(centers)
    counts, (sums, squares) = np.zeros(n_rows, np.int64), np.zeros((2, n_rows, centers.shape[1]))
    _accumulate(rows, centers, nearest_centers(rows, centers), each, counts, sums, squares)
    return Residuals(counts, sums, squares)


class Vocabulary(OneToOneFeatureMixin, TransformerMixin, BaseEstimator):  # type: ignore[misc]
    """k-means centres of node features; transforms a node to its difference from the nearest one.

    Parameters
    ----------
    n_centers
        Number of centres ("words").
    n_init
        Number of k-means++ starts; the one of least inertia is kept.
    max_iter
        Most Lloyd iterations of one start.
    random_state
        Seed or generator of the starts.

    Attributes
    ----------
    cluster_centers_
        ``(n_centers, n_features)`` centres, in the precision of the training nodes.
    inertia_
        Sum of squared distances of the training nodes to their centres.
    n_iter_
        Number of Lloyd iterations of the best start.
    n_features_in_
        Number of features seen by `fit`.

    Examples
    --------
    >>> nodes = np.array([[0.0], [0.2], [5.0], [5.2]])
    >>> words = Vocabulary(n_centers=2, random_state=0).fit(nodes)
    >>> np.abs(words.transform(nodes)).round(3).ravel()
    array([0.1, 0.1, 0.1, 0.1])
    """

    def __init__(
        self,
        n_centers: int = 32,
        *,
        n_init: int = 1,
        max_iter: int = 100,
        random_state: int | RandomState | None = None,
    ) -> None:
        self.n_centers = n_centers
        self.n_init = n_init
        self.max_iter = max_iter
        self.random_state = random_state

    def fit(self, X: ArrayLike, y: Any = None) -> Self:
        """Find the centres of the nodes ``X`` of shape ``(n_samples, n_features)``; `y` is ignored."""
        nodes = validate_data(self, X, dtype=[np.float64, np.float32])
        if len(nodes) < self.n_centers:
            msg = (
                f"n_samples={len(nodes)} training nodes are fewer than n_centers={self.n_centers}; "
                "give more shapes or ask for fewer centres"
            )
            raise ParameterError(msg)
        with warnings.catch_warnings():
            # equal nodes are fewer than centres, some of which are then equal too: as good a vocabulary
            warnings.simplefilter("ignore", ConvergenceWarning)
            kmeans = KMeans(
                self.n_centers, n_init=self.n_init, max_iter=self.max_iter, random_state=self.random_state
            ).fit(nodes)
        self.cluster_centers_ = kmeans.cluster_centers_
        self.inertia_ = float(kmeans.inertia_)
        self.n_iter_ = int(kmeans.n_iter_)
        return self

    def predict(self, X: ArrayLike) -> NDArray[np.int32]:
        """Return the index of the centre nearest to each node (5.1), ``(n_samples,)``."""
        return nearest_centers(self._nodes(X), self.cluster_centers_)

    def transform(self, X: ArrayLike) -> NDArray[np.floating]:
        """Return each node's difference from its nearest centre, ``(n_samples, n_features)``."""
        nodes = self._nodes(X)
        return np.asarray(nodes - self.cluster_centers_[nearest_centers(nodes, self.cluster_centers_)])

    def _nodes(self, X: ArrayLike) -> NDArray[np.floating]:
        """Check nodes against what was fitted."""
        check_is_fitted(self)
        dtype = self.cluster_centers_.dtype
        return np.asarray(validate_data(self, X, dtype=dtype, reset=False))
