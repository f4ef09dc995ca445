"""``spem field`` and ``spem maps``: fields and SPEM maps of one shape, as arrays and pictures."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

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
    check_device,
    read_shape,
    tell_repairs,
)
from spem.cli.output import PLOT_SUFFIXES, check_target, print_json, write_figure, write_npz
from spem.errors import ParameterError, ShapeError

if TYPE_CHECKING:
    from spem.shapes.shape import Shape

NPZ = (".npz",)
FieldFile = Annotated[
    Path | None,
    typer.Option("--output", "-o", metavar="F.npz", help="Points, values, rho and spacing."),
]
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


def field(
    shape: ShapeFile,
    rho: Annotated[
        list[str],
        typer.Option(
            metavar="RHO", help="Screening lengths in the unit of the spacing, or inf: 4,8,16; repeatable."
        ),
    ],
    output: FieldFile = None,
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
    """Compute the fields of a shape: Δv − v/ρ² = 0, v = 1 around it.

    The file holds points (n, d), values (n, n_rho), rho, spacing, origin of the grid, name and boundary.
    Coordinates are the shape's own: array-axis order (row, column, ...) times the spacing for images and
    volumes, x y z for meshes. Of NIfTI there is the file's affine too: it takes array indices, which are
    points over the spacing of the file, to the world.

    \b
    Examples:
      spem field hand.png --rho 4,16,inf -o hand.npz --plot hand-fields.png
      spem field cat.off --rho 3 --voxels 100000 --boundary voxel -o cat.npz
    """  # noqa: D301
    check_device(device)
    _check_targets(output, plot)
    from spem.fields.rho import check_rho

    values_of_rho = check_rho(_numbers(rho))
    grid = {"voxels": voxels, "spacing": spacing, "inner_radius": inner_radius, "grid_spacing": grid_spacing}
    inside = {"threshold": threshold, "dark": dark, "label": label, "signed_distance": signed_distance}
    found = read_shape(shape, **grid, **inside, components=components)  # type: ignore[arg-type]
    tell_repairs(found)
    _check_drawable(found, plot)
    from spem.api.fields import field as solve

    values = solve(found, values_of_rho, boundary=boundary.value)
    if output is not None:
        about = _about(found, boundary.value)
        write_npz(output, points=found.points, values=values, rho=values_of_rho, **about)
    if plot is not None:
        from spem.plots.figures import figure_fields

        titles = [f"ρ = {value:g}" for value in values_of_rho]
        write_figure(plot, figure_fields(found, values, titles))
    summary = {"boundary": boundary.value, "rho": values_of_rho}
    summary |= {"min": values.min(axis=0), "mean": values.mean(axis=0)}
    _summarise(found, summary, output, plot, json=json)


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
    check_device(device)
    _check_targets(output, plot)
    grid = {"voxels": voxels, "spacing": spacing, "inner_radius": inner_radius, "grid_spacing": grid_spacing}
    inside = {"threshold": threshold, "dark": dark, "label": label, "signed_distance": signed_distance}
    found = read_shape(shape, **grid, **inside, components=components)  # type: ignore[arg-type]
    tell_repairs(found)
    _check_drawable(found, plot)
    from spem.api.fields import maps as project
    from spem.fields.rho import sample_rho

    _check_bounds(found.size, rho_min, rho_max)
    rho = sample_rho(found.size, rho_min, rho_max, n_rho, rho_scheme.value)
    result = project(found, n_maps, centred=centred, rho=rho, boundary=boundary.value)
    arrays = {"basis": result.basis, "variance": result.variance, "explained": result.explained, "rho": rho}
    if output is not None:
        write_npz(output, points=found.points, maps=result.values, **arrays, **_about(found, boundary.value))
    if plot is not None:
        from spem.plots.figures import figure_maps

        write_figure(plot, figure_maps(result))
    summary = {"boundary": boundary.value, "rho": rho[[0, -1]], "n_rho": rho.size, "n_maps": n_maps}
    summary |= {"variance": result.variance, "explained": result.explained}
    _summarise(found, summary, output, plot, json=json)


def _numbers(texts: list[str]) -> list[float]:
    """Parse ρ, several of them parted by commas."""
    try:
        return [float(part) for text in texts for part in text.split(",")]
    except ValueError as error:
        msg = f"--rho {' '.join(texts)}: expected numbers above zero, or inf, such as 4,8,16"
        raise ParameterError(msg) from error


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


def _check_targets(output: Path | None, plot: Path | None) -> None:
    """Make sure that there is something to write, and that it can be written."""
    if output is None and plot is None:
        msg = "nothing to write; give -o FILE.npz, --plot FILE.png or both"
        raise ParameterError(msg)
    if output is not None:
        check_target(output, NPZ)
    if plot is not None:
        check_target(plot, PLOT_SUFFIXES)


def _check_drawable(shape: Shape, plot: Path | None) -> None:
    """Refuse to draw what has too many dimensions, before anything is solved."""
    if plot is not None:
        from spem.plots.values import require_drawable

        try:
            require_drawable(shape)
        except ShapeError as error:
            msg = f"{shape.name}: has {shape.ndim} dimensions and no picture is made of more than 3; "
            raise ShapeError(msg + "leave out --plot, give -o") from error


def _about(shape: Shape, boundary: str) -> dict[str, Any]:
    """Return what arrays of nodes need to be understood without the shape."""
    about = {"spacing": shape.spacing, "origin": shape.origin, "name": shape.name, "boundary": boundary}
    return about if shape.affine is None else about | {"affine": shape.affine}


def _summarise(
    shape: Shape, summary: dict[str, Any], output: Path | None, plot: Path | None, *, json: bool
) -> None:
    """Tell what was computed and where it lies."""
    if json:
        about = {"name": shape.name, "voxels": shape.n_nodes, "spacing": shape.spacing}
        print_json(about | summary | {"output": output, "plot": plot, "repairs": shape.report.repairs})
        return
    typer.echo(repr(shape))
    for written in (output, plot):
        if written is not None:
            typer.echo(f"wrote {written}")
