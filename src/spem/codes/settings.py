"""The settings of a code: everything that decides, with the vocabulary, what vector a file gets."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, fields, replace
from functools import partial
from importlib.metadata import version
from typing import Any, Literal, Self, get_args

from spem.codes.arguments import finite_number, truth_value, whole_number
from spem.codes.normalise import Scaling
from spem.codes.traits import AUTO, BESIDE, DEFAULTED, TRAITS, check_features, kinds_of
from spem.errors import ModelError, ParameterError
from spem.fields.operator import Boundary
from spem.fields.rho import DEFAULT_COUNT, DEFAULT_RANGE, Scheme
from spem.shapes.limits import DEFAULT_VOXELS

# Raised whenever the same file would get another code under the same settings.
CODE_FORMAT = 2

Components = Literal["largest", "all"]
# Settings that came later, and what files from before them mean.
_ADDED: dict[str, Any] = {"features": "spem", "n_pairs": 100, "levels": 1, "per_label": None}
_CHOICES = {
    "boundary": Boundary,
    "scheme": Scheme,
    "components": Components,
    "scaling": Scaling,
}
_CHECKS: dict[str, Callable[[str, Any], Any]] = {
    **dict.fromkeys(
        ("voxels", "n_rho", "n_pairs", "n_maps", "n_centers", "levels", "nodes_per_shape"), whole_number
    ),
    "moments": partial(whole_number, largest=2),
    # k-means takes seeds of 32 bits.
    "seed": partial(whole_number, least=0, largest=2**32 - 1),
    **dict.fromkeys(("threshold", "power"), finite_number),
    **dict.fromkeys(("dark", "per_label", "centred", "drop_boundary"), truth_value),
}
# Settings that may be None: no value, or, of settings for several kinds, the default of each.
_OPTIONAL = ("voxels", "threshold", "dark", "per_label", "n_centers", *DEFAULTED)
# Filled with the default of a kind where there is one; settings for several leave it to their parts.
_EACH_OWN: Any = None
# What a file says about itself.
_OF_FILES = ("code_format", "spem_version")


@dataclass(frozen=True, kw_only=True)
class Settings:
    """How a file becomes a code, from its voxels to the vector.

    Parameters
    ----------
    voxels
        Number of voxels inside a shape, reached by choice of the spacing; None keeps the grid
        of images and volumes.
    threshold
        Grey level of the surface, of images and grey volumes; found for each where None.
    dark
        Whether shapes are darker than the background, of images; found for each where None.
    per_label
        Whether every whole number but 0 of a volume is an object of its own, or all of them are one shape;
        where None those of volumes that look like labels are, see `spem.read_all`.
    components
        Whether the largest component of a shape is kept or all.
    features
        What codes are made of: ``"spem"``, the maps; ``"surface"``, the best known signature of the surface
        of a solid; both joined, ``"spem+surface"``; or any kinds of `spem.codes.traits.TRAITS` joined by
        ``+``. ``"auto"`` takes what is best for the dimension of the shapes.
    boundary
        Where the boundary lies: ``"surface"`` at the cuts, ``"voxel"`` as in the paper.
    rho_ranges
        For each band the least and largest ρ, in units of the shape's size ``volume ** (1 / d)``.
    scheme
        How ρ is spread over its range: linear in ρ, in ρ² or logarithmic.
    n_rho
        Number of ρ in each range.
    n_pairs
        Number of eigenpairs that signatures are made of.
    n_maps
        Number of projections taken from each band; of times, frequencies or energies of a signature. This,
        `power`, `scaling`, `moments` and `levels` are each kind's own where they are None.
    centred
        Whether the mean field is subtracted before the PCA.
    drop_boundary
        Whether nodes next to the boundary are left out of the code.
    n_centers
        Number of centres of each band's vocabulary; None for that of the kind, and fewer where training nodes
        are few.
    power
        Exponent α of (5.3).
    scaling
        How the intensities of the projections are made comparable: see `Normalisation`.
    moments
        1 for the residual sums of (5.2) only, 2 for second moments beside them: see `vlad`.
    levels
        Number of levels of the first map in which the nodes are summed apart: see `VLAD`. Where it is None
        maps have four, but one beside other kinds, which make up for what levels gain.
    nodes_per_shape
        Number of nodes drawn from each shape for training.
    seed
        Seed of the draw and of the vocabulary.
    code_format
        Number of the method; raised when the same settings would give other codes.
    spem_version
        Version of spem that the model was made with.

    Examples
    --------
    >>> Settings.from_json(Settings(voxels=250_000).to_json()).voxels
    250000
    """

    voxels: int | None = DEFAULT_VOXELS
    threshold: float | None = None
    dark: bool | None = None
    per_label: bool | None = None
    components: Components = "largest"
    features: str = AUTO
    boundary: Boundary = "surface"
    rho_ranges: tuple[tuple[float, float], ...] = (DEFAULT_RANGE,)
    scheme: Scheme = "linear"
    n_rho: int = DEFAULT_COUNT
    n_pairs: int = 100
    n_maps: int = _EACH_OWN
    centred: bool = False
    drop_boundary: bool = False
    n_centers: int | None = None
    power: float = _EACH_OWN
    scaling: Scaling = _EACH_OWN
    moments: int = _EACH_OWN
    levels: int = _EACH_OWN
    nodes_per_shape: int = 500
    seed: int = 0
    code_format: int = CODE_FORMAT
    spem_version: str = version("spem")

    def __post_init__(self) -> None:
        object.__setattr__(self, "rho_ranges", _as_ranges(self.rho_ranges))
        traits = TRAITS.get(check_features(self.features))
        for name, value in traits.defaults.items() if traits else ():
            if getattr(self, name) is None:
                object.__setattr__(self, name, value)
        for name, check in _CHECKS.items():
            value = getattr(self, name)
            if value is not None or name not in _OPTIONAL:
                object.__setattr__(self, name, check(name, value))
        for name, kind in _CHOICES.items():
            if getattr(self, name) not in (*get_args(kind), *((None,) if name in _OPTIONAL else ())):
                msg = f"{name}={getattr(self, name)!r} must be one of {', '.join(get_args(kind))}"
                raise ParameterError(msg)
        if self.code_format != CODE_FORMAT:
            msg = f"code_format={self.code_format!r}: this spem makes format {CODE_FORMAT}; leave it out"
            raise ParameterError(msg)
        if not 0 <= (self.power or 0.0) <= 1:
            msg = f"power={self.power} must lie in [0, 1]; the paper has 0.25"
            raise ParameterError(msg)
        if self.per_label and self.threshold is not None:
            msg = f"per_label: labels have no threshold, but threshold={self.threshold}; give one of them"
            raise ParameterError(msg)
        words = self.features.split("+")
        if set(words) <= set(TRAITS):
            self._check_kinds(words)
        n_maps = self.n_maps or TRAITS["spem"].defaults["n_maps"]
        if {"spem", AUTO} & set(words) and n_maps > self.n_rho:
            msg = f"n_maps={n_maps} must be at most n_rho={self.n_rho}, the number of ρ in each range"
            raise ParameterError(msg)

    def _check_kinds(self, chosen: Sequence[str]) -> None:
        """Refuse settings that have no meaning for these kinds of features."""
        for entry in fields(self):
            kinds = [kind for kind, traits in TRAITS.items() if entry.name in traits.own]
            usual = (entry.default, *(TRAITS[kind].defaults.get(entry.name) for kind in chosen))
            if kinds and not set(kinds) & set(chosen) and getattr(self, entry.name) not in usual:
                of, these = " or ".join(map(repr, kinds)), "+".join(chosen)
                advice = "leave it out, or name such features"
                msg = f"{entry.name}: a setting of features {of}, not of {these!r}; {advice}"
                raise ParameterError(msg)

    def _kinds(self, ndim: int | None) -> tuple[str, ...]:
        """Return the kinds that the features stand for, where all settings have a meaning for them."""
        kinds = kinds_of(self.features, ndim)
        self._check_kinds(kinds)
        return kinds

    def parts(self, ndim: int | None = None) -> tuple[Self, ...]:
        """Return settings for each kind of features alone, with the defaults of that kind.

        Parameters
        ----------
        ndim
            Dimension of the shapes, where features depend on it.

        Raises
        ------
        ParameterError
            When shapes of this dimension have no such features, or a setting is of others.

        Examples
        --------
        >>> [part.features for part in Settings(n_centers=32).parts(3)]
        ['spem', 'surface-wks']
        """
        kinds = self._kinds(ndim)
        beside = {name: value for name, value in BESIDE.items() if getattr(self, name) is None}
        alone = replace(self, **beside) if len(kinds) > 1 else self
        return tuple(alone._of_kind(kind) for kind in kinds)

    def resolved(self, ndim: int | None) -> Self:
        """Return the same settings with the kinds by name that the features stand for.

        Raises
        ------
        ParameterError
            As `parts` does.

        Examples
        --------
        >>> Settings().resolved(3).features
        'spem+surface-wks'
        """
        kinds = self._kinds(ndim)
        return self._of_kind(*kinds) if len(kinds) == 1 else replace(self, features="+".join(kinds))

    def _of_kind(self, kind: str) -> Self:
        """Return settings of one kind, those of other kinds at their defaults."""
        foreign = {name for traits in TRAITS.values() for name in traits.own} - set(TRAITS[kind].own)
        kept: dict[str, Any] = {entry.name: entry.default for entry in fields(self) if entry.name in foreign}
        return replace(self, features=kind, **kept)

    @property
    def n_bands(self) -> int:
        """Number of arrays of features of a shape, of settings of one kind: one a range of ρ, else one."""
        return len(self.rho_ranges) if "rho_ranges" in TRAITS[self.features].own else 1

    @classmethod
    def of(cls, options: Mapping[str, Any]) -> Self:
        """Make settings of options by name.

        Raises
        ------
        ParameterError
            When one is out of its range, or of a name that is no setting.

        Examples
        --------
        >>> Settings.of({"n_maps": 4}).n_maps
        4
        """
        known = [entry.name for entry in fields(cls)]
        unknown = ", ".join(name for name in options if name not in known)
        if unknown:
            usual = ", ".join(name for name in known if name not in _OF_FILES)
            msg = f"{unknown}: no setting of a code; expected any of {usual}"
            raise ParameterError(msg)
        return cls(**options)

    @classmethod
    def paper(cls, **changes: Any) -> Self:
        """Return the settings of 5.5: 250 000 voxels, v = 1 on voxels, six maps, 32 words.

        `changes` replace single ones. ρ runs from 1.6 to 16 voxels; the paper does not say.

        Examples
        --------
        >>> Settings.paper(voxels=15_000).n_centers
        32
        """
        if changes.get("features", "spem") != "spem":
            msg = f"features={changes['features']!r}: the settings of 5.5 are of SPEM maps; leave one out"
            raise ParameterError(msg)
        chosen: dict[str, Any] = {
            "features": "spem",
            "voxels": 250_000,
            "boundary": "voxel",
            "rho_ranges": ((0.0254, 0.254),),
            "n_maps": 6,
            "drop_boundary": True,
            "n_centers": 32,
            "power": 0.25,
            "scaling": "deviation",
            "moments": 1,
            "levels": 1,
        }
        return cls(**(chosen | changes))

    def to_json(self) -> dict[str, Any]:
        """Return the settings as plain values that `json` can write."""
        return asdict(self)

    @classmethod
    def from_json(cls, values: Mapping[str, Any], source: str = "settings") -> Self:
        """Make settings of what `to_json` gave.

        Parameters
        ----------
        values
            The plain values.
        source
            Where they came from, for messages.

        Raises
        ------
        ModelError
            When they were written for another method, or name a setting that is not known here. Settings that
            are newer than the file stand at what was done before there were such.
        """
        found = values.get("code_format")
        if found != CODE_FORMAT:
            advice = "upgrade spem" if isinstance(found, int) and found > CODE_FORMAT else "make it again"
            made = values.get("spem_version", "unknown")
            msg = f"{source}: codes of format {found} (spem {made}), this spem makes {CODE_FORMAT}; {advice}"
            raise ModelError(msg)
        values = _ADDED | dict(values)
        known = {entry.name for entry in fields(cls)}
        if set(values) != known:
            odd = ", ".join(sorted(set(values) ^ known))
            msg = f"{source}: settings do not fit this spem, which differs in: {odd}; make it again"
            raise ModelError(msg)
        try:
            return cls(**values)
        except (TypeError, ValueError) as error:
            msg = f"{source}: settings are damaged ({error}); make it again"
            raise ModelError(msg) from error


def _as_ranges(ranges: Any) -> tuple[tuple[float, float], ...]:
    """Check the ranges of ρ."""
    try:
        pairs = tuple((float(low), float(high)) for low, high in ranges)
    except (TypeError, ValueError) as error:
        msg = f"rho_ranges={ranges!r} must be pairs (low, high), such as [(0.025, 0.25)]"
        raise ParameterError(msg) from error
    for low, high in pairs:
        if not 0 < low < high < math.inf:
            msg = f"rho range ({low:g}, {high:g}) needs 0 < low < high < inf, in units of the shape's size"
            raise ParameterError(msg)
    if not pairs:
        msg = "rho_ranges is empty; give at least one (low, high)"
        raise ParameterError(msg)
    return pairs
