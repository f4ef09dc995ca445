"""``spem parts``: parts of a shape, or the same parts of several, as arrays, pictures, pages and meshes."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from spem.cli.options import (
    PATCHES,
    BoundaryChoice,
    Components,
    ComponentsChoice,
    Dark,
    GridSpacing,
    InnerRadius,
    Json,
    Label,
    Plot,
    SignedDistance,
    Spacing,
    Threshold,
    Voxels,
    read_shape,
    tell_repairs,
)
from spem.cli.output import PLOT_SUFFIXES, check_target, print_json, print_table, write_figure
from spem.cli.part_files import PartFiles
from spem.cli.results import facts, spare_sources
from spem.errors import ParameterError

if TYPE_CHECKING:
    from spem.decomposition.choice import ErrorCurve
    from spem.decomposition.parts import Parts
    from spem.shapes.shape import Shape

PARTS, SPARSITY = 8, 0.1
AUTO, ALL = "auto", "all"
Count = Annotated[
    str | None,
    typer.Option(
        "--n-parts",
        "-k",
        metavar="K",
        help="Number of parts, or auto for the elbow of --curve; with --curve, the largest. [8; 16]",
    ),
]
Sparsity = Annotated[
    float, typer.Option(help="λ of (4.3), 0 to 1, as a share of the λ at which all codes vanish.")
]
OverBoundary = Annotated[
    bool,
    typer.Option("--boundary-parts", help="Divide the boundary, and the region by it (5.2)."),
]
Patches = Annotated[
    str,
    typer.Option(
        metavar="M",
        help="Number of patches of the boundary, a source each, or all: every boundary node is a source.",
    ),
]
Curve = Annotated[
    bool, typer.Option("--curve", help="Print the error against k and the suggested k, and make no parts.")
]
PartsFile = Annotated[
    Path | None,
    typer.Option(
        "--output", "-o", metavar="P.npz", help="Labels, components, sources; of several shapes, a folder."
    ),
]
Page = Annotated[
    Path | None, typer.Option(metavar="P.html", help="Page on which the parts of solids can be turned.")
]
Mesh = Annotated[
    Path | None,
    typer.Option(
        metavar="P.ply",
        help="Surface whose vertices have the property label; of several shapes, a folder.",
    ),
]


@dataclass(frozen=True)
class PartsRequest:
    """What parts were asked for.

    Parameters
    ----------
    n_parts
        Number of parts; None for the elbow of the error curve. Of a curve the largest, None for 16.
    over
        What is divided.
    rho, sparsity
        Screening length, and relative λ.
    n_patches
        Number of patches of the boundary; None for every boundary node.
    boundary
        The boundary model.
    seed
        Of patches and starts.
    """

    n_parts: int | None = PARTS
    over: Literal["region", "boundary"] = "region"
    rho: float = math.inf
    sparsity: float = SPARSITY
    n_patches: int | None = PATCHES
    boundary: Literal["surface", "voxel"] = "voxel"
    seed: int = 0


def parts(
    shapes: Annotated[list[str], typer.Argument(metavar="SHAPE", help="Images, volumes or meshes.")],
    n_parts: Count = None,
    sparsity: Sparsity = SPARSITY,
    boundary_parts: OverBoundary = False,
    rho: Annotated[float, typer.Option(help="Screening length in the unit of the spacing.")] = math.inf,
    patches: Patches = str(PATCHES),
    curve: Curve = False,
    seed: Annotated[int, typer.Option(min=0, help="Seed of patches and starts.")] = 0,
    output: PartsFile = None,
    plot: Plot = None,
    page: Page = None,
    mesh: Mesh = None,
    voxels: Voxels = None,
    spacing: Spacing = None,
    inner_radius: InnerRadius = None,
    grid_spacing: GridSpacing = None,
    boundary: Annotated[
        BoundaryChoice,
        typer.Option(help="Where the sources are: on the surface, or on the voxels outside (paper)."),
    ] = BoundaryChoice.voxel,
    threshold: Threshold = None,
    dark: Dark = None,
    label: Label = None,
    signed_distance: SignedDistance = None,
    components: Components = ComponentsChoice.largest,
    json: Json = False,
) -> None:
    """Divide a shape into parts by sparse coding of the fields of its boundary sources.

    Parts are numbered by size, the largest first; -1 stands for what no part explains. Several shapes are
    divided together, and a label is the same part in all; if one of them fails, nothing is written.

    Sizes and intensities are printed; files are written where they are asked for. The surface of --mesh has
    the part of each vertex as the property label, which trimesh reads into
    metadata["_ply_raw"]["vertex"]["data"].

    The file holds points (n, d), labels (n,), components, basis, sources (m, d), source_labels (m,),
    intensity, rho and spacing, and what `Parts.load` needs to make parts of it again. Of a mesh the
    picture, the page and the PLY file show its own vertices and faces.

    \b
    Examples:
      spem parts hand.png --inner-radius 20 -o hand.npz --plot hand-parts.png
      spem parts horse.obj -k 10 --plot horse.png --page horse.html --mesh horse-parts.ply
      spem parts horse.obj --curve
      spem parts horse.obj -k 10 --json
      spem parts poses/*.obj -k 8 -o parts/ --plot poses.png
    """  # noqa: D301
    over: Literal["region", "boundary"] = "boundary" if boundary_parts else "region"
    count = _count(n_parts, len(shapes), curve=curve)
    _check_numbers(sparsity, rho)
    request = PartsRequest(count, over, rho, sparsity, _patches(patches), boundary.value, seed)
    targets = PartFiles(tuple(shapes), output, plot, page, mesh)
    if curve:
        _check_curve_targets(shapes, targets)
    else:
        targets.check()
    grid = {"voxels": voxels, "spacing": spacing, "inner_radius": inner_radius, "grid_spacing": grid_spacing}
    inside = {"threshold": threshold, "dark": dark, "label": label, "signed_distance": signed_distance}
    found = []
    for path in shapes:
        found.append(read_shape(path, **grid, **inside, components=components))  # type: ignore[arg-type]
        tell_repairs(found[-1])
    if curve:
        _write_curve(found[0], request, plot, json=json)
        return
    targets.check_dimensions(found)
    from spem.cli.division import divide

    divided = divide(found, request)
    targets.write(divided)
    _tell(divided, request, targets, json=json)


def _count(text: str | None, n_shapes: int, *, curve: bool) -> int | None:
    """Return the number of parts, None for the elbow; of a curve the largest, None for the default."""
    if curve and text == AUTO:
        msg = f"-k {AUTO}: --curve suggests a number already; leave one of them out"
        raise ParameterError(msg)
    if n_shapes > 1 and (curve or text == AUTO):
        asked = "--curve" if curve else f"-k {AUTO}"
        msg = f"{asked}: takes one shape, got {n_shapes}; choose the number of parts by one of them"
        raise ParameterError(msg)
    if text == AUTO and not curve:
        return None
    if text is None:
        return None if curve else PARTS
    if not (text.isdecimal() and int(text) > 0):
        other = "" if curve else f", or {AUTO}"
        msg = f"-k {text}: expected a number of parts from 1 on{other}"
        raise ParameterError(msg)
    return int(text)


def _patches(text: str) -> int | None:
    """Return the number of patches, None for every boundary node."""
    if text == ALL:
        return None
    if not (text.isdecimal() and int(text) > 0):
        msg = f"--patches {text}: expected a number of patches from 1 on, or {ALL}"
        raise ParameterError(msg)
    return int(text)


def _check_numbers(sparsity: float, rho: float) -> None:
    """Refuse λ and ρ that cannot be, before anything is read."""
    if not 0 <= sparsity < 1:
        msg = f"--sparsity {sparsity:g}: expected 0 to less than 1, where all codes vanish"
        raise ParameterError(msg)
    if not rho > 0:
        msg = f"--rho {rho:g}: expected a length above zero, or inf"
        raise ParameterError(msg)


def _check_curve_targets(shapes: list[str], targets: PartFiles) -> None:
    """Make sure that a curve is to be written as a picture at most."""
    if targets.output or targets.page or targets.mesh:
        msg = "--curve makes no parts; leave out -o, --page and --mesh, or --curve"
        raise ParameterError(msg)
    if targets.plot is not None:
        spare_sources(check_target(targets.plot, PLOT_SUFFIXES), shapes)


def _write_curve(shape: Shape, request: PartsRequest, plot: Path | None, *, json: bool) -> None:
    """Print the error against the number of parts, and draw it."""
    from spem.cli.division import curve

    errors: ErrorCurve = curve(shape, request)
    if plot is not None:
        from spem.plots.choice import figure_error_curve

        write_figure(plot, figure_error_curve(errors))
    if json:
        summary: dict[str, Any] = {"over": request.over, "rho": request.rho, "sparsity": request.sparsity}
        summary |= {"k": errors.counts, "error": errors.errors, "suggested": errors.suggested, "plot": plot}
        print_json(facts(shape) | summary)
        return
    typer.echo(repr(shape))
    rows = [(str(k), f"{error:.4f}") for k, error in zip(errors.counts, errors.errors, strict=True)]
    print_table(("k", "error"), rows)
    typer.echo(f"suggested: -k {errors.suggested}")
    if plot is not None:
        typer.echo(f"wrote {plot}")


def _tell(divided: list[Parts], request: PartsRequest, targets: PartFiles, *, json: bool) -> None:
    """Tell the parts and where they lie."""
    if json:
        shapes = [_summary(parts) for parts in divided]
        asked = {"boundary": request.boundary, "over": request.over, "rho": request.rho}
        asked |= {"sparsity": request.sparsity, "seed": request.seed}
        files = {name: getattr(targets, name) for name in ("output", "plot", "page", "mesh")}
        print_json((shapes[0] if len(shapes) == 1 else {"shapes": shapes}) | asked | files)
        return
    for parts in divided:
        typer.echo(repr(parts))
    if len(divided) == 1:
        shares = zip(divided[0].sizes, divided[0].intensity, strict=True)
        rows = [(str(j), f"{100 * size:.1f}", f"{100 * codes:.1f}") for j, (size, codes) in enumerate(shares)]
        print_table(("part", "size %", "intensity %"), rows)
    for written in targets.written():
        typer.echo(f"wrote {written}")


def _summary(parts: Parts) -> dict[str, Any]:
    """Return what machines are told of the parts of one shape."""
    summary = {"n_sources": parts.sources.n_sources, "n_parts": parts.n_parts, "sizes": parts.sizes}
    summary |= {"intensity": parts.intensity, "unexplained": parts.unexplained}
    return facts(parts.shape) | summary | {"repairs": parts.shape.report.repairs}
