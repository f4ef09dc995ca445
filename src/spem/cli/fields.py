"""``spem field``: fields of one shape, of its whole boundary or of single sources on it."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from spem.cli.options import (
    PATCHES,
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
from spem.cli.results import about, check_drawable, check_targets, parse_rho, summarise
from spem.errors import ParameterError

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from spem.fields.solvers.engine import Backend
    from spem.shapes.shape import Shape

Rho = Annotated[
    list[str] | None,
    typer.Option(
        metavar="RHO",
        help="Screening lengths in the unit of the spacing, or inf: 4,8,16; repeatable. [of sources: inf]",
    ),
]
Source = Annotated[
    list[str] | None,
    typer.Option(
        metavar="A,B[,C]", help="Single source: the boundary node nearest to this point; repeatable."
    ),
]
Patch = Annotated[
    list[str] | None,
    typer.Option(
        metavar="A,B[,C]", help="Single source: the patch of the boundary nearest to it; repeatable."
    ),
]
Patches = Annotated[
    int | None,
    typer.Option(min=1, help="Number of patches of the boundary, of nearly equal area. [200]"),
]


def field(
    shape: ShapeFile,
    rho: Rho = None,
    source: Source = None,
    patch: Patch = None,
    patches: Patches = None,
    output: Annotated[
        Path | None,
        typer.Option("--output", "-o", metavar="F.npz", help="Points, values, rho and spacing."),
    ] = None,
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

    With --source or --patch, v = 1 there and 0 on the rest of the boundary; the two are not mixed.

    The file holds points (n, d), values (n, n_rho), rho, spacing, origin of the grid, name and boundary.
    Coordinates are the shape's own: array-axis order (row, column, ...) times the spacing for images and
    volumes, x y z for meshes. Of NIfTI there is the file's affine too: it takes array indices, which are
    points over the spacing of the file, to the world.

    Of sources it holds values and log, the natural logarithms of v, which reach farther, as
    (n, n_rho, n_sources), and sources (n_sources, d), where they are. The picture shows log v.

    \b
    Examples:
      spem field hand.png --rho 4,16,inf -o hand.npz --plot hand-fields.png
      spem field cat.off --rho 3 --voxels 100000 --boundary voxel -o cat.npz
      spem field hand.png --source 12,40 -o tip.npz --plot tip.png
      spem field cat.off --patch 0.1,-20,31.5 --patches 100 --rho 5,inf -o ear.npz
    """  # noqa: D301
    if device != "cpu" and (source or patch):
        msg = (
            f"--device {device}: single sources are solved on the processor, by elimination, "
            "since their logarithms need every digit; leave it out"
        )
        raise ParameterError(msg)
    where = find_device(device)
    check_targets(shape, output, plot)
    screening = _screening(rho, single=bool(source or patch))
    _check_sources(source, patch, patches)
    grid = {"voxels": voxels, "spacing": spacing, "inner_radius": inner_radius, "grid_spacing": grid_spacing}
    inside = {"threshold": threshold, "dark": dark, "label": label, "signed_distance": signed_distance}
    found = read_shape(shape, **grid, **inside, components=components)  # type: ignore[arg-type]
    tell_repairs(found)
    check_drawable(found, plot)
    if source or patch:
        from spem.cli.sources import SourceRequest, write_sources

        request = SourceRequest(tuple(source or patch or ()), bool(patch), patches or PATCHES, boundary.value)
        write_sources(found, request, screening, output, plot, json=json)
    else:
        _write(found, screening, boundary, where, output, plot, json=json)


def _write(
    shape: Shape,
    rho: NDArray[np.float64],
    boundary: BoundaryChoice,
    where: Backend | None,
    output: Path | None,
    plot: Path | None,
    *,
    json: bool,
) -> None:
    """Solve for the fields of the whole boundary, write and draw them."""
    from spem.api.fields import field as solve

    values = solve(shape, rho, boundary=boundary.value, device=where)
    if output is not None:
        write_npz(output, points=shape.points, values=values, rho=rho, **about(shape, boundary.value))
    if plot is not None:
        from spem.plots.figures import figure_fields

        write_figure(plot, figure_fields(shape, values, [f"ρ = {value:g}" for value in rho]))
    summary: dict[str, Any] = {"boundary": boundary.value, "rho": rho}
    summary |= {"min": values.min(axis=0), "mean": values.mean(axis=0)}
    summarise(shape, summary, output, plot, json=json)


def _screening(texts: list[str] | None, *, single: bool) -> NDArray[np.float64]:
    """Return ρ, `inf` by default where sources are given."""
    if not texts and not single:
        msg = "Missing option '--rho': expected screening lengths, such as --rho 4,8,16, or a --source"
        raise ParameterError(msg)
    from spem.fields.rho import check_rho

    return check_rho(parse_rho(texts or ["inf"]))


def _check_sources(source: list[str] | None, patch: list[str] | None, patches: int | None) -> None:
    """Refuse options of sources that do not go together."""
    if source and patch:
        msg = "--source and --patch exclude each other; give one of them"
        raise ParameterError(msg)
    if patches is not None and not patch:
        msg = f"--patches {patches}: no patch is asked for; give --patch A,B[,C] too, or leave it out"
        raise ParameterError(msg)
