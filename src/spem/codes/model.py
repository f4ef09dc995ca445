"""The model: settings and learnt arrays, enough to give any new shape a code that fits the others."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from spem.codes.arguments import whole_number
from spem.codes.bands import as_bands
from spem.codes.container import content_hash, read_container, write_container
from spem.codes.normalise import Normalisation
from spem.codes.settings import Settings
from spem.codes.vlad import VLAD, encode
from spem.errors import ModelError, ParameterError


@dataclass(frozen=True, eq=False)
class Model:
    """Settings, normalisations and vocabularies with their spreads.

    Parameters
    ----------
    settings
        How a file becomes a code.
    normalisations
        For each band what makes node features of maps.
    centers
        For each band ``(n_centers, n_maps)`` vocabulary.
    spreads
        For each band ``(n_centers, n_maps)`` mean squared difference of training nodes from their
        centre; none with settings of one moment.
    ndim
        Dimension of the shapes that it was learnt from, the only ones it codes; None where it was
        learnt from maps of unknown origin, and nothing is checked.
    """

    settings: Settings
    normalisations: tuple[Normalisation, ...]
    centers: tuple[NDArray[np.float32], ...]
    spreads: tuple[NDArray[np.float32], ...] = ()
    ndim: int | None = None

    def __post_init__(self) -> None:
        s = self.settings
        shapes = [array.shape for array in self.to_arrays().values()]
        n_bands, d = s.n_bands, s.n_maps
        expected = [(d,), (d, d), (s.n_centers, d)] * n_bands + [(s.n_centers, d)] * n_bands * (s.moments - 1)
        if shapes != expected:
            msg = f"a model of {n_bands} bands, {s.n_centers} centres and {s.n_maps} maps got arrays {shapes}"
            raise ModelError(msg)
        if self.ndim is not None:
            object.__setattr__(self, "ndim", whole_number("ndim", self.ndim))

    @classmethod
    def fit(cls, settings: Settings, shapes: Iterable[Any], ndim: int | None = None) -> Self:
        """Learn normalisations and vocabularies from the maps of shapes.

        Parameters
        ----------
        settings
            How the maps were made and the codes are to be.
        shapes
            For each shape a tuple with the ``(n_nodes, n_maps)`` maps of each band; a generator
            is read once.
        ndim
            Dimension of the shapes, where it is known.

        Examples
        --------
        >>> rng = np.random.default_rng(0)
        >>> settings = Settings(n_maps=2, n_centers=4)
        >>> Model.fit(settings, [rng.random((50, 2)) for _ in range(3)])
        Model(..., 1 band, 4 centres, 2 maps, codes of length 16)
        """
        learner = VLAD(
            settings.n_centers,
            power=settings.power,
            nodes_per_shape=settings.nodes_per_shape,
            scaling=settings.scaling,
            moments=settings.moments,
            random_state=settings.seed,
        ).fit(shapes)
        centers = (words.cluster_centers_.astype(np.float32) for words in learner.vocabularies_)
        spreads = (spread.astype(np.float32) for spread in learner.spreads_ * (settings.moments - 1))
        return cls(settings, tuple(learner.normalisations_), tuple(centers), tuple(spreads), ndim)

    @property
    def n_code(self) -> int:
        """Length of a code."""
        return self.settings.moments * sum(centers.size for centers in self.centers)

    @cached_property
    def digest(self) -> str:
        """Twelve hex digits that name this model: equal settings and arrays have equal digests."""
        return content_hash(self.to_header(), self.to_arrays())[:12]

    def require_ndim(self, ndim: int, name: str) -> None:
        """Refuse a shape of another dimension than those that the model was learnt from.

        Parameters
        ----------
        ndim
            Dimension of the shape.
        name
            What to call it in the message.

        Raises
        ------
        ModelError
            When the dimensions differ.
        """
        if self.ndim is not None and ndim != self.ndim:
            msg = f"{name}: a {ndim}-D shape, but the vocabulary is of {self.ndim}-D ones; give such a shape"
            raise ModelError(msg)

    def encode(self, maps: Any, name: str = "shape") -> NDArray[np.float32]:
        """Make the code of a shape.

        Parameters
        ----------
        maps
            A tuple with the ``(n_nodes, n_maps)`` maps of each band, or one array for one band.
        name
            What to call the shape in messages.

        Returns
        -------
        NDArray
            ``(n_code,)`` code of unit L2 norm.

        Raises
        ------
        ParameterError
            When the maps are not finite or not of the model's bands.
        """
        bands = as_bands(maps, name)
        found, expected = [m.shape[1] for m in bands], [words.shape[1] for words in self.centers]
        if found != expected:
            msg = f"{name} has {found} maps in its bands, model {self.digest} expects {expected}"
            raise ParameterError(msg)
        learnt = self.normalisations, self.centers, self.settings.power, self.spreads or None
        return encode(bands, *learnt).astype(np.float32)

    def to_header(self) -> dict[str, Any]:
        """Return the settings, and the dimension where it is known, for a file."""
        return {"settings": self.settings.to_json()} | ({} if self.ndim is None else {"ndim": self.ndim})

    def to_arrays(self, prefix: str = "") -> dict[str, NDArray[Any]]:
        """Return the learnt arrays by name, for a file."""
        arrays: dict[str, NDArray[Any]] = {}
        for band, (normal, words) in enumerate(zip(self.normalisations, self.centers, strict=True)):
            arrays[f"{prefix}mean.{band}"] = normal.mean
            arrays[f"{prefix}transform.{band}"] = normal.transform
            arrays[f"{prefix}centers.{band}"] = words
        return arrays | {f"{prefix}spreads.{band}": array for band, array in enumerate(self.spreads)}

    @classmethod
    def from_parts(
        cls, header: Mapping[str, Any], arrays: Mapping[str, NDArray[Any]], source: str, prefix: str = ""
    ) -> Self:
        """Make a model of what `to_header` and `to_arrays` gave."""
        values = header.get("settings", {})
        if not isinstance(values, Mapping):
            msg = f"{source}: the settings are no table of names and values; make it again"
            raise ModelError(msg)
        checked = Settings.from_json(values, source)
        bands = range(checked.n_bands)
        try:
            normalisations = tuple(
                Normalisation(arrays[f"{prefix}mean.{band}"], arrays[f"{prefix}transform.{band}"])
                for band in bands
            )
            centers = tuple(arrays[f"{prefix}centers.{band}"] for band in bands)
            spreads = tuple(arrays[f"{prefix}spreads.{band}"] for band in bands if checked.moments == 2)
            return cls(checked, normalisations, centers, spreads, header.get("ndim"))
        except KeyError as error:
            msg = f"{source}: the model lacks the array {error}; make it again"
            raise ModelError(msg) from error
        except ParameterError as error:
            msg = f"{source}: the model is damaged ({error}); make it again"
            raise ModelError(msg) from error

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write the model to a file, in one step."""
        write_container(path, "model", self.to_header(), self.to_arrays())

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> Self:
        """Read a model.

        Raises
        ------
        ReadError
            When the file is missing, truncated, changed, or no model.
        ModelError
            When it was made by another version of the method.
        """
        header, arrays = read_container(path, "model")
        return cls.from_parts(header, arrays, str(path))

    def __repr__(self) -> str:
        s, n_bands = self.settings, len(self.centers)
        bands = f"{n_bands} band{'s' if n_bands > 1 else ''}"
        size = f"{s.n_centers} centres, {s.n_maps} maps, codes of length {self.n_code}"
        return f"Model({self.digest}, {bands}, {size})"
