"""Five ways to reduce the fields at the nodes to a few numbers each: the rivals of section 4.2."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from functools import partial

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.distance import cdist
from sklearn.decomposition import FastICA
from sklearn.exceptions import ConvergenceWarning
from sklearn.manifold import LocallyLinearEmbedding

Array = NDArray[np.float64]
# (rows to learn from, rows to reduce, number of components, randomness) -> reduced rows.
Reduction = Callable[[Array, Array, int, np.random.Generator], Array]

# Most rows that the methods of neighbours and kernels learn from; others are placed among them.
SAMPLE = 1200
_EM_STEPS, _EM_TOLERANCE = 1000, 1e-8


def principal_components(rows: Array, wanted: Array, count: int, rng: np.random.Generator) -> Array:
    """Project on the principal components of SPEM (4.4): the mean is not removed.

    Examples
    --------
    >>> rows = np.array([[3.0, 0.0], [0.0, 1.0]])
    >>> np.abs(principal_components(rows, rows, 1, np.random.default_rng(0))).round(3).tolist()
    [[3.0], [0.0]]
    """
    del rng  # nothing is left to chance
    return np.asarray(wanted @ np.linalg.svd(rows, full_matrices=False)[2][:count].T)


def centred_components(rows: Array, wanted: Array, count: int, rng: np.random.Generator) -> Array:
    """Project on the principal components about the mean.

    Examples
    --------
    >>> rows = np.array([[1.0, 5.0], [2.0, 5.0], [3.0, 5.0]])
    >>> np.abs(centred_components(rows, rows, 1, np.random.default_rng(0))).round(3).tolist()
    [[1.0], [0.0], [1.0]]
    """
    mean = rows.mean(axis=0)
    return principal_components(rows - mean, wanted - mean, count, rng)


def independent_components(rows: Array, wanted: Array, count: int, rng: np.random.Generator) -> Array:
    """Unmix the principal components into independent ones (FastICA), from a random start.

    Examples
    --------
    >>> rows = np.random.default_rng(0).uniform(size=(300, 3))
    >>> independent_components(rows, rows, 2, np.random.default_rng(0)).shape
    (300, 2)
    """
    start = rng.normal(size=(count, count))
    model = FastICA(count, whiten="unit-variance", whiten_solver="svd", w_init=start, max_iter=500)
    with warnings.catch_warnings():
        # That the contrast has no clear optimum here is part of what is measured.
        warnings.simplefilter("ignore", ConvergenceWarning)
        model.fit(rows)
    return np.asarray(model.transform(wanted))


def locally_linear(
    rows: Array, wanted: Array, count: int, rng: np.random.Generator, *, neighbours: int = 12
) -> Array:
    """Embed by weights that rebuild each row from its neighbours (locally linear embedding).

    Examples
    --------
    >>> rows = np.random.default_rng(0).uniform(size=(60, 3))
    >>> locally_linear(rows, rows[:5], 2, np.random.default_rng(0)).shape
    (5, 2)
    """
    model = LocallyLinearEmbedding(n_neighbors=neighbours, n_components=count, eigen_solver="dense")
    model.fit(_sampled(rows, rng))
    return np.asarray(model.transform(wanted))


def diffusion_map(
    rows: Array, wanted: Array, count: int, rng: np.random.Generator, *, width: float = 1.0
) -> Array:
    """Embed by the eigenfunctions of diffusion among the rows, free of their density (diffusion maps).

    The kernel is exp(−|x − y|²/ε), where ε is `width` times the median of |x − y|² over all pairs of rows.
    Rows that were not learnt from are placed by Nyström's extension.

    Examples
    --------
    >>> rows = np.linspace(0, 1, 40)[:, None] ** [1, 2]
    >>> first = diffusion_map(rows, rows, 1, np.random.default_rng(0))[:, 0]
    >>> bool((np.diff(first) > 0).all() or (np.diff(first) < 0).all())
    True
    """
    sample = _sampled(rows, rng)
    square = cdist(sample, sample, "sqeuclidean")
    scale = width * float(np.median(square))
    kernel = np.exp(-square / scale)
    density = kernel.sum(axis=1)
    kernel /= np.outer(density, density)
    degree = kernel.sum(axis=1)
    root = np.sqrt(degree)
    values, vectors = np.linalg.eigh(kernel / np.outer(root, root))
    chosen = np.argsort(-values)[1 : count + 1]
    functions = vectors[:, chosen] / root[:, None]
    away = cdist(wanted, sample, "sqeuclidean")
    # Relative to the nearest, so that a row far from all has a place too.
    across = np.exp(-(away - away.min(axis=1, keepdims=True)) / scale) / density
    return np.asarray(across @ functions / across.sum(axis=1, keepdims=True))


def probabilistic_components(rows: Array, wanted: Array, count: int, rng: np.random.Generator) -> Array:
    """Find the latent variables of probabilistic PCA by maximum likelihood (Tipping and Bishop 1999).

    Expectation and maximisation from a random start. At the optimum the loadings W span the principal
    components, each shrunk by the noise, and are turned by a rotation that the likelihood does not see.

    Examples
    --------
    >>> rows = np.random.default_rng(0).normal(size=(200, 3)) * [9, 4, 0.1]
    >>> latent = probabilistic_components(rows, rows, 2, np.random.default_rng(0))
    >>> latent.shape, bool(np.abs(latent.std(axis=0) - 1).max() < 0.1)
    ((200, 2), True)
    """
    mean = rows.mean(axis=0)
    centred = rows - mean
    scatter = centred.T @ centred / len(rows)
    n, trace = len(scatter), float(np.trace(scatter))
    loadings, noise = rng.normal(size=(n, count)) * np.sqrt(trace / n), trace / n
    for _ in range(_EM_STEPS):
        inner = loadings.T @ loadings + noise * np.eye(count)
        product = scatter @ loadings
        posterior = noise * np.eye(count) + np.linalg.solve(inner, loadings.T @ product)
        renewed = np.linalg.solve(posterior.T, product.T).T
        noise = max(float(trace - np.sum(product * np.linalg.solve(inner, renewed.T).T)) / n, 1e-16 * trace)
        change = float(np.abs(renewed - loadings).max() / np.abs(renewed).max())
        loadings = renewed
        if change < _EM_TOLERANCE:
            break
    inner = loadings.T @ loadings + noise * np.eye(count)
    return np.asarray(np.linalg.solve(inner, loadings.T @ (wanted - mean).T).T)


METHODS: dict[str, Reduction] = {
    "PCA (SPEM)": principal_components,
    "PCA, centred": centred_components,
    "ICA": independent_components,
    "LLE, 12 neighbours": locally_linear,
    "LLE, 60 neighbours": partial(locally_linear, neighbours=60),
    "diffusion maps, ε": diffusion_map,
    "diffusion maps, ε/1000": partial(diffusion_map, width=0.001),
    "probabilistic PCA": probabilistic_components,
}
# Methods that start from chance.
STARTED = ("ICA", "probabilistic PCA")


def _sampled(rows: Array, rng: np.random.Generator) -> Array:
    """Take some rows by chance where there are many."""
    return rows if len(rows) <= SAMPLE else rows[rng.choice(len(rows), SAMPLE, replace=False)]
