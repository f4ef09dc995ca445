"""How rows lie in the database: the columns of a table, and the way there and back."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from spem.index.extra import require
from spem.index.row import Row

if TYPE_CHECKING:
    import pyarrow

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


def schema(n_code: int) -> pyarrow.Schema:
    """Return the columns of a table of codes of this length.

    ``vector`` holds codes less their mean and of unit length, so that their product is the correlation.
    """
    pa = require("pyarrow")
    return pa.schema(
        [
            ("id", pa.string()),
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
        ]
    )


def to_table(rows: Sequence[Row], n_code: int) -> pyarrow.Table:
    """Return rows as a table."""
    pa = require("pyarrow")
    codes = np.stack([row.code for row in rows]).astype(np.float64)
    columns: dict[str, Any] = {
        name: [getattr(row, name) for row in rows]
        for name in (*LIGHT, "thumbnail", "shape")
        if name not in ("copies", "metadata", "report")
    }
    columns["copies"] = [list(row.copies) for row in rows]
    columns["metadata"] = [sorted(row.metadata.items()) for row in rows]
    columns["report"] = [json.dumps(dict(row.report)) for row in rows]
    flat = pa.array(standardised_codes(codes).ravel())
    columns["vector"] = pa.FixedSizeListArray.from_arrays(flat, n_code)
    wanted = schema(n_code)
    return pa.table({name: columns[name] for name in wanted.names}, schema=wanted)


def standardised_codes(codes: np.ndarray[Any, Any]) -> np.ndarray[Any, np.dtype[np.float32]]:
    """Return ``(n, n_code)`` codes centred and of unit length, in float32; constant ones as zeros."""
    from spem.codes.joining import standardised

    return np.ascontiguousarray(standardised(np.asarray(codes, np.float64)), np.float32)


def to_row(record: Mapping[str, Any]) -> Row:
    """Return the row that a record of the table stands for; columns that it has not are left empty."""
    code = np.asarray(record.get("vector", ()), np.float32)
    return Row(
        **{name: record[name] for name in LIGHT if name not in ("copies", "metadata", "report")},
        code=code,
        copies=tuple(record["copies"] or ()),
        metadata=dict(record["metadata"] or ()),
        report=json.loads(record["report"] or "{}"),
        thumbnail=record.get("thumbnail") or b"",
        shape=record.get("shape") or b"",
    )
