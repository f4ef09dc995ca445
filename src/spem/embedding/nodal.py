"""Nodal domains of maps (5.4): where a projection is clearly negative and where it is clearly positive."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Literal, get_args

import numpy as np
from numpy.typing import ArrayLike, NDArray

from spem.embedding.maps import Maps
from spem.errors import ParameterError

Cut = Literal["means", "midway"]
_CLUSTERS = 3
# Places at which the sorted intensities may be cut at first.
_CUTS = 200


def nodal_clusters(
    maps: Sequence[ArrayLike], *, nodes_per_shape: int = 200, rng: np.random.Generator | None = None
) -> NDArray[np.float64]:
    """Put the intensities of each projection, at nodes of all shapes, into three clusters by k-means (5.4).

    Parameters
    ----------
    maps
        For each shape ``(n_nodes, n_maps)`` projections, brought to one scale: see
        `spem.codes.normalise.unit_rms`.
    nodes_per_shape
        Number of nodes drawn from each shape, so that large shapes count no more than small ones.
    rng
        Draws the nodes; seed 0 by default.

    Returns
    -------
    NDArray
        ``(n_maps, 3)`` cluster means, ascending.

    Raises
    ------
    ParameterError
        When there is no shape, shapes differ in their number of maps, or a projection has fewer than three
        different values.

    Examples
    --------
    >>> nodal_clusters([[[-2.0], [0.0], [3.0]], [[-4.0], [0.0], [5.0]]]).round(6)
    array([[-3.,  0.,  4.]])
    """
    drawing = np.random.default_rng(0) if rng is None else rng
    nodes = np.concatenate([_draw(values, nodes_per_shape, drawing) for values in _same_maps(maps)])
    return np.stack([_cluster_means(column, j) for j, column in enumerate(nodes.T)])


def nodal_thresholds(
    maps: Sequence[ArrayLike],
    *,
    at: Cut = "means",
    nodes_per_shape: int = 200,
    rng: np.random.Generator | None = None,
) -> NDArray[np.float64]:
    """Learn a negative and a positive threshold for each projection, in common for all shapes (5.4).

    They follow from the clusters of the intensities. A projection of one sign, as the first one is unless
    centred, has three clusters as well, and its domains are where it is lowest and highest.

    Parameters
    ----------
    maps, nodes_per_shape, rng
        As for `nodal_clusters`.
    at
        ``"means"`` cuts at the lowest and the highest cluster mean, as the paper does; ``"midway"`` between
        these and the middle one, so that a domain holds the nodes of its cluster.

    Returns
    -------
    NDArray
        ``(n_maps, 2)`` negative and positive threshold of each projection.

    Raises
    ------
    ParameterError
        As `nodal_clusters` does, or when `at` is neither.

    Examples
    --------
    >>> nodal_thresholds([[[-2.0], [0.0], [3.0]], [[-4.0], [0.0], [5.0]]])
    array([[-3.,  4.]])
    """
    if at not in get_args(Cut):
        msg = f"at={at!r} must be one of {', '.join(get_args(Cut))}"
        raise ParameterError(msg)
    means = nodal_clusters(maps, nodes_per_shape=nodes_per_shape, rng=rng)
    return means[:, [0, 2]] if at == "means" else (means[:, :2] + means[:, 1:]) / 2


def nodal_domains(values: ArrayLike, thresholds: ArrayLike | None = None) -> NDArray[np.int8]:
    """Say for each node whether it is in the negative or the positive domain of each projection, or in none.

    Parameters
    ----------
    values
        ``(n_nodes, n_maps)`` projections of one shape.
    thresholds
        ``(n_maps, 2)`` as `nodal_thresholds` learns them; zeros by default, so that the sign decides.

    Returns
    -------
    NDArray
        ``(n_nodes, n_maps)``: −1 below the negative threshold, 1 above the positive one, 0 between.

    Raises
    ------
    ParameterError
        When maps or thresholds are of another form, or a negative threshold exceeds the positive one.

    Examples
    --------
    >>> nodal_domains([[-3.0], [0.5], [2.0]], thresholds=[[-1.0, 1.0]]).ravel().tolist()
    [-1, 0, 1]
    """
    nodes = _as_maps(values)
    n_maps = nodes.shape[1]
    limits = np.zeros((n_maps, 2)) if thresholds is None else np.asarray(thresholds, np.float64)
    if limits.shape != (n_maps, 2) or not (limits[:, 0] <= limits[:, 1]).all():
        msg = f"thresholds of shape {limits.shape}: expected a negative and a positive one for {n_maps} maps"
        raise ParameterError(msg)
    above, below = nodes > limits[:, 1], nodes < limits[:, 0]
    return above.astype(np.int8) - below.astype(np.int8)


def _cluster_means(column: NDArray[np.floating[Any]], j: int) -> NDArray[np.float64]:
    """Return the three cluster means of a projection: the best of many pairs of cuts, then Lloyd's iteration.

    On a line clusters are runs of the sorted values.
    """
    ordered = np.sort(column.astype(np.float64))
    if not (np.diff(ordered) > 0).sum() >= _CLUSTERS - 1:
        msg = f"projection {j + 1} has fewer than {_CLUSTERS} different values, so no nodal domains; drop it"
        raise ParameterError(msg)
    middle = ordered.mean()
    ordered -= middle
    sums = np.concatenate([[0.0], np.cumsum(ordered)])
    ends = np.array([0, *_first_cuts(sums), ordered.size])
    while True:
        means = np.diff(sums[ends]) / np.diff(ends)
        moved = np.array([0, *np.searchsorted(ordered, (means[1:] + means[:-1]) / 2), ordered.size])
        if np.array_equal(moved, ends) or not (np.diff(moved) > 0).all():
            return np.asarray(means + middle)
        ends = moved


def _first_cuts(sums: NDArray[np.float64]) -> NDArray[np.int64]:
    """Return the pair of cuts of least inertia among evenly spaced ones, from sums up to each value."""
    count = sums.size - 1
    cuts = np.unique(np.linspace(1, count - 1, min(count - 1, _CUTS)).astype(np.int64))
    low, high = cuts[:, None], cuts[None]
    # Inertia is a constant less what the clusters gain: the squared sum of each over its number.
    gain = np.square(sums[low]) / low + np.square(sums[-1] - sums[high]) / (count - high)
    gain = gain + np.square(sums[high] - sums[low]) / np.maximum(high - low, 1)
    best = np.unravel_index(np.where(high > low, gain, -np.inf).argmax(), gain.shape)
    return cuts[list(best)]


def _draw(
    values: NDArray[np.floating[Any]], count: int, rng: np.random.Generator
) -> NDArray[np.floating[Any]]:
    """Draw nodes without replacement; all of them where there are no more."""
    return values if len(values) <= count else values[rng.permutation(len(values))[:count]]


def _same_maps(maps: Sequence[ArrayLike]) -> list[NDArray[np.floating[Any]]]:
    """Check that there are shapes, and that they have the same number of maps."""
    checked = [_as_maps(values) for values in maps]
    counts = sorted({values.shape[1] for values in checked})
    if len(counts) != 1:
        found = f"shapes with {' and '.join(map(str, counts))} maps" if counts else "no shape"
        msg = f"{found}: expected at least one shape, and the same number of maps of each"
        raise ParameterError(msg)
    return checked


def _as_maps(values: ArrayLike | Maps) -> NDArray[np.floating[Any]]:
    """Check the maps of one shape; single precision stays."""
    if isinstance(values, Maps):
        msg = "expected values of nodes, got Maps; give maps.values"
        raise ParameterError(msg)
    nodes = np.asarray(values)
    nodes = nodes if nodes.dtype.kind == "f" else nodes.astype(np.float64)
    if nodes.ndim != 2 or not nodes.size or not np.isfinite(nodes).all():
        msg = f"maps of shape {nodes.shape}: expected (n_nodes, n_maps) finite values, at least one of each"
        raise ParameterError(msg)
    return nodes
