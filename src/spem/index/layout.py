"""A map of a collection: codes in the plane, like ones side by side."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray
from threadpoolctl import threadpool_limits

from spem.errors import ParameterError
from spem.index.schema import standardised_codes

# t-SNE goes through so many codes in seconds; of more so many are landmarks.
LANDMARKS = 5000
# Principal axes that t-SNE starts from: later ones hold what tells single shapes, not groups, apart.
_AXES = 50
_PERPLEXITY = 30.0
# Other codes lie amid so many landmarks.
_NEAREST = 5
_LEAST = 4
_BLOCK = 4096
# Deviation of the start along its first axis, as van der Maaten has it.
_START = 1e-4
# Standardised codes that differ by less are equal to rounding.
_EQUAL = 1e-6


def lay_out(codes: ArrayLike, rng: np.random.Generator) -> NDArray[np.float64]:
    """Lay codes out in the plane so that like ones lie side by side.

    t-SNE (van der Maaten and Hinton, JMLR 2008) of the codes at zero mean and unit length, whose squared
    differences are twice their correlation distances, from their first principal axes on. Beyond 5,000
    codes it lays out so many of them, and each other one lies amid its nearest of these.

    Parameters
    ----------
    codes
        ``(n, n_code)`` codes.
    rng
        Chooses landmarks; what is laid out without them does not depend on it but for ties.

    Returns
    -------
    numpy.ndarray
        ``(n, 2)`` places, around the origin and with largest coordinate 1.

    Raises
    ------
    ParameterError
        When the codes are not finite or no matrix.

    Examples
    --------
    >>> rng = np.random.default_rng(0)
    >>> codes = np.repeat(np.eye(3, 8), 10, axis=0)
    >>> places = lay_out(codes + 0.01 * rng.random(codes.shape), rng)
    >>> places.shape
    (30, 2)
    """
    given = np.asarray(codes)
    if given.ndim != 2 or not np.isfinite(given).all():
        msg = f"codes of shape {given.shape}: expected a matrix of finite numbers, one row a shape"
        raise ParameterError(msg)
    vectors = standardised_codes(given) if given.size else np.zeros((len(given), 1), np.float32)
    if len(vectors) <= LANDMARKS:
        return _scaled(_embedded(vectors, rng))
    chosen = np.sort(rng.choice(len(vectors), LANDMARKS, replace=False))
    placed = _scaled(_embedded(vectors[chosen], rng))
    places = _amid(vectors, vectors[chosen], placed)
    places[chosen] = placed
    return places


def _embedded(vectors: NDArray[np.float32], rng: np.random.Generator) -> NDArray[np.float64]:
    """Lay out codes by t-SNE, few of them by their principal axes."""
    if not len(vectors):
        return np.zeros((0, 2))
    axes = _principal_axes(vectors)
    plane = np.pad(axes[:, :2], ((0, 0), (0, max(0, 2 - axes.shape[1]))))
    if np.abs(axes).max(initial=0.0) < _EQUAL:
        return np.zeros_like(plane)
    if len(vectors) < _LEAST:
        return plane
    from sklearn.manifold import TSNE

    start = plane / plane[:, 0].std() * _START
    model = TSNE(
        init=start.astype(np.float32),
        perplexity=min(_PERPLEXITY, (len(vectors) - 1) / 3),
        learning_rate="auto",
        random_state=int(rng.integers(2**32)),
        method="barnes_hut" if len(vectors) > _LEAST * 10 else "exact",
    )
    # waiting threads cost more than a second one gains, many times more on a busy machine
    with threadpool_limits(1):
        return np.asarray(model.fit_transform(axes), np.float64)


def _principal_axes(vectors: NDArray[np.float32]) -> NDArray[np.float64]:
    """Return codes along their first principal axes, each of which has a positive largest entry."""
    centred = vectors.astype(np.float64) - vectors.mean(axis=0, dtype=np.float64)
    if len(centred) <= centred.shape[1]:
        values, left = np.linalg.eigh(centred @ centred.T)
        order = np.argsort(values)[::-1][:_AXES]
        axes = left[:, order] * np.sqrt(np.maximum(values[order], 0))
    else:
        values, right = np.linalg.eigh(centred.T @ centred)
        axes = centred @ right[:, np.argsort(values)[::-1][:_AXES]]
    largest = np.take_along_axis(axes, np.abs(axes).argmax(axis=0)[None], axis=0)
    return np.asarray(axes * np.where(largest < 0, -1.0, 1.0))


def _amid(
    vectors: NDArray[np.float32], landmarks: NDArray[np.float32], placed: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Place codes amid their nearest landmarks, the nearer the more."""
    places = np.empty((len(vectors), 2))
    for start in range(0, len(vectors), _BLOCK):
        cosines = vectors[start : start + _BLOCK] @ landmarks.T
        near = np.argpartition(-cosines, _NEAREST, axis=1)[:, :_NEAREST]
        distance = np.maximum(1 - np.take_along_axis(cosines, near, axis=1), np.finfo(np.float32).eps)
        weight = 1 / distance / (1 / distance).sum(axis=1, keepdims=True)
        places[start : start + _BLOCK] = np.einsum("ij,ijk->ik", weight, placed[near])
    return places


def _scaled(places: NDArray[np.float64]) -> NDArray[np.float64]:
    """Bring places around the origin, and the largest coordinate to 1."""
    centred = places - (places.max(axis=0) + places.min(axis=0)) / 2 if len(places) else places
    largest = np.abs(centred).max(initial=0.0)
    return np.asarray(centred / largest if largest > 0 else centred)
