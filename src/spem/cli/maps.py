"""``spem maps``: SPEM maps of one shape, as arrays and a picture."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from spem.cli.options import (
    Boundary,
    BoundaryChoice,
    Components,
    ComponentsChoice,
    Dark,
    Device,
    GridSpacing,
    InnerRadius,
    Json,
    Label,
    Plot,
    SchemeChoice,
    ShapeFile,
    SignedDistance,
    Spacing,
    Threshold,
    Voxels,
    find_device,
    read_shape,
    tell_repairs,
)
from spem.cli.output import write_figure, write_npz
from spem.cli.results import about, check_drawable, check_targets, summarise
from spem.errors import ParameterError

MapsFile = Annotated[
    Path | None,
    typer.Option("--output", "-o", metavar="M.npz", help="Points, maps, basis, variance, rho and spacing."),
]
RhoLow = Annotated[
    float | None, typer.Option("--rho-min", help="Least ρ, in the unit of the spacing. [by size]")
]
RhoHigh = Annotated[
    float | None,
    typer.Option("--rho-max", help="Largest ρ, in the unit of the spacing. [by size]"),
]


def maps(
    shape: ShapeFile,
    n_maps: Annotated[int, typer.Option(min=1, help="Number of maps.")] = 6,
    rho_min: RhoLow = None,
    rho_max: RhoHigh = None,
    n_rho: Annotated[int, typer.Option(min=1, help="Number of ρ.")] = 64,
    rho_scheme: Annotated[
        SchemeChoice, typer.Option(help="How ρ is spread over its range.")
    ] = SchemeChoice.linear,
    centred: Annotated[bool, typer.Option("--centred", help="Subtract the mean field first.")] = False,
    output: MapsFile = None,
    plot: Plot = None,
    voxels: Voxels = None,
    spacing: Spacing = None,
    inner_radius: InnerRadius = None,
    grid_spacing: GridSpacing = None,
    boundary: Boundary = BoundaryChoice.surface,
    threshold: Threshold = None,
    dark: Dark = None,
    label: Label = None,
    signed_distance: SignedDistance = None,
    components: Components = ComponentsChoice.largest,
    device: Device = "cpu",
    json: Json = False,
) -> None:
    """Compute the SPEM maps of a shape.

    Maps are the principal components of the fields over ρ. The file holds points (n, d), maps (n, k),
    basis (n_rho, k), variance and its share explained (k,), and what that of `spem field` has beside
    values. Without bounds, ρ runs over a range set by the shape's size.

    \b
    Examples:
      spem maps hand.png -o hand.npz --plot hand-maps.png
      spem maps cat.off --n-maps 4 --rho-min 1 --rho-max 30 --n-rho 128 --rho-scheme log -o cat.npz
    """  # noqa: D301
    where = find_device(device)
    check_targets(shape, output, plot)
    grid = {"voxels": voxels, "spacing": spacing, "inner_radius": inner_radius, "grid_spacing": grid_spacing}
    inside = {"threshold": threshold, "dark": dark, "label": label, "signed_distance": signed_distance}
    found = read_shape(shape, **grid, **inside, components=components)  # type: ignore[arg-type]
    tell_repairs(found)
    check_drawable(found, plot)
    from spem.api.fields import maps as project
    from spem.fields.rho import sample_rho

    _check_bounds(found.size, rho_min, rho_max)
    rho = sample_rho(found.size, rho_min, rho_max, n_rho, rho_scheme.value)
    result = project(found, n_maps, centred=centred, rho=rho, boundary=boundary.value, device=where)
    arrays = {"basis": result.basis, "variance": result.variance, "explained": result.explained, "rho": rho}
    if output is not None:
        write_npz(output, points=found.points, maps=result.values, **arrays, **about(found, boundary.value))
    if plot is not None:
        from spem.plots.figures import figure_maps

        write_figure(plot, figure_maps(result))
    summary = {"boundary": boundary.value, "rho": rho[[0, -1]], "n_rho": rho.size, "n_maps": n_maps}
    summary |= {"variance": result.variance, "explained": result.explained}
    summarise(found, summary, output, plot, json=json)


def _check_bounds(size: float, low: float | None, high: float | None) -> None:
    """Refuse one bound of ρ that lies beyond what the other is by default."""
    from spem.fields.rho import DEFAULT_RANGE

    least, largest = (share * size for share in DEFAULT_RANGE)
    if high is None and low is not None and low >= largest:
        msg = f"--rho-min {low:g}: --rho-max is {largest:g} by default, for a shape of this size; give it too"
        raise ParameterError(msg)
    if low is None and high is not None and 0 < high <= least:
        msg = f"--rho-max {high:g}: --rho-min is {least:g} by default, for a shape of this size; give it too"
        raise ParameterError(msg)
