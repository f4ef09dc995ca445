"""Codes that `codes_study.py` compares: VLAD with its options, and encodings that spem does not have.

Each takes the node features of training shapes, those of the shapes to code, and a seed; it returns one code
a shape. Features are brought to mean zero and deviation one over the training nodes, as VLAD does.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtri, softmax
from sklearn.exceptions import ConvergenceWarning
from sklearn.mixture import GaussianMixture

from spem.codes.normalise import Normalisation, unit_rms
from spem.codes.vlad import VLAD
from spem.codes.vocabulary import Vocabulary, nearest_centers, sum_residuals

Array = NDArray[Any]
Encoder = Callable[[Sequence[Array], Sequence[Array], int], Array]
# Training nodes in all, as many of each shape.
_TRAINING_NODES = 60_000


def vlad_codes(training: Sequence[Array], shapes: Sequence[Array], seed: int, **options: Any) -> Array:
    """Code shapes as spem does."""
    learner = VLAD(**({"nodes_per_shape": _TRAINING_NODES // len(training), "random_state": seed} | options))
    return np.asarray(learner.fit(list(training)).transform(list(shapes)))


def several_vocabularies(
    training: Sequence[Array], shapes: Sequence[Array], seed: int, count: int = 3
) -> Array:
    """Put codes of several vocabularies side by side."""
    return np.hstack([vlad_codes(training, shapes, seed + 1000 * j) for j in range(count)])


def fisher_codes(
    training: Sequence[Array], shapes: Sequence[Array], seed: int, count: int = 32, power: float = 0.5
) -> Array:
    """Return Fisher vectors of a mixture of Gaussians with diagonal covariances (Perronnin et al. 2010)."""
    ready = _Standard.of(training, seed)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ConvergenceWarning)
        mixture = GaussianMixture(
            count, covariance_type="diag", reg_covar=1e-4, max_iter=30, random_state=seed
        ).fit(ready.nodes)
    weight, mean, variance = mixture.weights_[:, None], mixture.means_, mixture.covariances_
    codes = []
    for features in map(ready.apply, shapes):
        share = _responsibilities(features, weight, mean, variance) / len(features)
        total, first, second = share.sum(0)[:, None], share.T @ features, share.T @ features**2
        position = (first - total * mean) / np.sqrt(weight * variance)
        width = (second - 2 * mean * first + total * mean**2) / variance - total
        codes.append(_finish([position, width / np.sqrt(2 * weight)], power, by_word=False))
    return np.stack(codes)


def soft_codes(
    training: Sequence[Array], shapes: Sequence[Array], seed: int, count: int = 64, width: float = 1.0
) -> Array:
    """Return VLAD of two moments with nodes shared among words by a Gaussian of the words' mean spread."""
    ready = _Standard.of(training, seed)
    centers, spreads = ready.words(count, seed)
    codes = []
    for features in map(ready.apply, shapes):
        squares = (features**2).sum(1)[:, None] - 2 * features @ centers.T + (centers**2).sum(1)
        share = softmax(-squares / (2 * width * spreads.mean()), axis=1)
        total, first, second = share.sum(0)[:, None], share.T @ features, share.T @ features**2
        excess = second - 2 * centers * first + total * (centers**2 - spreads)
        codes.append(_finish([first - total * centers, excess]))
    return np.stack(codes)


def covariance_codes(training: Sequence[Array], shapes: Sequence[Array], seed: int, count: int = 32) -> Array:
    """Return VLAD with the whole second moment of each word beside the residuals, not its diagonal alone."""
    ready = _Standard.of(training, seed)
    centers, _ = ready.words(count, seed)
    expected = _products(ready.nodes, centers)
    mean = expected[1] / np.maximum(expected[2], 1)[:, None]
    found = (_products(ready.apply(features), centers) for features in shapes)
    return np.stack([_finish([sums, squares - n[:, None] * mean]) for sums, squares, n in found])


def count_codes(training: Sequence[Array], shapes: Sequence[Array], seed: int, count: int = 256) -> Array:
    """Return the root of the share of nodes of each word: a bag of words under the Hellinger distance."""
    ready = _Standard.of(training, seed)
    centers, _ = ready.words(count, seed)
    return np.stack([np.sqrt(sum_residuals(ready.apply(f), centers).counts / len(f)) for f in shapes])


def gaussian_ranks(training: Sequence[Array], shapes: Sequence[Array], seed: int) -> Array:
    """Return codes of features replaced by the normal score of their rank among the training nodes."""
    ranked = np.sort(np.concatenate([unit_rms(features)[::10] for features in training]), axis=0)
    steps = np.linspace(0.001, 0.999, 500)
    known, scores = np.quantile(ranked, steps, axis=0), ndtri(steps)

    def score(features: Array) -> Array:
        unit = unit_rms(features)
        return np.stack([np.interp(x, q, scores) for x, q in zip(unit.T, known.T, strict=True)], axis=1)

    return vlad_codes([score(f) for f in training], [score(f) for f in shapes], seed, scaling="none")


def whitened_codes(
    training: Sequence[Array], shapes: Sequence[Array], seed: int, shrinkage: float = 1.0
) -> Array:
    """Return codes whitened by the covariance of training codes, shrunk toward a multiple of the identity."""
    known, codes = np.split(vlad_codes(training, [*training, *shapes], seed), [len(training)])
    centred, moved = known - known.mean(0), codes - known.mean(0)
    _, size, axes = np.linalg.svd(centred, full_matrices=False)
    variance = size**2 / len(known)
    floor = shrinkage * variance.mean()
    along = moved @ axes.T
    return np.hstack([along / np.sqrt(variance + floor), (moved - along @ axes) / np.sqrt(floor)])


@dataclass(frozen=True, eq=False)
class _Standard:
    """The usual normalisation of node features, and training nodes in it."""

    normal: Normalisation
    nodes: Array

    @classmethod
    def of(cls, training: Sequence[Array], seed: int) -> _Standard:
        """Learn it from some nodes of each training shape."""
        rng, each = np.random.default_rng(seed), _TRAINING_NODES // len(training)
        drawn = [unit_rms(features)[rng.permutation(len(features))[:each]] for features in training]
        normal = Normalisation.standard(drawn)
        return cls(normal, (np.concatenate(drawn) - normal.mean) @ normal.transform)

    def apply(self, features: Array) -> Array:
        """Bring the features of a shape to it."""
        return np.asarray(self.normal.apply(features), np.float64)

    def words(self, count: int, seed: int) -> tuple[Array, Array]:
        """Return centres of k-means, and the mean squared differences of training nodes from them."""
        centers = Vocabulary(count, random_state=seed).fit(self.nodes).cluster_centers_
        return centers, sum_residuals(self.nodes, centers).spreads


def _responsibilities(features: Array, weight: Array, mean: Array, variance: Array) -> Array:
    """Return the share of each Gaussian in each node."""
    inverse = 1 / variance
    constant = np.log(weight[:, 0]) - 0.5 * (np.log(variance) + mean**2 * inverse).sum(1)
    return np.asarray(
        softmax(constant + features @ (mean * inverse).T - 0.5 * features**2 @ inverse.T, axis=1)
    )


def _products(features: Array, centers: Array) -> tuple[Array, Array, Array]:
    """Return for each centre sums of residuals, of their products, and the number of nodes."""
    labels, (count, dim) = nearest_centers(features, centers), centers.shape
    upper = np.triu_indices(dim)
    sums, squares = np.zeros((count, dim)), np.zeros((count, len(upper[0])))
    for word in range(count):
        rest = features[labels == word] - centers[word]
        sums[word], squares[word] = rest.sum(0), (rest.T @ rest)[upper]
    return sums, squares, np.bincount(labels, minlength=count)


def _finish(moments: Sequence[Array], power: float = 0.5, *, by_word: bool = True) -> Array:
    """Normalise each row of each moment, take the power and normalise the whole."""
    rows = [
        m / np.maximum(np.linalg.norm(m, axis=1, keepdims=True), 1e-12) if by_word else m for m in moments
    ]
    code = np.hstack(rows).ravel()
    code = np.sign(code) * np.abs(code) ** power
    return np.asarray(code / max(float(np.linalg.norm(code)), 1e-12))
