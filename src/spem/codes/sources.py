"""Where the shapes of a collection come from: files found, told apart by their bytes, and read."""

from __future__ import annotations

import glob
import hashlib
import os
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np

from spem.codes.codes import file_hash
from spem.codes.settings import Settings
from spem.errors import ParameterError, ReadError, SpemError
from spem.shapes.components import keep_components
from spem.shapes.kinds import MESH_SUFFIXES, SUFFIXES, has_suffix, is_volume
from spem.shapes.read import read
from spem.shapes.shape import Shape

Source: TypeAlias = Path | Shape


def find_files(paths: Iterable[str | Path]) -> list[Path]:
    """List the files that paths stand for: files, folders with all below them, and patterns.

    Parameters
    ----------
    paths
        A file is taken whatever its kind; of a folder the files of a known kind, in order of name,
        without hidden ones; a pattern such as ``shapes/*.obj`` or ``shapes/**/*.obj`` is expanded
        where no file has that very name.

    Returns
    -------
    list of pathlib.Path
        Each file once, in the order of the paths.

    Raises
    ------
    ReadError
        When a path or a pattern leads to nothing.
    ParameterError
        When a path is empty.

    Examples
    --------
    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     for name in ("b.obj", "a.png", "notes.txt"):
    ...         _ = Path(folder, name).write_bytes(b"")
    ...     [path.name for path in find_files([folder])]
    ['a.png', 'b.obj']
    """
    found: dict[Path, None] = {}
    for given in paths:
        path = Path(given)
        if not str(given):
            msg = "a path is empty; give a file, a folder or a pattern, '.' for the working directory"
            raise ParameterError(msg)
        if path.is_dir():
            inside = _walk(path)
            if not inside:
                msg = f"{path}: no shape in this folder; expected files of kind {', '.join(SUFFIXES)}"
                raise ReadError(msg)
            found |= dict.fromkeys(inside)
        elif path.exists() or not glob.has_magic(str(given)):
            found[path] = None
        else:
            hits = sorted(Path(hit) for hit in glob.glob(str(given), recursive=True))  # noqa: PTH207
            files = [hit for hit in hits if hit.is_file()]
            if not files:
                why = (
                    "only folders fit this pattern; give one"
                    if hits
                    else "no file fits this pattern; give a folder"
                )
                msg = f"{given}: {why}, or a pattern of files such as 'shapes/**/*.obj'"
                raise ReadError(msg)
            found |= dict.fromkeys(files)
    return list(found)


def count_hidden(paths: Iterable[str | Path]) -> int:
    """Return how many files of a known kind `find_files` leaves out of folders because they are hidden.

    Examples
    --------
    >>> count_hidden(["no-such-folder"])
    0
    """
    folders = [Path(path) for path in paths if str(path) and Path(path).is_dir()]
    return sum(_hidden(path, folder) for folder in folders for path in _shapes_below(folder))


def as_source(source: Any) -> Source:
    """Return a path or a shape.

    Raises
    ------
    ParameterError
        When it is neither.

    Examples
    --------
    >>> as_source("hand.png").suffix
    '.png'
    """
    if isinstance(source, Shape):
        return source
    if not isinstance(source, (str, os.PathLike)):
        msg = f"expected files or shapes, got {type(source).__name__}; read it first: spem.read(...)"
        raise ParameterError(msg)
    return Path(source)


def source_path(source: Source) -> str:
    """Return the path as it was given, or the name of a shape."""
    return source.name if isinstance(source, Shape) else str(source)


def source_hash(source: Source) -> str:
    """Return the SHA-256, in hex, of a file's bytes or of what makes up a shape.

    Raises
    ------
    ReadError
        When the file cannot be read.

    Examples
    --------
    >>> square, other = (Shape.from_mask(np.ones((2, 2)), name=name) for name in "ab")
    >>> source_hash(square) == source_hash(other)
    True
    """
    if isinstance(source, Path):
        return file_hash(source)
    digest = hashlib.sha256(f"{source.mask.shape} {source.spacing}".encode())
    for array in (source.mask, source.cuts.voxel, source.cuts.direction, source.cuts.fraction):
        digest.update(np.ascontiguousarray(array).tobytes())
    if source.surface is not None:
        digest.update(np.ascontiguousarray(source.surface.vertices).tobytes())
        digest.update(np.ascontiguousarray(source.surface.faces).tobytes())
    return digest.hexdigest()


def source_name(source: Source) -> str:
    """Return the name for people: a file's without its ending, a shape's own.

    Examples
    --------
    >>> source_name(Path("scans/tooth.nii.gz"))
    'tooth'
    """
    if isinstance(source, Shape):
        return source.name
    name = source.name[:-3] if source.name.lower().endswith(".gz") else source.name
    return Path(name).stem


def read_shapes(source: Source, settings: Settings) -> Iterator[tuple[str, Shape | SpemError]]:
    """Read the shapes of a source, as the settings say: one for each label of a label volume.

    Parameters
    ----------
    source
        A file or a shape.
    settings
        Number of voxels, threshold, polarity, labels and components.

    Yields
    ------
    suffix
        What tells the shape from others of the source, ``"-3"`` for label 3; else empty.
    shape
        The shape, or the error where a label gave none.

    Raises
    ------
    SpemError
        When the file as a whole cannot be read.

    Examples
    --------
    >>> [(_, shape)] = read_shapes(Shape.from_mask(np.ones((5, 5))), Settings(voxels=None))
    >>> shape.n_nodes
    25
    """
    name = source_name(source)
    several = settings.threshold is None and settings.per_label is not False
    if isinstance(source, Path) and several and is_volume(source):
        from spem.shapes.volumes import read_labels

        for found in read_labels(source, per_label=settings.per_label, name=name):
            yield found.name.removeprefix(name), _resampled(found, settings)
        return
    if isinstance(source, Shape):
        yield "", read(source, voxels=settings.voxels, components=settings.components)
        return
    grey = not has_suffix(source, MESH_SUFFIXES)
    yield (
        "",
        read(
            source,
            voxels=settings.voxels,
            threshold=settings.threshold if grey else None,
            dark=settings.dark if grey and not is_volume(source) else None,
            components=settings.components,
            name=name,
        ),
    )


def _resampled(shape: Shape, settings: Settings) -> Shape | SpemError:
    """Bring the shape of a label to its voxels; an error is a value, so that other labels go on."""
    try:
        return read(keep_components(shape, settings.components), voxels=settings.voxels)
    except SpemError as error:
        return error


def _walk(folder: Path) -> list[Path]:
    """List the files of a known kind below a folder, without hidden ones; links that lead nowhere too."""
    return sorted(path for path in _shapes_below(folder) if not _hidden(path, folder))


def _shapes_below(folder: Path) -> Iterator[Path]:
    """Yield the files of a known kind below a folder."""
    return (path for path in folder.rglob("*") if has_suffix(path, SUFFIXES) and not path.is_dir())


def _hidden(path: Path, folder: Path) -> bool:
    """Tell whether a file, or a folder on the way to it, is hidden."""
    return any(part.startswith(".") for part in path.relative_to(folder).parts)
