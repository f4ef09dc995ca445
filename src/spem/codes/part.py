"""What a model has learnt of one kind of node features, and the code that it makes of them."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from spem.codes.bands import Bands, as_bands
from spem.codes.normalise import Normalisation
from spem.codes.settings import Settings
from spem.codes.vlad import VLAD, aggregate, concatenate, encode
from spem.codes.vocabulary import Residuals
from spem.errors import ModelError, ParameterError

# Words of each kind where no number is asked for, and the training nodes that each has to stand for: sixteen
# silhouettes of 128 points do not make 64 words.
N_CENTERS = 64
_NODES_PER_CENTER = 64


@dataclass(frozen=True, eq=False)
class Part:
    """Normalisations and vocabularies with their spreads, of one kind of features.

    Parameters
    ----------
    settings
        Settings of this kind alone.
    normalisations
        For each band what makes node features of maps.
    centers
        For each band ``(n_centers, n_maps)`` vocabulary.
    spreads
        For each band ``(n_centers, n_maps)`` mean squared difference of training nodes from their
        centre; none with settings of one moment.
    cuts
        For each band ``(levels - 1,)`` values of the first map, over its largest, between levels; none with
        settings of one level.
    """

    settings: Settings
    normalisations: tuple[Normalisation, ...]
    centers: tuple[NDArray[np.float32], ...]
    spreads: tuple[NDArray[np.float32], ...] = ()
    cuts: tuple[NDArray[np.float64], ...] = ()

    def __post_init__(self) -> None:
        s = self.settings
        shapes = [array.shape for array in self.to_arrays("", 0).values()]
        n_bands, d, k = s.n_bands, self.n_values, s.n_centers or self.n_centers
        expected = [(d,), (d, d), (k, d)] * n_bands + [(k, d)] * n_bands * (s.moments - 1)
        expected += [(s.levels - 1,)] * n_bands * (s.levels > 1)
        if shapes != expected:
            msg = f"a model of {n_bands} bands, {k} centres and {s.n_maps} maps got arrays {shapes}"
            raise ModelError(msg)

    @classmethod
    def fit(cls, settings: Settings, shapes: Iterable[Bands]) -> Self:
        """Learn from the features of shapes, for each a tuple of ``(n_nodes, n_values)`` a band."""
        learner = VLAD(
            settings.n_centers or N_CENTERS,
            power=settings.power,
            nodes_per_shape=settings.nodes_per_shape,
            scaling=settings.scaling,
            moments=settings.moments,
            levels=settings.levels,
            nodes_per_center=1 if settings.n_centers else _NODES_PER_CENTER,
            random_state=settings.seed,
        ).fit(shapes)
        centers = (words.cluster_centers_.astype(np.float32) for words in learner.vocabularies_)
        spreads = (spread.astype(np.float32) for spread in learner.spreads_ * (settings.moments - 1))
        cuts = tuple(learner.cuts_) if settings.levels > 1 else ()
        return cls(settings, tuple(learner.normalisations_), tuple(centers), tuple(spreads), cuts)

    @property
    def n_values(self) -> int:
        """Number of values a node."""
        return len(self.normalisations[0].mean) if self.normalisations else 0

    @property
    def n_centers(self) -> int:
        """Number of centres of each band."""
        return len(self.centers[0]) if self.centers else 0

    @property
    def n_code(self) -> int:
        """Length of a code."""
        return self.settings.levels * self.settings.moments * sum(words.size for words in self.centers)

    def encode(self, bands: Any, name: str, model: str = "of this part") -> NDArray[np.float64]:
        """Make the code ``(n_code,)`` of the bands of this kind; `name` and `model` are for messages."""
        checked = as_bands(bands, name)
        found, expected = [m.shape[1] for m in checked], [words.shape[1] for words in self.centers]
        if found != expected:
            msg = f"{name} has {found} maps in its bands, model {model} expects {expected}"
            raise ParameterError(msg)
        learnt = self.normalisations, self.centers, self.settings.power
        return encode(checked, *learnt, self.spreads or None, self.cuts or None)

    def encode_residuals(self, found: Sequence[Residuals]) -> NDArray[np.float64]:
        """Make the code ``(n_code,)`` from what was summed over the nodes of a shape, band by band."""
        spreads = self.spreads or (None,) * len(self.centers)
        bands = zip(found, spreads, strict=True)
        return concatenate([aggregate(each, self.settings.power, spread) for each, spread in bands])

    def to_arrays(self, prefix: str, first: int) -> dict[str, NDArray[Any]]:
        """Return the learnt arrays by name, bands being numbered from `first`."""
        arrays: dict[str, NDArray[Any]] = {}
        for band, (normal, words) in enumerate(zip(self.normalisations, self.centers, strict=True), first):
            arrays[f"{prefix}mean.{band}"] = normal.mean
            arrays[f"{prefix}transform.{band}"] = normal.transform
            arrays[f"{prefix}centers.{band}"] = words
        arrays |= {f"{prefix}spreads.{band}": each for band, each in enumerate(self.spreads, first)}
        return arrays | {f"{prefix}cuts.{band}": each for band, each in enumerate(self.cuts, first)}

    @classmethod
    def from_arrays(
        cls, settings: Settings, arrays: Mapping[str, NDArray[Any]], prefix: str, first: int
    ) -> Self:
        """Make a part of what `to_arrays` gave."""
        bands = range(first, first + settings.n_bands)
        normalisations = tuple(
            Normalisation(arrays[f"{prefix}mean.{band}"], arrays[f"{prefix}transform.{band}"])
            for band in bands
        )
        centers = tuple(arrays[f"{prefix}centers.{band}"] for band in bands)
        spreads = tuple(arrays[f"{prefix}spreads.{band}"] for band in bands if settings.moments == 2)
        cuts = tuple(arrays[f"{prefix}cuts.{band}"] for band in bands if settings.levels > 1)
        return cls(settings, normalisations, centers, spreads, cuts)
