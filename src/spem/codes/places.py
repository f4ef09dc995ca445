"""Paths in codes files: relative ones start from the folder of the codes, whatever the working directory."""

from __future__ import annotations

import os
from pathlib import Path

from spem.shapes.kinds import SUFFIXES, has_suffix

# A relative path of a file begins so in codes files; anything else is absolute, or the name of a shape.
_HERE = "./"


def stored_path(path: str, folder: Path) -> str:
    """Return the path of a source as codes files have it.

    Parameters
    ----------
    path
        Path from the working directory, absolute path, or name of a shape that was no file.
    folder
        Where the codes file lies.

    Returns
    -------
    str
        Relative paths start from `folder`, so that codes and shapes may be moved together; others
        are as they were.

    Examples
    --------
    >>> stored_path("shapes/hand.png", Path("shapes")), stored_path("disk", Path("shapes"))
    ('./hand.png', 'disk')
    """
    if Path(path).is_absolute() or not (has_suffix(Path(path), SUFFIXES) or Path(path).exists()):
        return path
    try:
        return _HERE + Path(os.path.relpath(path, folder)).as_posix()
    except ValueError:
        # On Windows there is no way from one drive to another.
        return str(Path(path).absolute())


def found_path(stored: str, folder: Path) -> str:
    """Return the path of a source from the working directory, of what `stored_path` gave.

    Parameters
    ----------
    stored
        Path as the codes file has it.
    folder
        Where the codes file lies.

    Returns
    -------
    str
        Relative where the file lies below the working directory, else absolute.

    Examples
    --------
    >>> found_path("./hand.png", Path("shapes")) == str(Path("shapes", "hand.png"))
    True
    """
    if not stored.startswith(_HERE):
        return stored
    place = Path(os.path.normpath(folder.absolute() / stored))
    return str(place.relative_to(Path.cwd())) if place.is_relative_to(Path.cwd()) else str(place)
