"""Distributions of SPEM values over a shape: joint histograms, how far apart they are, where they jump."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from spem.errors import ParameterError

# A jump is a rise by this share of the highest count, from the mean of so many bins to that of as many next.
JUMP = 0.15
WIDTH = 3
# The ends of a histogram lie where this share of the values is beyond: rarer values are no region.
LEAST_SHARE = 0.01


def map_limits(values: Sequence[ArrayLike], column: int, beyond: float = 0.001) -> tuple[float, float]:
    """Return the range of a map over several shapes, but for rare values at both ends.

    Parameters
    ----------
    values
        ``(n_nodes, n_maps)`` maps of each shape.
    column
        Which map, from zero.
    beyond
        Share of all nodes that is left out at each end.

    Examples
    --------
    >>> map_limits([np.arange(101.0)[:, None]], 0, beyond=0.02)
    (2.0, 98.0)
    """
    together = np.concatenate([np.asarray(of_shape)[:, column] for of_shape in values])
    low, high = np.quantile(together, (beyond, 1 - beyond))
    return float(low), float(high)


def joint_histogram(
    x: ArrayLike, y: ArrayLike, limits: tuple[tuple[float, float], tuple[float, float]], bins: int = 64
) -> NDArray[np.float64]:
    """Count the nodes by their values of two maps, as Fig. 18 shows P₄ and P₃.

    Parameters
    ----------
    x, y
        ``(n_nodes,)`` values of two maps of a shape.
    limits
        Least and greatest value of x, then of y; values beyond are counted in the outermost bins.
    bins
        Bins along each axis.

    Returns
    -------
    share
        ``(bins, bins)`` share of the nodes in each bin, x along axis 0; they add up to 1.

    Raises
    ------
    ParameterError
        If x and y differ in length or are not finite, or limits do not rise.

    Examples
    --------
    >>> joint_histogram([0.1, 0.2, 0.9], [0.9, 0.8, 2.0], ((0, 1), (0, 1)), bins=2).round(2).tolist()
    [[0.0, 0.67], [0.0, 0.33]]
    """
    columns = [np.asarray(x, np.float64), np.asarray(y, np.float64)]
    if columns[0].shape != columns[1].shape or columns[0].ndim != 1 or not columns[0].size:
        msg = f"joint histogram: x and y must be two columns of one length, not {[c.shape for c in columns]}"
        raise ParameterError(msg)
    if not all(np.isfinite(column).all() for column in columns):
        msg = "joint histogram: x and y must be finite"
        raise ParameterError(msg)
    for low, high in limits:
        if not low < high:
            msg = f"joint histogram: limits must rise, not run from {low:g} to {high:g}"
            raise ParameterError(msg)
    first, second = (np.clip(c, *ends) for c, ends in zip(columns, limits, strict=True))
    counts = np.histogram2d(first, second, bins, np.array(limits, np.float64))[0]
    return np.asarray(counts / columns[0].size)


def hellinger_distances(histograms: ArrayLike) -> NDArray[np.float64]:
    """Return the Hellinger distances of histograms: 0 of equal ones, 1 of two that share no bin.

    Parameters
    ----------
    histograms
        ``(n, ...)`` shares of the same bins; each histogram adds up to 1.

    Returns
    -------
    distances
        ``(n, n)``.

    Examples
    --------
    >>> hellinger_distances([[0.5, 0.5, 0.0], [0.5, 0.5, 0.0], [0.0, 0.0, 1.0]]).round(6).tolist()
    [[0.0, 0.0, 1.0], [0.0, 0.0, 1.0], [1.0, 1.0, 0.0]]
    """
    shares = np.asarray(histograms, np.float64)
    roots = np.sqrt(shares.reshape(len(shares), -1))
    return np.asarray(np.sqrt(np.maximum(0.0, 1.0 - roots @ roots.T)))


def first_jumps(values: ArrayLike, bins: int = 64) -> tuple[float, float]:
    """Return the thresholds at the first jump of a histogram from its lower and from its upper end.

    Fig. 15 thresholds maps there. Going inward from an end, where a hundredth of the values is left behind,
    the first rise of the counts by 15 % of the highest one within a few bins is taken, at its steepest edge.
    Where counts do not jump before zero, the threshold is zero.

    Parameters
    ----------
    values
        Values of one map, of one shape or of several together.
    bins
        Number of bins between the ends.

    Returns
    -------
    low, high
        Values below `low`, at most zero, stand out, and values above `high`, at least zero.

    Raises
    ------
    ParameterError
        If there are fewer than two different values.

    Examples
    --------
    >>> tails, middle = np.linspace(-10, 10, 200), np.linspace(-3, 5, 2000)
    >>> low, high = first_jumps(np.concatenate([tails, middle]))
    >>> round(low, 1), round(high, 1)
    (-2.9, 5.1)
    """
    array = np.ravel(np.asarray(values, np.float64))
    if array.size == 0 or not array.min() < array.max() or not np.isfinite(array).all():
        msg = "thresholds at jumps of a histogram: expected at least two different values, all finite"
        raise ParameterError(msg)
    ends = np.quantile(array, (LEAST_SHARE, 1 - LEAST_SHARE))
    counts, edges = np.histogram(array, bins=bins, range=tuple(ends))
    low, high = edges[_jump(counts)], edges[bins - _jump(counts[::-1])]
    return min(float(low), 0.0), max(float(high), 0.0)


def _jump(counts: NDArray[np.int64]) -> int:
    """Return the number of bins passed before the first jump; all of them where there is none."""
    means = np.convolve(counts, np.full(WIDTH, 1 / WIDTH), mode="valid")
    rise = means[WIDTH:] - means[:-WIDTH]  # at the edges between bins, from edge WIDTH on
    found = np.flatnonzero(rise >= JUMP * means.max())
    if not found.size:
        return len(counts)
    edge = int(found[0])
    while edge + 1 < len(rise) and rise[edge + 1] > rise[edge]:
        edge += 1
    return edge + WIDTH
