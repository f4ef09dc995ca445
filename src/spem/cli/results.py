"""What the commands on a shape share after they have read it: where results go, and what is told of them."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from spem.cli.output import PLOT_SUFFIXES, check_target, print_json
from spem.errors import ParameterError, ShapeError

if TYPE_CHECKING:
    from spem.shapes.shape import Shape

NPZ = (".npz",)


def check_targets(source: str, output: Path | None, plot: Path | None) -> None:
    """Make sure that there is something to write, and that it can be written.

    Parameters
    ----------
    source
        The file that the shape is read from.
    output, plot
        Array file and picture, None where not wanted.

    Raises
    ------
    ParameterError
        When there is nothing to write, or a file cannot be written or is the shape itself.
    """
    if output is None and plot is None:
        msg = "nothing to write; give -o FILE.npz, --plot FILE.png or both"
        raise ParameterError(msg)
    for target, suffixes in ((output, NPZ), (plot, PLOT_SUFFIXES)):
        if target is not None:
            spare_sources(check_target(target, suffixes), [source])


def spare_sources(target: Path, sources: Sequence[str]) -> None:
    """Refuse to write over a file that is read.

    Raises
    ------
    ParameterError
        When the target is one of the sources.

    Examples
    --------
    >>> spare_sources(Path(__file__), [__file__])  # doctest: +ELLIPSIS
    Traceback (most recent call last):
        ...
    spem.errors.ParameterError: ...results.py: is a file that is read; write to another one
    """
    if target.exists() and any(Path(source).exists() and target.samefile(source) for source in sources):
        msg = f"{target}: is a file that is read; write to another one"
        raise ParameterError(msg)


def check_drawable(shape: Shape, plot: Path | None) -> None:
    """Refuse to draw what has too many dimensions, before anything is solved.

    Raises
    ------
    ShapeError
        When a picture is wanted of a shape of more than three dimensions.
    """
    if plot is not None:
        from spem.plots.values import require_drawable

        try:
            require_drawable(shape)
        except ShapeError as error:
            msg = f"{shape.name}: has {shape.ndim} dimensions and no picture is made of more than 3; "
            raise ShapeError(msg + "leave out --plot, give -o") from error


def about(shape: Shape, boundary: str) -> dict[str, Any]:
    """Return what arrays of nodes need to be understood without the shape."""
    grid = {"spacing": shape.spacing, "origin": shape.origin, "name": shape.name, "boundary": boundary}
    return grid if shape.affine is None else grid | {"affine": shape.affine}


def facts(shape: Shape) -> dict[str, Any]:
    """Return what every summary says of a shape."""
    return {"name": shape.name, "voxels": shape.n_nodes, "spacing": shape.spacing}


def summarise(
    shape: Shape,
    summary: dict[str, Any],
    output: Path | None,
    plot: Path | None,
    *,
    json: bool,
    lines: Sequence[str] = (),
) -> None:
    """Tell what was computed and where it lies.

    Parameters
    ----------
    shape
        The shape.
    summary
        For machines.
    output, plot
        What was written.
    json
        Whether to print the summary as JSON, in place of lines for people.
    lines
        What people are told beside the shape and the files.
    """
    if json:
        files = {"output": output, "plot": plot, "repairs": shape.report.repairs}
        print_json(facts(shape) | summary | files)
        return
    for line in (repr(shape), *lines):
        typer.echo(line)
    for written in (output, plot):
        if written is not None:
            typer.echo(f"wrote {written}")


def parse_rho(texts: Sequence[str]) -> list[float]:
    """Parse ρ, several of them parted by commas.

    Raises
    ------
    ParameterError
        When something is no number.

    Examples
    --------
    >>> parse_rho(["4,8", "inf"])
    [4.0, 8.0, inf]
    """
    try:
        return [float(part) for text in texts for part in text.split(",")]
    except ValueError as error:
        msg = f"--rho {' '.join(texts)}: expected numbers above zero, or inf, such as 4,8,16"
        raise ParameterError(msg) from error
