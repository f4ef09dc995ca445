"""VLAD: one vector of fixed length for the node features of a shape (5.1)-(5.3)."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any, Self, get_args

import numpy as np
from numpy.random import RandomState
from numpy.typing import NDArray
from sklearn.base import BaseEstimator, ClassNamePrefixFeaturesOutMixin, TransformerMixin
from sklearn.utils import check_random_state
from sklearn.utils.validation import check_is_fitted

from spem.codes.bands import Bands, iterate_bands
from spem.codes.normalise import Normalisation, Scaling, peak_share, unit_rms
from spem.codes.vocabulary import Residuals, Vocabulary, sum_residuals
from spem.errors import ParameterError

_FEWEST_CENTERS = 8


def vlad(
    features: NDArray[np.floating],
    centers: NDArray[np.floating],
    power: float = 0.25,
    spreads: NDArray[np.floating] | None = None,
    levels: NDArray[np.integer] | None = None,
    n_levels: int = 1,
) -> NDArray[np.float64]:
    """Aggregate the node features of one shape against a vocabulary: (5.1)-(5.3).

    Each node goes to its nearest centre, the differences are summed per centre, each sum is
    brought to unit L2 norm and then to sign(R) |R| ** power, and the whole to unit L2 norm. A
    centre without a node, or whose differences cancel, has zeros.

    With `spreads` the second moments come beside the first: for each centre c with its nodes x,

        Q = Σ (S(x) - c)² - σ²,

    elementwise, where σ² is the mean square of the training nodes of c, is normalised like R and
    put next to it. R tells where the nodes of a shape lie about a word, Q how widely.

    With `levels` the nodes of each level have sums of their own, normalised by themselves, so that the
    many nodes of one level do not drown what the few of another tell.

    Parameters
    ----------
    features
        ``(n_nodes, n_features)`` node features.
    centers
        ``(n_centers, n_features)`` vocabulary.
    power
        Exponent α of (5.3), in [0, 1].
    spreads
        ``(n_centers, n_features)`` mean squares σ² to compare with; None for first moments only.
    levels
        ``(n_nodes,)`` level of each node, below `n_levels`; all 0 by default.
    n_levels
        Number of levels.

    Returns
    -------
    NDArray
        ``(n_levels * n_centers * n_features,)`` code, level by level and in these centre by centre; twice
        that with `spreads`.

    Examples
    --------
    >>> vlad(np.array([[0.0, 0.0], [0.3, 0.4]]), np.array([[0.0, 0.0], [5.0, 5.0]]), power=1.0)
    array([0.6, 0.8, 0. , 0. ])
    """
    return aggregate(sum_residuals(features, centers, levels, n_levels), power, spreads)


def aggregate(
    found: Residuals, power: float = 0.25, spreads: NDArray[np.floating] | None = None
) -> NDArray[np.float64]:
    """Make the vector of one band from the sums over the nodes of each word: (5.3).

    Parameters
    ----------
    found
        What the nodes differ from their centres by.
    power, spreads
        As `vlad` takes them.

    Returns
    -------
    NDArray
        ``(n_rows * n_features,)`` code, row by row; twice that with `spreads`.

    Examples
    --------
    >>> aggregate(sum_residuals(np.array([[3.0, 4.0]]), np.zeros((1, 2))), power=1.0)
    array([0.6, 0.8])
    """
    moments = [found.sums] if spreads is None else [found.sums, found.excess(spreads)]
    rows = np.hstack([moment / _length(moment, axis=1) for moment in moments])
    code = np.sign(rows) * np.abs(rows) ** power
    return np.asarray((code / _length(code)).ravel())


def encode(
    bands: Bands,
    normalisations: Sequence[Normalisation],
    centers: Sequence[NDArray[np.floating]],
    power: float = 0.25,
    spreads: Sequence[NDArray[np.floating]] | None = None,
    cuts: Sequence[NDArray[np.floating]] | None = None,
) -> NDArray[np.float64]:
    """Make the code of one shape from its maps, one band of ρ after the other.

    The maps of each band are normalised and aggregated by `vlad`; the vectors of the bands are
    concatenated, and the whole has unit L2 norm.

    Parameters
    ----------
    bands
        For each band ``(n_nodes, n_maps)`` maps of the shape.
    normalisations
        For each band what makes node features of the maps.
    centers
        For each band ``(n_centers, n_maps)`` vocabulary.
    power
        Exponent α of (5.3).
    spreads
        For each band ``(n_centers, n_maps)`` mean squares; None for first moments only.
    cuts
        For each band ``(n_levels - 1,)`` values of `peak_share` that divide the nodes into levels; None for
        one level.

    Returns
    -------
    NDArray
        ``(n_code,)`` code: n_levels · n_centers · n_maps entries for each band and moment.

    Examples
    --------
    >>> maps, plain, words = np.array([[3.0], [4.0]]), Normalisation.none(1), np.zeros((1, 1))
    >>> encode((maps, -maps), (plain, plain), (words, words)).round(3)
    array([ 0.707, -0.707])
    """
    squares = [None] * len(bands) if spreads is None else spreads
    between = [np.empty(0)] * len(bands) if cuts is None else cuts
    codes = []
    for maps, normal, words, spread, inner in zip(
        bands, normalisations, centers, squares, between, strict=True
    ):
        levels = np.searchsorted(inner, peak_share(maps)) if len(inner) else None
        codes.append(vlad(normal.apply(maps), words, power, spread, levels, len(inner) + 1))
    return concatenate(codes)


def concatenate(codes: Sequence[NDArray[np.float64]]) -> NDArray[np.float64]:
    """Put the vectors of the bands one after the other, and bring the whole to unit L2 norm.

    Examples
    --------
    >>> concatenate([np.array([3.0]), np.array([4.0])])
    array([0.6, 0.8])
    """
    code = np.concatenate(codes)
    return np.asarray(code / _length(code))


class VLAD(ClassNamePrefixFeaturesOutMixin, TransformerMixin, BaseEstimator):  # type: ignore[misc]
    """Learn a normalisation and a vocabulary for each band of ρ, and code shapes with them.

    `fit` and `transform` take an iterable with one entry a shape: its maps ``(n_nodes, n_maps)``,
    or a tuple of such arrays, one a band, over the same nodes. Shapes may differ in their number
    of nodes. One map may be given as ``(n_nodes,)``, so that a two-dimensional array is a
    collection of shapes of one map each. The paper has ``n_centers=32, power=0.25,
    scaling="deviation", moments=1``; the defaults retrieve better.

    Parameters
    ----------
    n_centers
        Number of centres of each band's vocabulary.
    power
        Exponent α of (5.3), in [0, 1].
    nodes_per_shape
        Number of nodes drawn from each shape for training, without replacement.
    scaling
        ``"standard"``, ``"whiten"``, ``"deviation"`` or ``"none"``: see `Normalisation`.
    moments
        1 for the residual sums of (5.2), 2 for their squares beside them: see `vlad`.
    levels
        Number of levels of `peak_share` that nodes are summed in, with equally many training nodes each.
    nodes_per_center
        Least number of training nodes for each centre: where there are fewer nodes than that, fewer centres
        are made, but no fewer than eight. Words that a handful of nodes decide tell shapes apart badly.
    n_init
        Number of k-means++ starts for each vocabulary.
    random_state
        Seed or generator of the draw and of the starts.

    Attributes
    ----------
    normalisations_
        For each band the fitted `Normalisation`.
    vocabularies_
        For each band the fitted `Vocabulary`.
    spreads_
        For each band ``(n_centers, n_maps)`` mean squared difference of training nodes from their centre.
    cuts_
        For each band ``(levels - 1,)`` values of `peak_share` between levels.
    n_maps_
        For each band the number of maps.

    Examples
    --------
    >>> rng = np.random.default_rng(0)
    >>> shapes = [rng.random((n, 2)) for n in (30, 40, 50)]
    >>> VLAD(n_centers=4, random_state=0).fit_transform(shapes).shape
    (3, 16)
    """

    def __init__(
        self,
        n_centers: int = 64,
        *,
        power: float = 0.5,
        nodes_per_shape: int = 500,
        scaling: Scaling = "standard",
        moments: int = 2,
        levels: int = 1,
        nodes_per_center: int = 1,
        n_init: int = 1,
        random_state: int | RandomState | None = None,
    ) -> None:
        self.n_centers = n_centers
        self.power = power
        self.nodes_per_shape = nodes_per_shape
        self.scaling = scaling
        self.moments = moments
        self.levels = levels
        self.nodes_per_center = nodes_per_center
        self.n_init = n_init
        self.random_state = random_state

    def fit(self, X: Iterable[Any], y: Any = None) -> Self:
        """Learn normalisations and vocabularies from the maps of the shapes `X`; `y` is ignored."""
        self._check_parameters()
        random = check_random_state(self.random_state)
        raw, unit, shares = _draw(iterate_bands(X), self.nodes_per_shape, random)
        self.n_maps_ = tuple(samples[0].shape[1] for samples in raw)
        self.normalisations_, self.vocabularies_, self.spreads_, self.cuts_ = [], [], [], []
        for band in range(len(raw)):
            normal = self._normalisation(raw[band], unit[band])
            # At unit rms over its own shape, a sample has only the affine part before it.
            nodes = ((np.concatenate(unit[band]) - normal.mean) @ normal.transform).astype(np.float32)
            seed = random.randint(np.iinfo(np.int32).max)
            words = Vocabulary(self._count_centers(len(nodes)), n_init=self.n_init, random_state=seed).fit(
                nodes
            )
            self.normalisations_.append(normal)
            self.vocabularies_.append(words)
            self.spreads_.append(sum_residuals(nodes, words.cluster_centers_).spreads)
            self.cuts_.append(_quantiles(np.concatenate(shares[band]), self.levels))
        return self

    def transform(self, X: Iterable[Any]) -> NDArray[np.float64]:
        """Return the codes of the shapes `X`, ``(n_shapes, n_code)``, each of unit L2 norm."""
        check_is_fitted(self)
        centers = [words.cluster_centers_ for words in self.vocabularies_]
        spreads = self.spreads_ if self.moments == 2 else None
        shapes = iterate_bands(X, self.n_maps_)
        learnt = self.normalisations_, centers, self.power, spreads, self.cuts_
        return np.stack([encode(bands, *learnt) for bands in shapes])

    @property
    def _n_features_out(self) -> int:
        """Length of a code, as the naming of the columns asks for it."""
        return int(
            self.levels * self.moments * sum(words.cluster_centers_.size for words in self.vocabularies_)
        )

    def __sklearn_tags__(self) -> Any:
        """Declare that the entries of the input may have any length, in two or three dimensions."""
        tags = super().__sklearn_tags__()
        tags.input_tags.three_d_array = True
        return tags

    def _count_centers(self, n_nodes: int) -> int:
        """Return the number of centres that so many training nodes make."""
        if self.nodes_per_center == 1:
            return self.n_centers
        return min(self.n_centers, max(_FEWEST_CENTERS, n_nodes // self.nodes_per_center), n_nodes)

    def _normalisation(
        self, raw: Sequence[NDArray[np.floating]], unit: Sequence[NDArray[np.floating]]
    ) -> Normalisation:
        """Learn the normalisation of one band from samples as given and at unit rms."""
        if self.scaling == "standard":
            return Normalisation.standard(unit)
        if self.scaling == "whiten":
            return Normalisation.whitening(unit)
        if self.scaling == "deviation":
            return Normalisation.by_deviation(raw)
        return Normalisation.none(unit[0].shape[1])

    def _check_parameters(self) -> None:
        """Refuse parameters out of their range."""
        if self.scaling not in get_args(Scaling):
            msg = f"scaling={self.scaling!r} must be one of {', '.join(get_args(Scaling))}"
            raise ParameterError(msg)
        if self.moments not in (1, 2):
            msg = f"moments={self.moments} must be 1 or 2"
            raise ParameterError(msg)
        if not 0 <= self.power <= 1:
            msg = f"power={self.power} must lie in [0, 1]; the paper has 0.25"
            raise ParameterError(msg)
        for name in ("n_centers", "nodes_per_shape", "levels", "nodes_per_center", "n_init"):
            if getattr(self, name) < 1:
                msg = f"{name}={getattr(self, name)} must be at least 1"
                raise ParameterError(msg)


def _length(values: NDArray[np.float64], axis: int | None = None) -> NDArray[np.float64]:
    """Return L2 norms to divide by: one where the norm is zero."""
    norm = np.linalg.norm(values, axis=axis, keepdims=True)
    return np.where(norm > 0, norm, 1.0)


def _draw(
    shapes: Iterable[Bands], n_nodes: int, random: RandomState
) -> tuple[list[list[NDArray[np.floating]]], ...]:
    """Sample nodes of all shapes, the same in all bands: as given, at unit rms, and shares of the peak."""
    drawn: tuple[list[list[NDArray[np.floating]]], ...] = ([], [], [])
    for bands in shapes:
        if not drawn[0]:
            drawn = tuple([[] for _ in bands] for _ in drawn)
        total = len(bands[0])
        rows = np.arange(total) if total <= n_nodes else np.sort(random.permutation(total)[:n_nodes])
        for band, maps in enumerate(bands):
            for kept, values in zip(drawn, (maps, unit_rms(maps), peak_share(maps)), strict=True):
                kept[band].append(values[rows])
    return drawn


def _quantiles(shares: NDArray[np.floating], levels: int) -> NDArray[np.float64]:
    """Return the values that divide training nodes into levels of equal size."""
    return np.asarray(np.quantile(shares.astype(np.float64), np.arange(1, levels) / levels))
