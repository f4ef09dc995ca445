"""What a search answers: rows of an index, nearest first, as a table."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, overload

from spem.index.extra import require
from spem.index.row import Row

if TYPE_CHECKING:
    import pandas as pd


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


@dataclass(frozen=True)
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
    """

    found: tuple[Found, ...]
    method: str = "exact"
    model: str = ""
    details: dict[str, Any] = field(default_factory=dict)

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

    def to_pandas(self) -> pd.DataFrame:
        """Return the answers as a table of pandas.

        Raises
        ------
        MissingExtraError
            When pandas is not installed.
        """
        pandas = require("pandas")
        columns = ("rank", "distance", "id", "name", "path", "label", "ndim", "volume")
        return pandas.DataFrame([self._record(one) for one in self.found], columns=columns)

    def _record(self, one: Found) -> dict[str, Any]:
        """Return one answer as plain values."""
        row = one.row
        return {
            "rank": one.rank,
            "distance": one.distance,
            "id": row.id,
            "name": row.name,
            "path": row.path,
            "label": row.label,
            "ndim": row.ndim,
            "volume": row.volume,
        }
