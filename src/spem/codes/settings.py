"""The settings of a code: everything that decides, with the vocabulary, what vector a file gets."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass, fields
from importlib.metadata import version
from typing import Any, Literal, Self, get_args

from spem.codes.normalise import Scaling
from spem.errors import ModelError, ParameterError

# Raised whenever the same file would get another code under the same settings.
CODE_FORMAT = 1

BoundaryKind = Literal["surface", "voxel"]
SchemeKind = Literal["linear", "squared", "log"]
ComponentsKind = Literal["largest", "all"]
_CHOICES = {"boundary": BoundaryKind, "scheme": SchemeKind, "components": ComponentsKind, "scaling": Scaling}


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
    components
        Whether the largest component of a shape is kept or all.
    boundary
        Where the boundary lies: ``"surface"`` at the cuts, ``"voxel"`` as in the paper.
    rho_ranges
        For each band the least and largest ρ, in units of the shape's size ``volume ** (1 / d)``.
    scheme
        How ρ is spread over its range: linear in ρ, in ρ² or logarithmic.
    n_rho
        Number of ρ in each range.
    n_maps
        Number of projections taken from each band.
    centred
        Whether the mean field is subtracted before the PCA.
    drop_boundary
        Whether nodes next to the boundary are left out of the code.
    n_centers
        Number of centres of each band's vocabulary.
    power
        Exponent α of (5.3).
    scaling
        How the intensities of the projections are made comparable: see `Normalisation`.
    moments
        1 for the residual sums of (5.2) only, 2 for second moments beside them: see `vlad`.
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

    voxels: int | None = 15_000
    threshold: float | None = None
    dark: bool | None = None
    components: ComponentsKind = "largest"
    boundary: BoundaryKind = "surface"
    rho_ranges: tuple[tuple[float, float], ...] = ((0.0255, 0.255),)
    scheme: SchemeKind = "linear"
    n_rho: int = 64
    n_maps: int = 8
    centred: bool = False
    drop_boundary: bool = False
    n_centers: int = 64
    power: float = 0.5
    scaling: Scaling = "standard"
    moments: int = 2
    nodes_per_shape: int = 500
    seed: int = 0
    code_format: int = CODE_FORMAT
    spem_version: str = version("spem")

    def __post_init__(self) -> None:
        ranges = tuple((float(low), float(high)) for low, high in self.rho_ranges)
        object.__setattr__(self, "rho_ranges", ranges)
        for low, high in ranges:
            if not 0 < low < high < math.inf:
                msg = (
                    f"rho range ({low:g}, {high:g}) needs 0 < low < high < inf, in units of the shape's size"
                )
                raise ParameterError(msg)
        if not ranges:
            msg = "rho_ranges is empty; give at least one (low, high)"
            raise ParameterError(msg)
        for name in ("voxels", "n_rho", "n_maps", "n_centers", "nodes_per_shape"):
            value = getattr(self, name)
            if value is not None and value < 1:
                msg = f"{name}={value} must be at least 1"
                raise ParameterError(msg)
        for name, kind in _CHOICES.items():
            if getattr(self, name) not in get_args(kind):
                msg = f"{name}={getattr(self, name)!r} must be one of {', '.join(get_args(kind))}"
                raise ParameterError(msg)
        if self.moments not in (1, 2):
            msg = f"moments={self.moments!r} must be 1 or 2"
            raise ParameterError(msg)
        if not 0 <= self.power <= 1:
            msg = f"power={self.power} must lie in [0, 1]; the paper has 0.25"
            raise ParameterError(msg)

    @classmethod
    def paper(cls, **changes: Any) -> Self:
        """Return the settings of 5.5: 250 000 voxels, v = 1 on voxels, six maps, 32 words.

        `changes` replace single ones. ρ runs from 1.6 to 16 voxels; the paper does not say.

        Examples
        --------
        >>> Settings.paper(voxels=15_000).n_centers
        32
        """
        chosen: dict[str, Any] = {
            "voxels": 250_000,
            "boundary": "voxel",
            "rho_ranges": ((0.0254, 0.254),),
            "n_maps": 6,
            "drop_boundary": True,
            "n_centers": 32,
            "power": 0.25,
            "scaling": "deviation",
            "moments": 1,
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
            When they were written for another method, or name a setting that is not known here.
        """
        found = values.get("code_format")
        if found != CODE_FORMAT:
            advice = "upgrade spem" if isinstance(found, int) and found > CODE_FORMAT else "make it again"
            made = values.get("spem_version", "unknown")
            msg = f"{source}: codes of format {found} (spem {made}), this spem makes {CODE_FORMAT}; {advice}"
            raise ModelError(msg)
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
