"""How rows lie in the database: the columns of a table, and the way there and back."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from spem.index.extra import require
from spem.index.filters import as_text
from spem.index.row import Row

if TYPE_CHECKING:
    import pyarrow

# Raised when columns change their meaning; an index of a later layout is refused.
LAYOUT = 1
LAYOUT_KEY = b"spem.layout"
# Columns that answers and lists need: everything but the heavy ones.
LIGHT = (
    "id",
    "hash",
    "name",
    "path",
    "copies",
    "label",
    "metadata",
    "ndim",
    "n_nodes",
    "volume",
    "report",
    "added",
)
HEAVY = ("vector", "thumbnail", "shape")
# The database refuses a second row of the same key, whoever writes it at the same time.
_KEY = {b"lance-schema:unenforced-primary-key": b"true"}
_CODED = ("copies", "metadata", "report")


def schema(n_code: int) -> pyarrow.Schema:
    """Return the columns of a table of codes of this length.

    ``vector`` holds codes less their mean and of unit length, so that their product is the correlation.
    """
    pa = require("pyarrow")
    return pa.schema(
        [
            pa.field("id", pa.string(), nullable=False, metadata=_KEY),
            ("hash", pa.string()),
            ("name", pa.string()),
            ("path", pa.string()),
            ("copies", pa.list_(pa.string())),
            ("label", pa.string()),
            ("metadata", pa.map_(pa.string(), pa.string())),
            ("ndim", pa.int32()),
            ("n_nodes", pa.int64()),
            ("volume", pa.float64()),
            ("report", pa.string()),
            ("added", pa.timestamp("us", tz="UTC")),
            ("vector", pa.list_(pa.float32(), n_code)),
            ("thumbnail", pa.large_binary()),
            ("shape", pa.large_binary()),
        ],
        metadata={LAYOUT_KEY: str(LAYOUT).encode()},
    )


def models_schema() -> pyarrow.Schema:
    """Return the columns of the table of models."""
    pa = require("pyarrow")
    return pa.schema(
        [
            pa.field("digest", pa.string(), nullable=False, metadata=_KEY),
            ("features", pa.string()),
            ("ndim", pa.int32()),
            ("n_code", pa.int32()),
            ("made", pa.timestamp("us", tz="UTC")),
            ("model", pa.large_binary()),
        ],
        metadata={LAYOUT_KEY: str(LAYOUT).encode()},
    )


def layout_of(columns: pyarrow.Schema) -> int | None:
    """Return the number of the layout that a table has, None where it is no table of an index."""
    found = (columns.metadata or {}).get(LAYOUT_KEY, b"")
    return int(found) if found.isdigit() else None


def to_table(rows: Sequence[Row], n_code: int) -> pyarrow.Table:
    """Return rows as a table."""
    pa = require("pyarrow")
    columns: dict[str, Any] = {
        name: [getattr(row, name) for row in rows]
        for name in (*LIGHT, "thumbnail", "shape")
        if name not in _CODED
    }
    columns["name"] = [as_text(row.name) for row in rows]
    columns["copies"] = [list(row.copies) for row in rows]
    columns["metadata"] = [sorted(row.metadata.items()) for row in rows]
    columns["report"] = [json.dumps(dict(row.report)) for row in rows]
    flat = pa.array(standardised_codes(np.stack([row.code for row in rows])).ravel())
    columns["vector"] = pa.FixedSizeListArray.from_arrays(flat, n_code)
    wanted = schema(n_code)
    return pa.table({name: columns[name] for name in wanted.names}, schema=wanted)


def standardised_codes(codes: NDArray[Any]) -> NDArray[np.float32]:
    """Return ``(n, n_code)`` codes centred and of unit length, in float32; constant ones as zeros."""
    from spem.codes.joining import standardised

    return np.ascontiguousarray(standardised(np.asarray(codes, np.float64)), np.float32)


def to_row(record: Mapping[str, Any]) -> Row:
    """Return the row that a record of the table stands for; columns that it has not are left empty."""
    code = np.asarray(record.get("vector", ()), np.float32)
    return Row(
        **{name: record[name] for name in LIGHT if name not in _CODED},
        code=code,
        copies=tuple(record["copies"] or ()),
        metadata=dict(record["metadata"] or ()),
        report=json.loads(record["report"] or "{}"),
        thumbnail=record.get("thumbnail") or b"",
        shape=record.get("shape") or b"",
    )
