"""What a search answers: rows of an index, nearest first, as a table of text, of pandas or of Arrow."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from html import escape
from typing import TYPE_CHECKING, Any, overload

from spem.index.extra import require
from spem.index.row import Row

if TYPE_CHECKING:
    import pandas as pd
    import pyarrow

_COLUMNS = ("rank", "distance", "id", "name", "path", "label", "ndim", "volume")
# Columns of the table that is shown.
_SHOWN = ("rank", "distance", "name", "label", "id")


@dataclass(frozen=True)
class Found:
    """One answer.

    Parameters
    ----------
    rank
        Place among the answers, from 1.
    distance
        Correlation distance to the query, in [0, 2]; after re-ranking the diffusion distance.
    row
        The shape, without its code, picture and voxels.
    """

    rank: int
    distance: float
    row: Row


@dataclass(frozen=True, repr=False)
class Answers(Sequence[Found]):
    """Ranked answers to one query.

    Parameters
    ----------
    found
        The answers, nearest first.
    method
        How they were found: ``"exact"`` or ``"approximate"``, ``", diffusion re-ranked"`` after it where so.
    model
        Digest of the model.
    recall
        Of an approximate search: the share of the ten nearest that it found when it was last measured.

    Examples
    --------
    >>> import numpy as np
    >>> Answers((Found(1, 0.25, Row("9f", "9f", "cat", "cat.obj", np.zeros(0, np.float32), label="cats")),))
    rank  distance  name  label  id
       1    0.2500  cat   cats   9f
    exact
    """

    found: tuple[Found, ...]
    method: str = "exact"
    model: str = ""
    recall: float | None = None

    @overload
    def __getitem__(self, index: int) -> Found: ...
    @overload
    def __getitem__(self, index: slice) -> tuple[Found, ...]: ...
    def __getitem__(self, index: int | slice) -> Found | tuple[Found, ...]:
        return self.found[index]

    def __len__(self) -> int:
        return len(self.found)

    def __iter__(self) -> Iterator[Found]:
        return iter(self.found)

    @property
    def manner(self) -> str:
        """How the answers were found, with the recall of an approximate search."""
        return self.method if self.recall is None else f"{self.method} (recall {self.recall:.3f})"

    def to_dicts(self) -> list[dict[str, Any]]:
        """Return the answers as plain values, which `json` can write."""
        return [
            {"rank": one.rank, "distance": one.distance}
            | {name: getattr(one.row, name) for name in _COLUMNS[2:]}
            | {"metadata": dict(one.row.metadata)}
            for one in self.found
        ]

    def to_pandas(self) -> pd.DataFrame:
        """Return the answers as a table of pandas.

        Raises
        ------
        MissingExtraError
            When pandas is not installed.
        """
        return require("pandas").DataFrame(self.to_dicts(), columns=[*_COLUMNS, "metadata"])

    def to_arrow(self) -> pyarrow.Table:
        """Return the answers as a table of Arrow."""
        pyarrow, records = require("pyarrow"), self.to_dicts()
        columns = {name: [one[name] for one in records] for name in _COLUMNS}
        words = pyarrow.map_(pyarrow.string(), pyarrow.string())
        metadata = pyarrow.array([list(one["metadata"].items()) for one in records], words)
        return pyarrow.table(columns | {"metadata": metadata})

    def __repr__(self) -> str:
        rows = [_SHOWN, *self._cells()]
        widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
        # numbers to the right, words to the left
        lines = (
            "  ".join(
                cell.ljust(width) if place > 1 else cell.rjust(width)
                for place, (cell, width) in enumerate(zip(row, widths, strict=True))
            ).rstrip()
            for row in rows
        )
        return "\n".join((*lines, self.manner))

    def _repr_html_(self) -> str:
        """Return the table that notebooks show."""
        head = "".join(f"<th>{name}</th>" for name in _SHOWN)
        body = "".join(
            "<tr>" + "".join(f"<td>{escape(cell)}</td>" for cell in row) + "</tr>" for row in self._cells()
        )
        return (
            f"<table><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table><p>{escape(self.manner)}</p>"
        )

    def _cells(self) -> list[tuple[str, ...]]:
        """Return what is shown of each answer."""
        return [
            (str(one.rank), f"{one.distance:.4f}", one.row.name, one.row.label, one.row.id)
            for one in self.found
        ]
