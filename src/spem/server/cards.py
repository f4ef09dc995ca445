"""Rows as the JSON of the interface has them: base names of files, never paths of the host."""

from __future__ import annotations

import json
import math
from typing import Any

from spem.index.answers import Answers
from spem.index.row import Row
from spem.server.refusals import plain


def base_name(path: str) -> str:
    r"""Return the last part of a path or address of any system.

    Examples
    --------
    >>> base_name("C:\\scans\\cat.obj"), base_name("s3://shapes/cat.obj")
    ('cat.obj', 'cat.obj')
    """
    return path.replace("\\", "/").rstrip("/").rpartition("/")[2]


def card(row: Row) -> dict[str, Any]:
    """Return what a list shows of a row."""
    return {
        "id": row.id,
        "name": row.name,
        "label": row.label,
        "ndim": row.ndim,
        "n_nodes": row.n_nodes,
        "volume": row.volume if math.isfinite(row.volume) else None,
        "file": base_name(row.path),
        "metadata": dict(row.metadata),
        "added": row.added.isoformat(),
        "copies": len(row.copies),
    }


def full_card(row: Row, model: str) -> dict[str, Any]:
    """Return all that is told of a row: the card, the report and the model."""
    report = {key: _told(key, value) for key, value in row.report.items()}
    return {**card(row), "report": report, "model": model}


def _told(key: str, value: Any) -> Any:
    """Return an entry of a report without paths."""
    if key == "source":
        return base_name(str(value))
    if isinstance(value, (list, tuple)):
        return [_told("", one) for one in value]
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return plain(value) if isinstance(value, str) else value


def ranking(query: dict[str, Any], answers: Answers, seconds: float) -> dict[str, Any]:
    """Return the answers to a query."""
    return {
        "query": query,
        "method": answers.method,
        "model": answers.model,
        "seconds": round(seconds, 6),
        "answers": [
            {"rank": one.rank, "distance": round(one.distance, 6), "shape": card(one.row)} for one in answers
        ],
    }


def to_json(values: Any) -> bytes:
    """Return plain values as the bytes of JSON.

    Examples
    --------
    >>> to_json({"n": 1})
    b'{"n":1}'
    """
    return json.dumps(values, ensure_ascii=False, allow_nan=False, separators=(",", ":")).encode()
