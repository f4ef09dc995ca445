"""Labels and metadata of rows that are added."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Self

from spem.codes.sources import Source, source_path
from spem.errors import require_kind
from spem.index.changes import place
from spem.index.row import Row
from spem.retrieval.labels import find_labels


@dataclass(frozen=True)
class Labelling:
    """What rows are given beside what their files say.

    Parameters
    ----------
    by_path
        Place of a file → label.
    labels
        File or name → label, as `spem.retrieval.labels.read_labels` gives them: for shapes of label volumes,
        which go by name.
    metadata
        Keys and values for every row.
    """

    by_path: Mapping[Path, str] = field(default_factory=dict)
    labels: Mapping[str, str] = field(default_factory=dict)
    metadata: Mapping[str, str] = field(default_factory=dict)

    @classmethod
    def of(cls, sources: Sequence[Source], labels: Mapping[str, str], metadata: Mapping[str, str]) -> Self:
        """Look up the labels of all sources at once.

        Raises
        ------
        LabelError
            When several labels fit one path.
        ParameterError
            When metadata are not text.
        """
        for key, value in metadata.items():
            require_kind(value, str, f"write metadata {key} as text")
        paths = [source_path(source) for source in sources] if labels else []
        return cls(dict(zip(map(place, paths), find_labels(paths, labels), strict=True)), labels, metadata)

    def apply(self, rows: Sequence[Row]) -> list[Row]:
        """Return the rows of a source with what they are given, in place of what they have."""
        if len(rows) > 1:
            found = find_labels([row.name for row in rows], self.labels) if self.labels else [""] * len(rows)
        else:
            found = [self._label(row) for row in rows]
        return [
            replace(row, label=label or row.label, metadata={**row.metadata, **self.metadata})
            for row, label in zip(rows, found, strict=True)
        ]

    def _label(self, row: Row) -> str:
        """Return the label of the first path of a row that has one."""
        return next(filter(None, (self.by_path.get(place(path)) for path in (row.path, *row.copies))), "")
