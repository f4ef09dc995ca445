"""How alike components are from pose to pose at points that correspond."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment

# Components that correlate more than this are told as the same.
SAME = 0.9


@dataclass(frozen=True, eq=False)
class Agreement:
    """Correlations of components between every two poses, taken three ways.

    Parameters
    ----------
    ordered
        ``(n_pairs, n_components)`` absolute correlation of the k-th with the k-th component.
    matched
        ``(n_pairs, n_components)`` the same once the order is the best there is for the pair.
    spanned
        ``(n_pairs, n_components)`` canonical correlations: once any mixture of the components is allowed.
    """

    ordered: NDArray[np.float64]
    matched: NDArray[np.float64]
    spanned: NDArray[np.float64]

    @property
    def means(self) -> tuple[float, float, float]:
        """Means of the three."""
        return float(self.ordered.mean()), float(self.matched.mean()), float(self.spanned.mean())

    @property
    def n_same(self) -> int:
        """Number of components whose mean correlation, in their own order, is above `SAME`."""
        return int((self.ordered.mean(axis=0) > SAME).sum())


def agreement(values: Sequence[NDArray[np.float64]]) -> Agreement:
    """Compare components between every two poses.

    Parameters
    ----------
    values
        ``(n_points, n_components)`` of each pose, at corresponding points.

    Examples
    --------
    >>> rng = np.random.default_rng(0)
    >>> one = rng.normal(size=(50, 2))
    >>> swapped = agreement([one, -one[:, ::-1]])
    >>> [round(mean, 3) for mean in swapped.means[1:]], swapped.n_same
    ([1.0, 1.0], 0)
    """
    ordered, matched, spanned = [], [], []
    units = [_orthonormal(v) for v in values]
    for a, b in itertools.combinations(range(len(values)), 2):
        table = correlations(values[a], values[b])
        ordered.append(np.diagonal(table))
        rows, columns = linear_sum_assignment(table, maximize=True)
        matched.append(table[rows, columns])
        spanned.append(np.clip(np.linalg.svd(units[a].T @ units[b], compute_uv=False), 0.0, 1.0))
    return Agreement(np.array(ordered), np.array(matched), np.array(spanned))


def correlations(a: NDArray[np.float64], b: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the absolute correlation of every column of one array with every column of another.

    Examples
    --------
    >>> ramp = np.arange(4.0)[:, None]
    >>> correlations(ramp, np.hstack([-ramp, ramp**0])).round(3).tolist()
    [[1.0, 0.0]]
    """
    return np.abs(_unit(a).T @ _unit(b))


def own_partners(values: Sequence[NDArray[np.float64]]) -> NDArray[np.float64]:
    """Return how often the component most like the k-th of one pose is the k-th of another.

    Parameters
    ----------
    values
        ``(n_points, n_components)`` of each pose, at corresponding points.

    Returns
    -------
    shares
        ``(n_components,)`` share of the ordered pairs of poses.

    Examples
    --------
    >>> one = np.random.default_rng(0).normal(size=(50, 3))
    >>> own_partners([one, one[:, [0, 2, 1]]]).tolist()
    [1.0, 0.0, 0.0]
    """
    n = values[0].shape[1]
    tables = [correlations(a, b) for a, b in itertools.permutations(values, 2)]
    return np.asarray(np.mean([table.argmax(axis=1) == np.arange(n) for table in tables], axis=0))


def beyond(values: NDArray[np.float64], depth: NDArray[np.float64], n_bins: int = 20) -> NDArray[np.float64]:
    """Return what of components the depth of a point does not tell: less their mean at about its depth.

    Parameters
    ----------
    values
        ``(n_points, n_components)``.
    depth
        ``(n_points,)`` distance to the boundary.
    n_bins
        Number of classes of depth, with as many points in each.

    Examples
    --------
    >>> depth = np.repeat([1.0, 2.0], 10)
    >>> beyond(depth[:, None] ** 2, depth, 2).max()
    np.float64(0.0)
    """
    rank = np.argsort(np.argsort(depth, kind="stable"), kind="stable")
    number = rank * n_bins // depth.size
    count = np.bincount(number, minlength=n_bins)
    means = np.stack([np.bincount(number, column, n_bins) / count for column in values.T], axis=1)
    return np.asarray(values - means[number])


def _unit(values: NDArray[np.float64]) -> NDArray[np.float64]:
    """Centred columns of unit length; constant ones are zero."""
    centred = values - values.mean(axis=0)
    length = np.linalg.norm(centred, axis=0)
    return np.asarray(np.divide(centred, length, out=np.zeros_like(centred), where=length > 0))


def _orthonormal(values: NDArray[np.float64]) -> NDArray[np.float64]:
    """Orthonormal basis of the centred columns."""
    return np.asarray(np.linalg.qr(_unit(values))[0])
