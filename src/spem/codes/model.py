"""The model: settings and learnt arrays, enough to give any new shape a code that fits the others."""

from __future__ import annotations

import math
import os
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import islice
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from spem.codes.arguments import whole_number
from spem.codes.bands import Bands
from spem.codes.container import content_hash, read_container, write_container
from spem.codes.joining import fusion_weights, join_codes
from spem.codes.part import Part
from spem.codes.settings import Settings
from spem.errors import ModelError, ParameterError

# Training shapes, spread evenly over all, whose distances tell the weights of the parts: more of them move
# these by less than a percent.
_WEIGHING_SHAPES = 200


@dataclass(frozen=True, eq=False)
class Model:
    """Settings, and what was learnt of each kind of features.

    Parameters
    ----------
    settings
        How a file becomes a code; its features are named kind by kind.
    parts
        What was learnt of each kind, in the order of the features.
    weights
        ``(n_parts,)`` share of each part in the correlation distance of joined codes; see `join_codes`.
    ndim
        Dimension of the shapes that it was learnt from, the only ones it codes; None where it was
        learnt from maps of unknown origin, and nothing is checked.
    """

    settings: Settings
    parts: tuple[Part, ...]
    weights: tuple[float, ...] = (1.0,)
    ndim: int | None = None

    def __post_init__(self) -> None:
        kinds = tuple(part.settings for part in self.parts)
        if kinds != self.settings.parts(self.ndim) or len(self.weights) != len(kinds):
            found = "+".join(part.settings.features for part in self.parts)
            msg = f"a model of {self.settings.features} got parts {found} and {len(self.weights)} weights"
            raise ModelError(msg)
        object.__setattr__(self, "weights", tuple(map(float, self.weights)))
        if not all(map(math.isfinite, self.weights)) or min(self.weights) < 0 or not sum(self.weights) > 0:
            msg = (
                f"weights={self.weights}: expected {len(kinds)} numbers of at least 0, one a kind, not all 0"
            )
            raise ModelError(msg)
        if self.ndim is not None:
            object.__setattr__(self, "ndim", whole_number("ndim", self.ndim))

    @classmethod
    def fit(cls, settings: Settings, shapes: Iterable[Any], ndim: int | None = None) -> Self:
        """Learn normalisations and vocabularies from the maps of shapes, and how to weigh several kinds.

        Parameters
        ----------
        settings
            How the maps were made and the codes are to be.
        shapes
            For each shape a tuple with the ``(n_nodes, n_maps)`` maps of each band, kind after kind. Where
            there are several kinds they are gone through more than once, and a generator is kept whole.
        ndim
            Dimension of the shapes, where it is known.

        Examples
        --------
        >>> rng = np.random.default_rng(0)
        >>> settings = Settings(features="spem", n_maps=2, n_centers=4)
        >>> Model.fit(settings, [rng.random((50, 2)) for _ in range(3)])
        Model(..., 1 band, 4 centres, 2 maps, codes of length 64)
        """
        resolved = settings.resolved(ndim)
        chosen = resolved.parts(ndim)
        if len(chosen) == 1:
            return cls(resolved, (Part.fit(chosen[0], shapes),), ndim=ndim)
        again = list(shapes) if isinstance(shapes, Iterator) else shapes
        slices, count = _slices(chosen), 0

        def passed(where: slice) -> Iterator[Any]:
            """Yield the bands of one kind, and count the shapes."""
            nonlocal count
            for count, bands in enumerate(again, 1):  # noqa: B007
                yield _bands(bands, slices[-1].stop)[where]

        parts = tuple(Part.fit(each, passed(where)) for each, where in zip(chosen, slices, strict=True))
        unweighted = cls(resolved, parts, (1.0,) * len(parts), ndim)
        some = islice(again, 0, None, -(-count // _WEIGHING_SHAPES))
        codes = zip(*map(unweighted.codes, some), strict=True)
        weights = fusion_weights([np.stack(kind) for kind in codes])
        return cls(resolved, parts, tuple(weights.tolist()), ndim)

    @property
    def n_code(self) -> int:
        """Length of a code."""
        return sum(part.n_code for part in self.parts)

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
        return self.join(self.codes(maps, name))

    def join(self, codes: Sequence[NDArray[np.float64]]) -> NDArray[np.float32]:
        """Make the code ``(n_code,)`` of a shape of those of its parts, as `codes` makes them."""
        code = codes[0] if len(codes) == 1 else join_codes(codes, self.weights)
        return code.astype(np.float32)

    def codes(self, maps: Any, name: str = "shape") -> list[NDArray[np.float64]]:
        """Make the code of each part apart, as `encode` takes the maps."""
        if len(self.parts) == 1:
            return [self.parts[0].encode(maps, name, self.digest)]
        bands = maps if isinstance(maps, tuple) else (maps,)
        slices = _slices([part.settings for part in self.parts])
        if len(bands) != slices[-1].stop:
            msg = f"{name} has {len(bands)} bands, model {self.digest} expects {slices[-1].stop}"
            raise ParameterError(msg)
        return [
            part.encode(bands[where], name, self.digest)
            for part, where in zip(self.parts, slices, strict=True)
        ]

    def to_header(self) -> dict[str, Any]:
        """Return the settings, and the dimension where it is known, for a file."""
        return {"settings": self.settings.to_json()} | ({} if self.ndim is None else {"ndim": self.ndim})

    def to_arrays(self, prefix: str = "") -> dict[str, NDArray[Any]]:
        """Return the learnt arrays by name, for a file."""
        arrays: dict[str, NDArray[Any]] = {}
        for part, where in zip(self.parts, _slices([each.settings for each in self.parts]), strict=True):
            arrays |= part.to_arrays(prefix, where.start)
        return arrays if len(self.parts) == 1 else arrays | {f"{prefix}weights": np.array(self.weights)}

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
        try:
            chosen = checked.parts(header.get("ndim"))
            parts = tuple(
                Part.from_arrays(each, arrays, prefix, where.start)
                for each, where in zip(chosen, _slices(chosen), strict=True)
            )
            weights = (1.0,) if len(parts) == 1 else _weights(arrays[f"{prefix}weights"], source)
            return cls(checked, parts, weights, header.get("ndim"))
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
        if len(self.parts) > 1:
            of = ", ".join(
                f"{part.settings.features} {weight:.2f}"
                for part, weight in zip(self.parts, self.weights, strict=True)
            )
            return f"Model({self.digest}, {of}, codes of length {self.n_code})"
        n_bands = len(self.parts[0].centers)
        bands = f"{n_bands} band{'s' if n_bands > 1 else ''}"
        size = (
            f"{self.parts[0].n_centers} centres, {self.parts[0].n_values} maps, codes of length {self.n_code}"
        )
        return f"Model({self.digest}, {bands}, {size})"


def _weights(array: NDArray[Any], source: str) -> tuple[float, ...]:
    """Read the weights of the parts, which `Model` checks further."""
    if array.dtype.kind != "f" or array.ndim != 1:
        msg = f"{source}: the weights are no row of numbers; make it again"
        raise ModelError(msg)
    return tuple(array.tolist())


def _bands(bands: Any, count: int) -> Bands:
    """Refuse features of other kinds, since the rows of one array would pass for bands."""
    if not isinstance(bands, tuple) or len(bands) != count:
        found = f"{len(bands)} bands" if isinstance(bands, tuple) else "one array"
        msg = f"a training shape has {found}; give a tuple of {count}, those of each kind in turn"
        raise ParameterError(msg)
    return bands


def _slices(parts: Sequence[Settings]) -> list[slice]:
    """Return where the bands of each part stand among those of a shape."""
    ends = np.cumsum([part.n_bands for part in parts]).tolist()
    return [slice(end - part.n_bands, end) for part, end in zip(parts, ends, strict=True)]
