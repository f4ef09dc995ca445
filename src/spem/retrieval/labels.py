"""Labels of a collection: read from a table or a Princeton classification, and matched to its files."""

from __future__ import annotations

import csv
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path, PurePath

from spem.errors import LabelError, ReadError

# A message names this many of the names it is about.
NAMED = 3


def read_labels(path: str | Path) -> dict[str, str]:
    r"""Read the labels of a collection.

    Two forms are read. A table of comma-separated values with columns ``file`` and ``label``, in
    any order and among any others, or two columns in that order without a header. A Princeton
    Shape Benchmark classification (``.cla``), whose identifiers become the files.

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
        reason = (
            "is not UTF-8 text"
            if isinstance(error, UnicodeDecodeError)
            else f"cannot be read: {error.strerror}"
        )
        msg = f"{source}: the labels file {reason}"
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

    A shape is looked up as it is named, then by file name, then by file name without ending, then
    by the number its name ends in where the labels are for bare numbers (``T12.obj`` is ``12``).

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
    """
    keys = _resolve(names, labels)
    missing = [str(name) for name, key in zip(names, keys, strict=True) if key is None]
    if missing:
        msg = (
            f"{len(missing)} of {len(names)} shapes have no label: {_some(missing)}; "
            "add lines 'file,label' for them or leave them out"
        )
        raise LabelError(msg)
    return [labels[key] for key in keys if key is not None]


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
    by_name = _unambiguous(labels, ((PurePath(key).name, key) for key in labels))
    by_stem = _unambiguous(labels, ((PurePath(key).stem, key) for key in labels))
    by_number = {int(key): key for key in labels if key.isascii() and key.isdigit()}
    clashes: dict[int, str] = {}
    keys: list[str | None] = []
    for name in names:
        path = PurePath(name)
        key = next((k for k in (str(name), path.name) if k in labels), None)
        key = key or by_name.get(path.name) or by_stem.get(path.stem)
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


def _unambiguous(labels: Mapping[str, str], pairs: Iterable[tuple[str, str]]) -> dict[str, str]:
    """Map short names to keys; to the empty string where keys of different labels share one."""
    short: dict[str, str] = {}
    for name, key in pairs:
        known = short.setdefault(name, key)
        if known and labels[known] != labels[key]:
            short[name] = ""
    return short


def _number(stem: str) -> int:
    """Return the number that a name ends in, or -1."""
    digits = stem[len(stem.rstrip("0123456789")) :]
    return int(digits) if digits else -1


def _table(source: Path, lines: list[str]) -> list[tuple[int, str, str]]:
    """Parse comma-separated lines into (line number, file, label)."""
    rows = csv.reader(lines)
    file_column, label_column, width = 0, 1, 2
    pairs: list[tuple[int, str, str]] = []
    first = True
    for row in rows:
        cells = [cell.strip() for cell in row]
        if not any(cells):
            continue
        header, where = [cell.lower() for cell in cells], f"{source}, line {rows.line_num}"
        got = repr(lines[rows.line_num - 1])
        if first and {"file", "label"} & set(header):
            if not {"file", "label"} <= set(header):
                msg = f"{where}: expected columns 'file' and 'label', got {got}"
                raise LabelError(msg)
            file_column, label_column, width = header.index("file"), header.index("label"), len(header)
        elif len(cells) != width or not cells[file_column] or not cells[label_column]:
            msg = f"{where}: expected 'file,label', got {got}"
            raise LabelError(msg)
        else:
            pairs.append((rows.line_num, cells[file_column], cells[label_column]))
        first = False
    return pairs


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
    pairs: list[tuple[int, str, str]] = []
    names: Counter[str] = Counter()
    label, left = "", 0
    for number, words in content[2:]:
        if left:
            if len(words) != 1:
                wanted = f"one of {left} more models of {label}"
                msg = f"{source}, line {number}: expected {wanted}, got {' '.join(words)!r}"
                raise LabelError(msg)
            pairs.append((number, words[0], label))
            left -= 1
        elif len(words) == 3 and _counts(words[2:], 1):
            label, left = words[0], int(words[2])
            names[label] += 1
        else:
            msg = f"{source}, line {number}: expected 'class parent number', got {' '.join(words)!r}"
            raise LabelError(msg)
    if left or len(pairs) != n_models or names.total() != n_classes:
        msg = (
            f"{source}: {names.total()} classes and {len(pairs)} models found, "
            f"{n_classes} and {n_models} announced on line {content[1][0]}; the file is cut short or edited"
        )
        raise LabelError(msg)
    return pairs


def _counts(words: list[str], number: int) -> bool:
    """Tell whether there are so many words, all of them counts."""
    return len(words) == number and all(word.isdecimal() for word in words)


def _some(names: list[str]) -> str:
    """Name the first few."""
    return ", ".join(names[:NAMED]) + (", ..." if len(names) > NAMED else "")
