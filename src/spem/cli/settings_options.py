"""Options that decide how a file becomes a code, shared by the commands that make codes."""

from __future__ import annotations

import functools
import math
from collections.abc import Callable
from inspect import Parameter, signature
from typing import Annotated, Any, get_type_hints

import typer

from spem.cli.options import BoundaryChoice, ComponentsChoice, SchemeChoice
from spem.errors import ParameterError

# The parameter of a command that these options take the place of.
_PLACE = "options"


def _settings(
    voxels: Annotated[int | None, typer.Option(min=1, help="Voxels inside each shape. [15000]")] = None,
    own_grid: Annotated[
        bool, typer.Option("--own-grid", help="Keep the grid of images and volumes, whatever their size.")
    ] = False,
    features: Annotated[
        str | None,
        typer.Option(
            metavar="KIND[+KIND...]",
            help="spem, surface, spem+surface, or others by name. [auto: the best for the dimension]",
        ),
    ] = None,
    boundary: Annotated[BoundaryChoice | None, typer.Option(help="Where v = 1. [surface]")] = None,
    rho_range: Annotated[
        list[str] | None,
        typer.Option(metavar="LOW:HIGH", help="Range of ρ in units of the shape's size; may be repeated."),
    ] = None,
    n_rho: Annotated[int | None, typer.Option(min=1, help="Number of ρ in each range. [64]")] = None,
    rho_scheme: Annotated[SchemeChoice | None, typer.Option(help="How ρ is spread. [linear]")] = None,
    n_pairs: Annotated[
        int | None, typer.Option(min=1, help="Eigenpairs that a signature is made of. [100]")
    ] = None,
    n_maps: Annotated[
        int | None, typer.Option(min=1, help="Maps of each range. [8] Values of a signature. [surface: 16]")
    ] = None,
    n_centers: Annotated[
        int | None,
        typer.Option(min=1, help="Centres of each vocabulary. [64; fewer of few shapes]"),
    ] = None,
    power: Annotated[
        float | None, typer.Option(help="Exponent of the residuals, α of (5.3), 0 to 1. [0.5]")
    ] = None,
    scaling: Annotated[
        str | None,
        typer.Option(
            metavar="KIND",
            help="How maps are made comparable: standard, whiten, deviation or none. [standard]",
        ),
    ] = None,
    moments: Annotated[
        int | None, typer.Option(help="Moments of the residuals in a code, 1 or 2. [2]")
    ] = None,
    levels: Annotated[
        int | None, typer.Option(min=1, help="Levels of the first map that are summed apart. [4; joined: 1]")
    ] = None,
    drop_boundary: Annotated[
        bool | None, typer.Option("--drop-boundary/--keep-boundary", help="Leave out nodes at the boundary.")
    ] = None,
    threshold: Annotated[float | None, typer.Option(help="Grey level of the surface.")] = None,
    dark: Annotated[
        bool | None, typer.Option("--dark/--light", help="Whether shapes are darker than the ground.")
    ] = None,
    per_label: Annotated[
        bool | None,
        typer.Option("--per-label/--all-labels", help="Each label of a volume an object, or all one shape."),
    ] = None,
    components: Annotated[ComponentsChoice | None, typer.Option(help="What is kept. [largest]")] = None,
    seed: Annotated[int | None, typer.Option(help="Seed of the vocabulary. [0]")] = None,
) -> dict[str, Any]:
    """Return the settings that were given, by the names that `spem.codes.settings.Settings` has for them."""
    if own_grid and voxels is not None:
        msg = f"--own-grid and --voxels {voxels} exclude each other; give one of them"
        raise ParameterError(msg)
    given: dict[str, Any] = {
        "voxels": voxels,
        "features": features,
        "boundary": boundary,
        "rho_ranges": _ranges(rho_range),
        "n_rho": n_rho,
        "scheme": rho_scheme,
        "n_pairs": n_pairs,
        "n_maps": n_maps,
        "n_centers": n_centers,
        "power": power,
        "scaling": scaling,
        "moments": moments,
        "levels": levels,
        "drop_boundary": drop_boundary,
        "threshold": threshold,
        "dark": dark,
        "per_label": per_label,
        "components": components,
        "seed": seed,
    }
    chosen = {key: getattr(value, "value", value) for key, value in given.items() if value is not None}
    return chosen | ({"voxels": None} if own_grid else {})


def with_settings(command: Callable[..., None]) -> Callable[..., None]:
    """Give a command the options of settings, in place of its parameter ``options``.

    Parameters
    ----------
    command
        A command; it is called with the settings that were given, by name.

    Examples
    --------
    >>> @with_settings
    ... def show(options: dict[str, Any]) -> None:
    ...     typer.echo(options)
    >>> show(voxels=500, n_maps=None)
    {'voxels': 500}
    """
    taken = signature(_settings).parameters
    hints = get_type_hints(command, include_extras=True) | get_type_hints(_settings, include_extras=True)
    merged: list[Parameter] = []
    for name, parameter in signature(command).parameters.items():
        merged.extend(taken.values() if name == _PLACE else [parameter])
    merged = [each.replace(kind=Parameter.KEYWORD_ONLY, annotation=hints[each.name]) for each in merged]

    @functools.wraps(command)
    def call(**given: Any) -> None:
        options = _settings(**{name: given.pop(name) for name in taken if name in given})
        command(**given, **{_PLACE: options})

    call.__signature__ = signature(command).replace(parameters=merged)  # type: ignore[attr-defined]
    call.__annotations__ = {each.name: each.annotation for each in merged} | {"return": None}
    return call


def _ranges(texts: list[str] | None) -> tuple[tuple[float, float], ...] | None:
    """Parse ranges of ρ."""
    if not texts:
        return None
    ranges = []
    for text in texts:
        try:
            low, high = (float(part) for part in text.split(":"))
        except ValueError as error:
            msg = f"--rho-range {text}: expected LOW:HIGH, such as 0.025:0.25, in units of the shape's size"
            raise ParameterError(msg) from error
        if not 0 < low < high < math.inf:
            msg = f"--rho-range {text}: expected 0 < LOW < HIGH, in units of the shape's size"
            raise ParameterError(msg)
        ranges.append((low, high))
    return tuple(ranges)
