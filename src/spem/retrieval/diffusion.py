"""Diffusion re-ranking: distances that follow the neighbourhoods of a whole collection.

An option after the search, never part of it: what it gains depends on how many shapes of a class the
collection holds, so scores with it are to be reported apart.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.linalg import solve

from spem.codes.arguments import whole_number
from spem.errors import ParameterError
from spem.retrieval.distances import min_max

# Similarities are at most 1; what is below comes from rounding of the solve.
_UNJOINED = 1e-12
# Small collections have small classes: more neighbours would join them.
_NEIGHBOURS, _SHAPES_A_NEIGHBOUR = 10, 20


def rerank(
    distances: ArrayLike, *, n_neighbours: int | None = None, weight: float = 0.9
) -> NDArray[np.float64]:
    """Return distances after diffusion over the graph of nearest neighbours.

    The affinities exp(−d²/σ_i σ_j) of a shape to its nearest neighbours, σ_i the distance to the last of them
    (Zelnik-Manor and Perona, "Self-tuning spectral clustering", NIPS 2004), normalised to S, are spread by
    the regularised diffusion F = α S F Sᵀ + (1 − α) I (Bai, Bai, Tian and Latecki, "Regularized diffusion
    process on bidirectional context for object retrieval", PAMI 2019; the graph is locally constrained as in
    Donoser and Bischof, "Diffusion processes for retrieval revisited", CVPR 2013). Its limit is solved for,
    so there is no number of iterations to choose.

    Parameters
    ----------
    distances
        ``(n, n)`` distances of a collection's shapes to each other; where both directions differ, their mean
        is taken.
    n_neighbours
        Neighbours that a shape is joined to, below n and best below the size of a class; by default a
        twentieth of the shapes, from 1 to 10.
    weight
        α, in (0, 1): how far affinities spread.

    Returns
    -------
    numpy.ndarray
        ``(n, n)`` distances, zero on the diagonal: 1 less the cosine of F, for shapes that the graph joins;
        for others 1 plus the given distance, scaled to [0, 1], so that they follow in the order they had.

    Raises
    ------
    ParameterError
        When the matrix is not square, too small or not finite, or a parameter is out of its range.

    Examples
    --------
    A chain of near neighbours ends before a shape that lies off it:

    >>> points = np.array([0.0, 1.0, 2.0, 3.0, 4.0, -2.5, -3.5, -4.5])
    >>> distances = np.abs(points[:, None] - points)
    >>> distances[0, 4] > distances[0, 5], rerank(distances, n_neighbours=2)[0, 4] < 1
    (np.True_, np.True_)
    """
    if n_neighbours is None:
        n_neighbours = max(1, min(_NEIGHBOURS, len(np.asarray(distances)) // _SHAPES_A_NEIGHBOUR))
    given = _checked(distances, n_neighbours, weight)
    affinity = _affinities(given, n_neighbours)
    scale = 1 / np.sqrt(affinity.sum(axis=1))
    step = affinity * scale[:, None] * scale
    n = len(given)
    spread = solve(np.eye(n) - weight * step @ step, np.eye(n), assume_a="pos")
    own = np.sqrt(spread.diagonal())
    similarity = spread / (own[:, None] * own)
    joined = similarity > _UNJOINED
    reranked = np.where(joined, 1 - np.minimum((similarity + similarity.T) / 2, 1), 1 + min_max(given))
    np.fill_diagonal(reranked, 0)
    return np.asarray(reranked)


def _checked(distances: ArrayLike, n_neighbours: int, weight: float) -> NDArray[np.float64]:
    """Return symmetric distances with a zero diagonal, or refuse them."""
    given = np.asarray(distances, np.float64)
    if given.ndim != 2 or given.shape[0] != given.shape[1]:
        msg = f"distances of shape {given.shape}; a square matrix was expected"
        raise ParameterError(msg)
    if not np.isfinite(given).all():
        row = np.flatnonzero(~np.isfinite(given).all(axis=1))[0]
        msg = f"distances hold nan or infinity, first in row {row}"
        raise ParameterError(msg)
    n_neighbours = whole_number("n_neighbours", n_neighbours)
    if n_neighbours >= len(given):
        msg = f"n_neighbours {n_neighbours}, expected 1 to {len(given) - 1} for {len(given)} shapes"
        raise ParameterError(msg)
    if not 0 < weight < 1:
        msg = f"weight {weight}, expected a number between 0 and 1"
        raise ParameterError(msg)
    given = (given + given.T) / 2
    np.fill_diagonal(given, 0)
    return given


def _affinities(distances: NDArray[np.float64], n_neighbours: int) -> NDArray[np.float64]:
    """Return affinities, 1 to oneself and zero where neither shape is among the other's nearest."""
    n = len(distances)
    others = distances + np.diag(np.full(n, np.inf))
    nearest = np.argsort(others, axis=1, kind="stable")[:, :n_neighbours]
    near = np.zeros((n, n), bool)
    np.put_along_axis(near, nearest, values=True, axis=1)
    width = np.take_along_axis(distances, nearest[:, -1:], axis=1)
    # shapes with that many copies have no width of their own
    positive = distances[distances > 0]
    width = np.maximum(width, positive.min() if positive.size else 1.0)
    affinity = np.where(near | near.T, np.exp(-np.square(distances) / (width * width.T)), 0)
    np.fill_diagonal(affinity, 1)
    return np.asarray(affinity)
