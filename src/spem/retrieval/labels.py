"""Labels of a collection: read from a table or a Princeton classification, and matched to its files."""

from __future__ import annotations

import csv
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path, PurePath
from typing import TypeAlias

from spem.errors import LabelError, ReadError

# A message names this many of the names it is about.
NAMED = 3
# The end of a path: folders, file name, and whether that is the whole path; None for a name without ending.
_End: TypeAlias = tuple[tuple[str, ...], str, bool | None]


def read_labels(path: str | Path) -> dict[str, str]:
    r"""Read the labels of a collection.

    Two forms are read. A table of comma-separated values with columns ``file`` and ``label``, in
    any order and among any others, or two columns in that order without a header. A Princeton
    Shape Benchmark classification (``.cla``), whose identifiers become the files and whose classes
    become the labels, as "parent/class" where classes of several parents have one name.

    Parameters
    ----------
    path
        The file.

    Returns
    -------
    dict
        File, as it is written, → label.

    Raises
    ------
    ReadError
        If the file is missing or is not text.
    LabelError
        If a line is malformed, a file has two labels, or there is no label at all.

    Examples
    --------
    >>> from tempfile import TemporaryDirectory
    >>> with TemporaryDirectory() as folder:
    ...     table = Path(folder) / "labels.csv"
    ...     _ = table.write_text("file,label\ntom.png,cat\nrex.png,dog\n")
    ...     read_labels(table)
    {'tom.png': 'cat', 'rex.png': 'dog'}
    """
    source = Path(path)
    try:
        text = source.read_text(encoding="utf-8-sig")
    except (OSError, UnicodeDecodeError) as error:
        reason = "the labels file is not UTF-8 text"
        if isinstance(error, FileNotFoundError):
            reason = "no such file; expected labels"
        elif isinstance(error, OSError):
            reason = f"the labels file cannot be read: {error.strerror}"
        msg = f"{source}: {reason}"
        raise ReadError(msg) from error
    lines = text.splitlines()
    pairs = _classification(source, lines) if _is_classification(source, lines) else _table(source, lines)
    labels: dict[str, str] = {}
    for number, file, label in pairs:
        if labels.setdefault(file, label) != label:
            msg = f"{source}, line {number}: {file} is labelled {label!r} here and {labels[file]!r} before"
            raise LabelError(msg)
    if not labels:
        msg = f"{source}: no label found; expected lines 'file,label' or a .cla classification"
        raise LabelError(msg)
    return labels


def match_labels(names: Sequence[str | Path], labels: Mapping[str, str]) -> list[str]:
    """Return the label of every shape.

    A shape has the label of the file that shares the longest end of its path, file name and as many
    folders as there are, with or without the ending of the name. Else it is looked up by the number its
    name ends in where the labels are for bare numbers (``T12.obj`` is ``12``).

    Parameters
    ----------
    names
        ``(n,)`` paths, file names or names of the shapes.
    labels
        File → label, as `read_labels` gives them.

    Returns
    -------
    list of str
        ``(n,)`` labels.

    Raises
    ------
    LabelError
        If a shape has no label, or more than one could be meant.

    Examples
    --------
    >>> match_labels(["animals/tom.png", "T12.obj"], {"tom": "cat", "12": "dog"})
    ['cat', 'dog']
    >>> match_labels(["pets/a/1.png", "pets/b/1.png"], {"a/1.png": "cat", "b/1.png": "dog"})
    ['cat', 'dog']
    """
    keys = _resolve(names, labels)
    missing = [str(name) for name, key in zip(names, keys, strict=True) if key is None]
    if missing:
        msg = (
            f"{len(missing)} of {len(names)} shapes have no label: {_some(missing)}; "
            "add lines 'file,label' (shapes of a label volume are named as in 'teeth-3,molar'), "
            "or leave them out with ignore_unlabelled (--ignore-unlabelled)"
        )
        raise LabelError(msg)
    return [labels[key] for key in keys if key is not None]


def find_labels(names: Sequence[str | Path], labels: Mapping[str, str]) -> list[str]:
    """Return the label of every shape, as `match_labels` finds them, and nothing where there is none.

    Parameters
    ----------
    names
        ``(n,)`` paths, file names or names of the shapes.
    labels
        File → label, as `read_labels` gives them.

    Raises
    ------
    LabelError
        If more than one label could be meant.

    Examples
    --------
    >>> find_labels(["rex.png", "tom.png"], {"tom": "cat"})
    ['', 'cat']
    """
    return ["" if key is None else labels[key] for key in _resolve(names, labels)]


def labelled(names: Sequence[str | Path], labels: Mapping[str, str]) -> list[int]:
    """Return the places, among the shapes, of those that have a label.

    Parameters
    ----------
    names
        ``(n,)`` paths, file names or names of the shapes.
    labels
        File → label, as `read_labels` gives them.

    Raises
    ------
    LabelError
        If none has, or more than one label could be meant.

    Examples
    --------
    >>> labelled(["rex.png", "tom.png"], {"tom": "cat"})
    [1]
    """
    places = [i for i, key in enumerate(_resolve(names, labels)) if key is not None]
    if not places:
        msg = f"none of the {len(names)} shapes has a label: {_some([str(name) for name in names])}"
        raise LabelError(msg)
    return places


def unused_labels(names: Sequence[str | Path], labels: Mapping[str, str]) -> list[str]:
    """Return the labelled files that are none of the shapes, in the order of the labels.

    Parameters
    ----------
    names
        ``(n,)`` paths, file names or names of the shapes.
    labels
        File → label, as `read_labels` gives them.

    Examples
    --------
    >>> unused_labels(["tom.png"], {"tom.png": "cat", "rex.png": "dog"})
    ['rex.png']
    """
    used = set(_resolve(names, labels))
    return [key for key in labels if key not in used]


def _resolve(names: Sequence[str | Path], labels: Mapping[str, str]) -> list[str | None]:
    """Find the key of every name among the labels, or None."""
    by_end = _ends(labels)
    by_number = {int(key): key for key in labels if key.isascii() and key.isdigit()}
    clashes: dict[int, str] = {}
    keys: list[str | None] = []
    for name in names:
        path = PurePath(name)
        key = str(name) if str(name) in labels else _by_end(path, by_end)
        digits = _number(path.stem)
        if key is None and digits in by_number:
            stem = path.stem.rstrip("0123456789")
            if clashes.setdefault(digits, stem) != stem:
                twins = f"{clashes[digits]}{digits} and {path.stem}"
                msg = f"label {by_number[digits]} fits both {twins}; give the labels of file names"
                raise LabelError(msg)
            key = by_number[digits]
        if key == "":
            msg = f"{name}: several labels fit this name; give the labels of full file names"
            raise LabelError(msg)
        keys.append(key)
    return keys


def _by_end(path: PurePath, by_end: Mapping[_End, str]) -> str | None:
    """Find the key that shares the longest end of a path; empty if several do, None if none does."""
    for start in range(len(path.parts)):
        folder = path.parts[start:-1]
        ends = ((folder, path.name, True), (folder, path.name, False), (folder, path.stem, None))
        found = next((by_end[end] for end in ends if end in by_end), None)
        if found is not None:
            return found
    return None


def _ends(labels: Mapping[str, str]) -> dict[_End, str]:
    """Map the ends of keys to keys; to the empty string where keys of different labels share one."""
    ends: dict[_End, str] = {}
    for key in labels:
        path = PurePath(key)
        for start in range(len(path.parts)):
            folder = path.parts[start:-1]
            for end in ((folder, path.name, start == 0), (folder, path.stem, None)):
                known = ends.setdefault(end, key)
                if known and labels[known] != labels[key]:
                    ends[end] = ""
    return ends


def _number(stem: str) -> int:
    """Return the number that a name ends in, or -1."""
    digits = stem[len(stem.rstrip("0123456789")) :]
    return int(digits) if digits else -1


def _table(source: Path, lines: list[str]) -> list[tuple[int, str, str]]:
    """Parse comma-separated lines into (line number, file, label)."""
    file_column, label_column, width = 0, 1, 2
    pairs: list[tuple[int, str, str]] = []
    first = True
    for number, cells in _rows(source, lines):
        header, where = [cell.lower() for cell in cells], f"{source}, line {number}"
        got = repr(lines[number - 1])
        if first and {"file", "label"} & set(header):
            if not {"file", "label"} <= set(header):
                msg = f"{where}: expected columns 'file' and 'label', got {got}"
                raise LabelError(msg)
            file_column, label_column, width = header.index("file"), header.index("label"), len(header)
        elif len(cells) != width or not cells[file_column] or not cells[label_column]:
            msg = f"{where}: expected 'file,label', got {got}"
            raise LabelError(msg)
        else:
            pairs.append((number, cells[file_column], cells[label_column]))
        first = False
    return pairs


def _rows(source: Path, lines: list[str]) -> Iterator[tuple[int, list[str]]]:
    """Yield the line number and the cells of the rows that are not blank."""
    rows = csv.reader(lines)
    try:
        for row in rows:
            cells = [cell.strip() for cell in row]
            if any(cells):
                yield rows.line_num, cells
    except csv.Error as error:
        where = f"{source}, line {rows.line_num}"
        msg = f"{where}: not a table of 'file,label' ({error}); look for a quote that is not closed"
        raise LabelError(msg) from error


def _is_classification(source: Path, lines: list[str]) -> bool:
    """Tell a Princeton classification by its ending or its first line."""
    return source.suffix.lower() == ".cla" or (bool(lines) and lines[0].split()[:1] == ["PSB"])


def _classification(source: Path, lines: list[str]) -> list[tuple[int, str, str]]:
    """Parse a Princeton classification into (line number, identifier, class)."""
    content = [(number, line.split()) for number, line in enumerate(lines, 1) if line.strip()]
    if len(content) < 2 or content[0][1][0] != "PSB" or not _counts(content[1][1], 2):
        msg = f"{source}, line 1: expected 'PSB 1' and then the numbers of classes and models"
        raise LabelError(msg)
    n_classes, n_models = map(int, content[1][1])
    models: list[tuple[int, str, str, str]] = []
    found, label, parent, left = 0, "", "", 0
    for number, words in content[2:]:
        if left:
            if len(words) != 1:
                wanted = f"one of {left} more models of {label}"
                msg = f"{source}, line {number}: expected {wanted}, got {' '.join(words)!r}"
                raise LabelError(msg)
            models.append((number, words[0], parent, label))
            left -= 1
        elif len(words) == 3 and _counts(words[2:], 1):
            label, parent, left = words[0], words[1], int(words[2])
            found += 1
        else:
            msg = f"{source}, line {number}: expected 'class parent number', got {' '.join(words)!r}"
            raise LabelError(msg)
    if left or len(models) != n_models or found != n_classes:
        msg = (
            f"{source}: {found} classes and {len(models)} models found, "
            f"{n_classes} and {n_models} announced on line {content[1][0]}; the file is cut short or edited"
        )
        raise LabelError(msg)
    return _qualified(models)


def _qualified(models: list[tuple[int, str, str, str]]) -> list[tuple[int, str, str]]:
    """Put the parent before the names of classes that classes of several parents have."""
    parents: dict[str, set[str]] = {}
    for _, _, parent, label in models:
        parents.setdefault(label, set()).add(parent)
    return [
        (number, model, f"{parent}/{label}" if len(parents[label]) > 1 and parent != "0" else label)
        for number, model, parent, label in models
    ]


def _counts(words: list[str], number: int) -> bool:
    """Tell whether there are so many words, all of them counts."""
    return len(words) == number and all(word.isdecimal() for word in words)


def _some(names: list[str]) -> str:
    """Name the first few."""
    return ", ".join(names[:NAMED]) + (", ..." if len(names) > NAMED else "")
