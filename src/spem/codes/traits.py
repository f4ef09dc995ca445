"""The kinds of node features by name: what shapes they are of, which settings are theirs, which defaults."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Any

from spem.errors import ParameterError

# What codes of all kinds are made with, unless a kind has its own.
_USUAL: Mapping[str, Any] = MappingProxyType(
    {"n_maps": 8, "power": 0.5, "scaling": "standard", "moments": 2, "levels": 1}
)


@dataclass(frozen=True)
class Traits:
    """What is known of a kind of node features before any is computed.

    Parameters
    ----------
    of
        What the features are, in words.
    ndims
        Dimensions of the shapes that have such features; empty for all.
    own
        Settings that belong to some kinds alone, this one among them.
    defaults
        Settings that codes of this kind take where none are given: see `_USUAL` for their names.
    """

    of: str
    ndims: tuple[int, ...] = ()
    own: tuple[str, ...] = ()
    defaults: Mapping[str, Any] = field(default_factory=lambda: _USUAL)


_OF_SWEEPS = ("rho_ranges", "scheme", "n_rho", "centred", "n_maps", "levels")
_OF_SPECTRA = ("n_pairs", "n_maps")
_OF_MAPS: Mapping[str, Any] = MappingProxyType({**_USUAL, "levels": 4})
_FINE: Mapping[str, Any] = MappingProxyType({**_USUAL, "n_maps": 16})
_COARSE: Mapping[str, Any] = MappingProxyType({**_USUAL, "n_maps": 6})
# Of roots of histograms second moments tell little, for twice the length.
_OF_CONTOURS: Mapping[str, Any] = MappingProxyType({**_USUAL, "n_maps": 64, "moments": 1})
TRAITS: Mapping[str, Traits] = MappingProxyType(
    {
        "spem": Traits("SPEM maps", own=_OF_SWEEPS, defaults=_OF_MAPS),
        "hks": Traits("heat kernel signature of the solid", own=_OF_SPECTRA),
        "si-hks": Traits("the same, invariant to scale", own=_OF_SPECTRA),
        "wks": Traits("wave kernel signature of the solid", own=_OF_SPECTRA),
        "surface-hks": Traits("heat kernel signature of the surface", (3,), _OF_SPECTRA, _FINE),
        "surface-si-hks": Traits("the same, invariant to scale", (3,), _OF_SPECTRA, _COARSE),
        "surface-wks": Traits("wave kernel signature of the surface", (3,), _OF_SPECTRA, _FINE),
        "sources": Traits("what pieces of the contour see of each other", (2,), defaults=_OF_CONTOURS),
        "shape-context": Traits("what each point of the contour sees", (2,), defaults=_OF_CONTOURS),
        "inner-distance": Traits("the same, along ways inside", (2,), defaults=_OF_CONTOURS),
    }
)
# What to take of shapes of a dimension where the kind is not named; of others there are maps alone. In the
# plane the sources tell what maps tell, and more: maps beside them add nothing.
_SURFACE: Mapping[int, tuple[str, ...]] = MappingProxyType(
    {2: ("shape-context", "inner-distance"), 3: ("surface-wks",)}
)
_BEST: Mapping[int, tuple[str, ...]] = MappingProxyType(
    {2: ("sources", *_SURFACE[2]), 3: ("spem", *_SURFACE[3])}
)
# Defaults of kinds beside others, which make up for what levels gain.
BESIDE: Mapping[str, Any] = MappingProxyType({"levels": 1})
AUTO, SURFACE = "auto", "surface"
DEFAULTED = tuple(_USUAL)


def check_features(features: Any) -> str:
    """Return a word for features, or words joined by ``+``, where they are known.

    Raises
    ------
    ParameterError
        When a word is not, stands twice, or ``"auto"`` is not alone.

    Examples
    --------
    >>> check_features("spem+surface")
    'spem+surface'
    """
    words = features.split("+") if isinstance(features, str) else []
    known = [*TRAITS, SURFACE]
    if features != AUTO and (not words or set(words) - set(known) or len(set(words)) < len(words)):
        msg = f"features={features!r} must be {AUTO}, or one or more of {', '.join(known)}, joined by +"
        raise ParameterError(msg)
    return str(features)


def kinds_of(features: str, ndim: int | None) -> tuple[str, ...]:
    """Return the kinds that features stand for, of shapes of a dimension.

    Parameters
    ----------
    features
        As `check_features` takes them.
    ndim
        Dimension of the shapes; where it is None, features that depend on it are SPEM maps.

    Raises
    ------
    ParameterError
        When shapes of this dimension have no such features.

    Examples
    --------
    >>> kinds_of("auto", 3), kinds_of("auto", 4), kinds_of("spem+surface", 3)
    (('spem', 'surface-wks'), ('spem',), ('spem', 'surface-wks'))
    """
    if features == AUTO:
        return _BEST.get(ndim or 0, ("spem",))
    kinds: list[str] = []
    for word in features.split("+"):
        dimensions = tuple(_SURFACE) if word == SURFACE else TRAITS[word].ndims
        if dimensions and ndim is not None and ndim not in dimensions:
            shapes = " or ".join(f"{n}-D" for n in dimensions)
            msg = f"features {word!r} are of {shapes} shapes, not of {ndim}-D ones; take features 'spem'"
            raise ParameterError(msg)
        kinds.extend(_SURFACE.get(ndim or 0, ("spem",)) if word == SURFACE else (word,))
    return tuple(kind for kind in TRAITS if kind in kinds)
