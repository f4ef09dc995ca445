"""Clusters of interaction vectors: k-means and Gaussian mixtures (4.1)."""

from __future__ import annotations

import warnings
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray
from sklearn.cluster import KMeans
from sklearn.decomposition import PCA
from sklearn.exceptions import ConvergenceWarning
from sklearn.mixture import GaussianMixture

from spem.decomposition.measurements import OVERS, Over, centred_logs
from spem.errors import ParameterError
from spem.fields.superposition.fields import SourceFields, require_fields

Method = Literal["kmeans", "mixture"]
METHODS = ("kmeans", "mixture")
# Principal components that clusters are sought in. A full covariance of all sources would have more numbers
# than there are nodes; six components hold 97 % of the variance of a hand or a cat, and more only let
# Gaussians flatten onto the surface that the vectors lie on.
_DIMENSIONS = 6
_STARTS = {"kmeans": 10, "mixture": 1}
_MOST_ITERATIONS = 500
# Variance added to every direction of a Gaussian, as a share of the mean one: none shrinks to a point.
_LEAST_VARIANCE = 1e-6


@dataclass(frozen=True, eq=False)
class Clusters:
    """Clusters of the nodes, or of the boundary sources, of one shape.

    Parameters
    ----------
    labels
        ``(n,)`` cluster of each node or source, from 0; the largest cluster first, of equal ones that of the
        first node.
    centres
        ``(k, n_vector)`` mean vector of each cluster: of the centred log-field, over the sources that
        reach it, or the nodes it reaches; -inf where none of its members is reached.
    converged
        Whether the iteration met its tolerance.
    """

    labels: NDArray[np.int32]
    centres: NDArray[np.float64]
    converged: bool

    @property
    def n_clusters(self) -> int:
        """Number of clusters, k."""
        return len(self.centres)

    @property
    def sizes(self) -> NDArray[np.int64]:
        """``(k,)`` number of members, falling."""
        return np.bincount(self.labels, minlength=self.n_clusters)

    def __repr__(self) -> str:
        sizes = ", ".join(map(str, self.sizes))
        return f"Clusters({self.n_clusters} of {self.labels.size}, sizes {sizes})"


def cluster_interactions(
    fields: SourceFields,
    n_clusters: int,
    *,
    method: Method = "kmeans",
    over: Over = "region",
    n_dimensions: int = _DIMENSIONS,
    rng: np.random.Generator | None = None,
) -> Clusters:
    """Cluster nodes, or boundary sources, by their interaction vectors.

    The vectors are those of the centred log-field (`centred_logs`). Where a source does not reach a node the
    field has its lowest finite value, so that components are far apart. They are reduced to their leading
    principal components first: a mixture of full covariances in hundreds of dimensions means nothing.

    Parameters
    ----------
    fields
        Fields of boundary sources.
    n_clusters
        Number of clusters; fewer come back if fewer vectors differ, or a Gaussian is nowhere the likeliest.
    method
        ``"kmeans"``, or ``"mixture"`` of Gaussians with full covariances.
    over
        ``"region"`` for clusters of nodes, ``"boundary"`` for clusters of sources.
    n_dimensions
        Number of principal components.
    rng
        Where the iterations start; a fixed seed by default.

    Raises
    ------
    ParameterError
        When there are fewer vectors than clusters, or an argument is of another kind or out of its range.

    Examples
    --------
    >>> import spem
    >>> bone = np.pad(np.ones((3, 12)), ((3, 3), (0, 0)))
    >>> bone[:, :5] = bone[:, -4:] = 1
    >>> fields = spem.source_fields(spem.sources(spem.Shape.from_mask(bone)), np.inf)
    >>> cluster_interactions(fields, 2)
    Clusters(2 of 90, sizes 48, 42)
    """
    require_fields(fields)
    if method not in METHODS or over not in OVERS:
        wrong = f"method={method!r}" if method not in METHODS else f"over={over!r}"
        msg = f"{wrong}: expected {' or '.join(map(repr, METHODS if method not in METHODS else OVERS))}"
        raise ParameterError(msg)
    centred = centred_logs(fields, over=over)
    vectors = centred.T if over == "region" else centred
    name, n = fields.sources.system.shape.name, len(vectors)
    counts: tuple[tuple[str, Any, str, float], ...] = (
        ("n_clusters", n_clusters, f" and at most {n}", n),
        ("n_dimensions", n_dimensions, "", np.inf),
    )
    for what, value, bound, most in counts:
        if not isinstance(value, int | np.integer) or not 1 <= value <= most:
            msg = f"{name}: {what}={value}: expected a whole number, 1 or more{bound}"
            raise ParameterError(msg)
    reduced = _reduce(vectors, n_dimensions)
    seed = int((rng or np.random.default_rng(0)).integers(2**31))
    with warnings.catch_warnings():
        # Fewer distinct vectors than clusters, and iterations cut short, are told by the result.
        warnings.simplefilter("ignore", ConvergenceWarning)
        found, converged = _fit(reduced, n_clusters, method, seed)
    labels = _by_size(found)
    return Clusters(labels, _means(vectors, labels), converged)


def _reduce(vectors: NDArray[np.float64], n_dimensions: int) -> NDArray[np.float64]:
    """Project vectors on their leading principal components, unreached entries at the lowest value."""
    known = np.isfinite(vectors)
    filled = vectors if known.all() else np.where(known, vectors, vectors.min(where=known, initial=0.0))
    if len(filled) == 1 or not np.ptp(filled, axis=0).any():
        return np.zeros((len(filled), 1))
    count = min(n_dimensions, *filled.shape)
    # Nodes by far outnumber sources: the cost may grow with the cube of sources, never of nodes.
    wide = filled.shape[1] > filled.shape[0]
    solver: Literal["covariance_eigh", "full"] = "full" if wide else "covariance_eigh"
    return np.asarray(PCA(count, svd_solver=solver).fit_transform(filled))


def _fit(vectors: NDArray[np.float64], k: int, method: Method, seed: int) -> tuple[NDArray[np.int64], bool]:
    """Label vectors by one of the methods, and tell whether it converged."""
    limits = {"n_init": _STARTS[method], "max_iter": _MOST_ITERATIONS, "random_state": seed}
    if method == "kmeans" or k == len(vectors) == 1:  # a mixture takes two vectors at least
        means = KMeans(k, **limits).fit(vectors)
        return np.asarray(means.labels_), bool(means.n_iter_ < _MOST_ITERATIONS)
    spread = max(float(vectors.var(axis=0).mean()), np.finfo(np.float64).tiny)
    mixture = GaussianMixture(k, reg_covar=_LEAST_VARIANCE, **limits)
    return np.asarray(mixture.fit_predict(vectors / np.sqrt(spread))), bool(mixture.converged_)


def _by_size(labels: NDArray[np.int64]) -> NDArray[np.int32]:
    """Renumber labels by falling size, equal ones by their first member, without gaps."""
    _, first, inverse, count = np.unique(labels, return_index=True, return_inverse=True, return_counts=True)
    rank = np.empty(count.size, np.int32)
    rank[np.lexsort((first, -count))] = np.arange(count.size, dtype=np.int32)
    return rank[inverse]


def _means(vectors: NDArray[np.float64], labels: NDArray[np.int32]) -> NDArray[np.float64]:
    """Mean of the finite entries of each cluster's vectors, -inf where there is none."""
    known = np.isfinite(vectors)
    member = (labels == np.arange(labels.max() + 1)[:, None]).astype(np.float64)  # (k, n)
    count = member @ known.astype(np.float64)
    total = member @ np.where(known, vectors, 0.0)
    return np.asarray(np.divide(total, count, out=np.full(total.shape, -np.inf), where=count > 0))
