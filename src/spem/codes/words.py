"""Why two shapes are alike: what each visual word brings to the correlation of their codes, and where."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from spem.codes.bands import Bands
from spem.codes.joining import standardised
from spem.codes.model import Model
from spem.codes.normalise import peak_share
from spem.codes.part import Part
from spem.codes.vocabulary import nearest_centers
from spem.errors import ModelError

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Word:
    """A visual word, and what it brings to the correlation of two codes.

    Parameters
    ----------
    kind
        Kind of features.
    part, band
        Number of the kind in the model, and of the band of it.
    level
        Level of the first map that its nodes are of; 0 where the kind has one level.
    center
        Number of the centre in the vocabulary of the band.
    share
        What it adds to the correlation; negative where the shapes differ.
    """

    kind: str
    part: int
    band: int
    level: int
    center: int
    share: float


def explain(model: Model, query: ArrayLike, answer: ArrayLike) -> list[Word]:
    """Divide the correlation of two codes among the visual words.

    Codes at mean zero and unit length have the correlation for their product, and each of its terms belongs
    to one word: one centre of the vocabulary of a band, at one level, of a kind of features. The shares of
    all words add up to the correlation, one minus the distance of the shapes.

    Parameters
    ----------
    model
        The model of both codes.
    query, answer
        ``(n_code,)`` codes, as `Model.encode` makes them, or as an index keeps them.

    Returns
    -------
    list of Word
        All words of the model, the largest share first; the same whichever shape asks.

    Raises
    ------
    ModelError
        When a code is not of the length of the model's.

    Examples
    --------
    >>> rng = np.random.default_rng(0)
    >>> from spem.codes.settings import Settings
    >>> shapes = [rng.random((50, 2)) for _ in range(3)]
    >>> model = Model.fit(Settings(features="spem", n_maps=2, n_centers=4), shapes)
    >>> words = explain(model, model.encode(shapes[0]), model.encode(shapes[0]))
    >>> len(words), round(sum(word.share for word in words), 6)
    (16, 1.0)
    """
    terms = _standard(model, query) * _standard(model, answer)
    words = [
        Word(part.settings.features, number, band, level, center, float(share))
        for number, (part, own) in enumerate(zip(model.parts, _split(model, terms), strict=True))
        for (band, level, center), share in np.ndenumerate(own.sum(axis=(3, 4)))
    ]
    return sorted(words, key=lambda word: -word.share)


def speaking_rows(
    model: Model, words: Sequence[Word], features: Bands, other: ArrayLike, most: int = 200
) -> list[NDArray[np.int64]]:
    """Find the rows of a shape's features that speak for words: nodes, points or arcs.

    A row x of centre c speaks for it as much as its difference from c, and the square of that beside the mean
    square σ² where the model has second moments, point where the code a of the other shape does:

        (x − c) · a₁ / |Σ (x − c)| + ((x − c)² − σ²) · a₂ / |Σ (x − c)² − σ²|.

    With α = 1 their sum over the rows of a word is its share, but for a common factor and the codes' means.

    Parameters
    ----------
    model
        The model.
    words
        Words of it, as `explain` returns them.
    features
        For each band ``(n_rows, n_values)`` features of the shape, kind after kind, as
        `spem.codes.kinds.shape_features` computes them.
    other
        ``(n_code,)`` code of the shape that it is compared with.
    most
        Most rows for each word.

    Returns
    -------
    list of numpy.ndarray
        For each word the rows that speak for it, the strongest first; empty where it has no row of its own.

    Raises
    ------
    ModelError
        When the features or the code are not of the model.

    Examples
    --------
    >>> rng = np.random.default_rng(0)
    >>> from spem.codes.settings import Settings
    >>> shapes = [rng.random((50, 2)) for _ in range(3)]
    >>> model = Model.fit(Settings(features="spem", n_maps=2, n_centers=4), shapes)
    >>> code = model.encode(shapes[1])
    >>> best = explain(model, model.encode(shapes[0]), code)[:2]
    >>> [rows.size > 0 for rows in speaking_rows(model, best, (shapes[0],), code)]
    [True, True]
    """
    blocks = _split(model, _standard(model, other))
    starts = np.cumsum([0, *(part.settings.n_bands for part in model.parts)])
    if len(features) != starts[-1]:
        msg = f"features of {len(features)} bands, but model {model.digest} has {starts[-1]}"
        raise ModelError(msg)
    kept: dict[tuple[int, int], _Assigned] = {}
    found = []
    for word in words:
        place = (word.part, word.band)
        if place not in kept:
            own = features[starts[word.part] + word.band]
            kept[place] = _Assigned.of(model.parts[word.part], word.band, own)
        block = blocks[word.part][word.band, word.level, word.center]
        found.append(kept[place].speaking(word, block, most))
    return found


@dataclass(frozen=True, eq=False)
class _Assigned:
    """The rows of one band of a shape, each at its centre and level."""

    features: NDArray[np.floating]
    centers: NDArray[np.floating]
    spreads: NDArray[np.floating] | None
    center: NDArray[np.int32]
    level: NDArray[np.int64]

    @classmethod
    def of(cls, part: Part, band: int, maps: NDArray[np.floating]) -> _Assigned:
        """Assign rows as codes are made: (5.1), and by the first map as it is."""
        rows, words = part.normalisations[band].apply(maps), part.centers[band]
        level = np.zeros(len(rows), np.int64)
        if part.cuts:
            level = np.searchsorted(part.cuts[band], peak_share(maps))
        spreads = part.spreads[band] if part.spreads else None
        return cls(rows, words, spreads, nearest_centers(rows, words), level)

    def speaking(self, word: Word, block: Array, most: int) -> NDArray[np.int64]:
        """Return the rows that speak for a word, given the ``(n_moments, n_values)`` block of the other."""
        rows = np.flatnonzero((self.center == word.center) & (self.level == word.level))
        apart = self.features[rows].astype(np.float64) - self.centers[word.center]
        voice = _along(apart, block[0])
        if self.spreads is not None:
            voice += _along(apart**2 - self.spreads[word.center], block[1])
        order = np.argsort(-voice, kind="stable")[:most]
        agreeing = order[voice[order] > 0]
        return np.asarray(rows[agreeing if agreeing.size else order[:1]])


def _along(terms: Array, direction: Array) -> Array:
    """Return the products of rows with a direction, over the length of their sum."""
    length = float(np.linalg.norm(terms.sum(axis=0)))
    return np.asarray(terms @ direction / (length if length > 0 else 1.0))


def _standard(model: Model, code: ArrayLike) -> Array:
    """Return a code at mean zero and unit length."""
    values = np.asarray(code, np.float64)
    if values.shape != (model.n_code,):
        msg = f"a code of shape {values.shape}, but those of model {model.digest} have {model.n_code} numbers"
        raise ModelError(msg)
    return standardised(values)


def _split(model: Model, code: Array) -> list[Array]:
    """Return for each part what is its own in a code, as (bands, levels, centres, moments, values)."""
    ends = np.cumsum([part.n_code for part in model.parts])
    return [
        own.reshape(len(part.centers), part.settings.levels, part.n_centers, part.settings.moments, -1)
        for part, own in zip(model.parts, np.split(code, ends[:-1]), strict=True)
    ]
