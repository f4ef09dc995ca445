"""Labels and metadata of rows."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

from spem.errors import LabelError, ParameterError
from spem.index.row import Row
from spem.retrieval.labels import labelled, match_labels, unused_labels


def annotated(row: Row, label: str | None, metadata: Mapping[Any, Any]) -> Row:
    """Return a row with another label and further metadata; a value None takes a key away.

    Raises
    ------
    ParameterError
        When a key is empty, or a value no text.
    """
    for key, value in metadata.items():
        if not isinstance(key, str) or not key or not isinstance(value, (str, type(None))):
            msg = f"metadata {key!r}={value!r}: expected a name and text; write numbers as text"
            raise ParameterError(msg)
    merged = {**row.metadata, **metadata}
    kept = {key: value for key, value in merged.items() if value is not None}
    return replace(row, label=row.label if label is None else label, metadata=kept)


def labels_of(rows: Sequence[Row], table: Mapping[str, str]) -> tuple[dict[str, str], list[str]]:
    """Look rows up in a table of labels.

    A row is looked up by its path, by its name where its file holds several shapes, and where nothing is
    found by the paths of copies.

    Parameters
    ----------
    rows
        The rows.
    table
        File → label, as `spem.read_labels` gives them.

    Returns
    -------
    labels
        Id → label, of the rows that have one.
    unused
        Entries of the table that are of no row.

    Raises
    ------
    LabelError
        When an entry could be of several labels, or none is of any row.
    """
    several = _holding_several(rows)
    keys = {row.id: _keys(row, several) for row in rows}
    pairs = [(row_id, key) for row_id, known in keys.items() for key in known]
    names = [key for _, key in pairs]
    places = labelled(names, table) if names else []
    if not places:
        msg = "the index has no shape to label; add some first"
        raise LabelError(msg)
    found = match_labels([names[i] for i in places], table)
    labels: dict[str, str] = {}
    for where, label in zip(places, found, strict=True):
        labels.setdefault(pairs[where][0], label)
    return labels, unused_labels(names, table)


def _holding_several(rows: Sequence[Row]) -> set[str]:
    """Return the contents that hold several shapes."""
    counts: dict[str, int] = {}
    for row in rows:
        counts[row.hash] = counts.get(row.hash, 0) + 1
    return {content for content, count in counts.items() if count > 1}


def _keys(row: Row, several: set[str]) -> list[str]:
    """Return what a row is looked up by."""
    return [row.name] if row.hash in several else [row.path, *row.copies]
