"""What commands write: lines, JSON, files all of a piece."""

from __future__ import annotations

import json
import math
import os
from collections.abc import Sequence
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from spem.errors import ParameterError
from spem.files import write_whole

if TYPE_CHECKING:
    from matplotlib.figure import Figure

PLOT_SUFFIXES = (".png", ".pdf", ".svg")


def complain(message: str) -> None:
    """Write one line on stderr, under the name of the program."""
    typer.echo(f"spem: {message}", err=True)


def counted(number: int, noun: str) -> str:
    """Return a number with its noun, plural with s but for one.

    Examples
    --------
    >>> counted(1, "shape"), counted(2, "shape")
    ('1 shape', '2 shapes')
    """
    return f"{number} {noun}" if number == 1 else f"{number} {noun}s"


def check_target(path: Path, suffixes: tuple[str, ...] = ()) -> Path:
    """Make sure, before anything is computed, that a file can be written; its folder is made.

    Parameters
    ----------
    path
        The file.
    suffixes
        Endings it may have; any when empty.

    Raises
    ------
    ParameterError
        When it cannot be written, or has another ending.

    Examples
    --------
    >>> check_target(Path("field.bmp"), PLOT_SUFFIXES)
    Traceback (most recent call last):
        ...
    spem.errors.ParameterError: field.bmp: expected a file that ends in .png, .pdf, .svg
    """
    if suffixes and path.suffix.lower() not in suffixes:
        msg = f"{path}: expected a file that ends in {', '.join(suffixes)}"
        raise ParameterError(msg)
    if path.is_dir():
        msg = f"{path}: is a folder; give the name of a file to write"
        raise ParameterError(msg)
    check_folder(path.parent)
    return path


def check_folder(folder: Path) -> Path:
    """Make a folder, and make sure that files can be written to it.

    Raises
    ------
    ParameterError
        When it cannot be made or written to.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        msg = f"{folder}: the folder cannot be made ({error.strerror}); write to another one"
        raise ParameterError(msg) from error
    if not os.access(folder, os.W_OK | os.X_OK):
        msg = f"{folder}: no permission to write to this folder; write to another one"
        raise ParameterError(msg)
    return folder


def write_bytes(path: Path, content: bytes) -> None:
    """Write a file in one step: all of it or, on any failure, nothing.

    Raises
    ------
    ParameterError
        When it cannot be written.
    """
    write_whole(path, lambda file: file.write(content))


def write_npz(path: Path, **arrays: Any) -> None:
    """Write arrays to an npz file, in one step."""
    import numpy as np

    content = BytesIO()
    np.savez(content, **arrays)
    write_bytes(path, content.getvalue())


def write_figure(path: Path, figure: Figure) -> None:
    """Write a figure in the format that the file's ending names."""
    content = BytesIO()
    figure.savefig(content, format=path.suffix.lower().lstrip("."), dpi=150)
    write_bytes(path, content.getvalue())


def print_json(values: Any) -> None:
    """Write values to stdout as JSON."""
    typer.echo(to_json(values))


def to_json(values: Any) -> str:
    """Return values as JSON; infinite numbers as "inf", which JSON has no number for.

    Examples
    --------
    >>> to_json({"rho": [1.0, math.inf]}).replace(" ", "").replace(chr(10), "")
    '{"rho":[1.0,"inf"]}'
    """
    return json.dumps(_plain(values), indent=2, ensure_ascii=False, allow_nan=False)


def _plain(values: Any) -> Any:
    """Replace arrays, paths and numbers that are not finite by what JSON has."""
    if hasattr(values, "tolist"):
        values = values.tolist()
    if isinstance(values, dict):
        return {str(key): _plain(value) for key, value in values.items()}
    if isinstance(values, (list, tuple)):
        return [_plain(value) for value in values]
    if isinstance(values, float) and not math.isfinite(values):
        return str(values)
    return str(values) if isinstance(values, Path) else values


def print_table(header: tuple[str, ...], rows: Sequence[tuple[str, ...]], left: tuple[int, ...] = ()) -> None:
    """Write aligned columns to stdout: numbers to the right, the columns of `left` to the left."""
    # a name may hold line ends, or what a terminal obeys
    lines = [tuple(cell if cell.isprintable() else _escaped(cell) for cell in row) for row in (header, *rows)]
    widths = [max(map(len, column)) for column in zip(*lines, strict=True)]
    for row in lines:
        cells = (
            cell.ljust(width) if j in left else cell.rjust(width)
            for j, (cell, width) in enumerate(zip(row, widths, strict=True))
        )
        typer.echo("  ".join(cells).rstrip())


def _escaped(text: str) -> str:
    """Return text with what cannot be printed as escapes."""
    return "".join(c if c.isprintable() else c.encode("unicode_escape").decode() for c in text)
