"""Options that several commands share, and the shape they ask for."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from spem.cli.output import complain
from spem.errors import ParameterError, SpemError

if TYPE_CHECKING:
    from spem.fields.solvers.engine import Backend
    from spem.shapes.shape import Shape

# Patches of the boundary, where none are asked for.
PATCHES = 200


class BoundaryChoice(StrEnum):
    """Where v = 1 holds."""

    surface = "surface"
    voxel = "voxel"


class SchemeChoice(StrEnum):
    """How ρ is spread over its range."""

    linear = "linear"
    squared = "squared"
    log = "log"


class ComponentsChoice(StrEnum):
    """Which connected components of a shape are kept."""

    largest = "largest"
    all = "all"


class SideChoice(StrEnum):
    """The sign that a signed distance has inside."""

    negative = "negative"
    positive = "positive"


ShapeFile = Annotated[str, typer.Argument(metavar="SHAPE", help="Image, volume or mesh.")]
Voxels = Annotated[
    int | None,
    typer.Option(
        min=1, help="Number of voxels inside. [meshes: 15000; images and volumes keep their own grid]"
    ),
]
Spacing = Annotated[
    float | None,
    typer.Option(help="Resample to this distance between voxel centres, in the unit of the file."),
]
GridSpacing = Annotated[
    str | None,
    typer.Option(
        metavar="H[,H...]",
        help="Spacing that the grid of an image or volume has, one or one an axis. [the file's, or 1]",
    ),
]
InnerRadius = Annotated[
    float | None, typer.Option(help="Distance from the deepest voxel to the boundary, in voxels.")
]
Threshold = Annotated[
    float | None, typer.Option(help="Grey level of the surface, of images and grey volumes.")
]
Dark = Annotated[
    bool | None,
    typer.Option("--dark/--light", help="Whether the shape is darker than the ground. [by the border]"),
]
Label = Annotated[int | None, typer.Option(help="The label to take from a label volume.")]
SignedDistance = Annotated[
    SideChoice | None,
    typer.Option(help="The volume holds signed distances to the surface, of this sign inside."),
]
Components = Annotated[ComponentsChoice, typer.Option(help="Keep the largest component or all.")]
Boundary = Annotated[
    BoundaryChoice,
    typer.Option(help="Where v = 1: on the surface, or on the voxels outside (paper)."),
]
Device = Annotated[
    str,
    typer.Option(
        metavar="DEVICE", help="Where sweeps over ρ run: cpu, cuda or cuda:NUMBER; spem devices lists them."
    ),
]
Json = Annotated[bool, typer.Option("--json", help="Print JSON for machines.")]
Plot = Annotated[Path | None, typer.Option(metavar="FILE", help="Write a picture too (.png, .pdf or .svg).")]
Jobs = Annotated[
    int | None,
    typer.Option("--jobs", "-j", min=1, help="Number of processes. [by the number of shapes and of cores]"),
]


def find_device(text: str) -> Backend | None:
    """Return the device that was asked for, None for the processor; it is tried before anything is read.

    Parameters
    ----------
    text
        ``"cpu"``, ``"cuda"`` or ``"cuda:NUMBER"``.

    Raises
    ------
    ParameterError
        For other words, and where there is no such device.
    MissingExtraError
        When CuPy is not installed, or does not fit the driver.

    Examples
    --------
    >>> find_device("cpu")
    """
    if text == "cpu":
        return None
    from spem.fields.solvers.cuda.device import Cuda, parse_device

    device = parse_device(text)
    if isinstance(device, Cuda):
        try:
            device.runtime()
        except SpemError as error:
            msg = f"--device {text}: {error}"
            raise type(error)(msg) from error
    return device


def tell_idle_device(text: str, features: str) -> None:
    """Say so when a device was asked for, and codes have no features that are made on one.

    Parameters
    ----------
    text
        As for `find_device`.
    features
        Kinds of features, joined by +.
    """
    from spem.codes.batches import ON_DEVICE

    if text != "cpu" and ON_DEVICE not in features.split("+"):
        complain(f"--device {text}: not used by features {features}; --features {ON_DEVICE} is made there")


def read_shape(
    path: str,
    *,
    voxels: int | None = None,
    spacing: float | None = None,
    inner_radius: float | None = None,
    threshold: float | None = None,
    dark: bool | None = None,
    label: int | None = None,
    signed_distance: SideChoice | None = None,
    components: ComponentsChoice = ComponentsChoice.largest,
    grid_spacing: str | None = None,
) -> Shape:
    """Read a shape as the options say.

    Raises
    ------
    SpemError
        When there is no shape in the file, or options do not go with it.
    """
    from spem.shapes.read import read

    return read(
        path,
        voxels=voxels,
        spacing=spacing,
        inner_radius=inner_radius,
        threshold=threshold,
        dark=dark,
        label=label,
        signed_distance=None if signed_distance is None else signed_distance.value,
        components=components.value,
        grid_spacing=None if grid_spacing is None else _steps(grid_spacing),
    )


def _steps(text: str) -> float | tuple[float, ...]:
    """Parse a spacing: one number, or one an axis."""
    try:
        steps = tuple(float(part) for part in text.split(","))
    except ValueError as error:
        msg = f"--grid-spacing {text}: expected one positive number, or one an axis such as 2,1,0.5"
        raise ParameterError(msg) from error
    return steps if len(steps) > 1 else steps[0]


def tell_repairs(shape: Shape) -> None:
    """Tell on stderr what was changed when a shape was read."""
    source = shape.report.source or shape.name
    for phrase in shape.report.method.split("; "):
        if "labels together" in phrase:
            complain(f"{source}: {phrase}; --label takes one of them")
    for repair in shape.report.repairs:
        # a grid is changed only when that is asked for
        asked = "note: " if repair.startswith("resampled from") else ""
        complain(f"{source}: {asked}{repair}")
