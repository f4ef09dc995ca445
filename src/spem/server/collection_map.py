"""The map of a collection: its shapes in the plane, as the explorer draws them."""

from __future__ import annotations

from typing import Any

import numpy as np

from spem.index.extra import require
from spem.index.filters import any_of
from spem.server.cards import to_json
from spem.server.catalogue import Catalogue

# Beyond so many points a browser has nothing to gain from more.
MOST_POINTS = 20_000
_METHOD = "t-SNE of correlation distances"
_DIGITS = 5
# Rows that one filter names.
_AT_ONCE = 2000


def collection_map(catalogue: Catalogue, digest: str) -> bytes:
    """Return the JSON of the map of a model's shapes; of very many a sample, the same each time.

    Parameters
    ----------
    catalogue
        The index.
    digest
        The model.
    """
    from spem.index.layout import lay_out

    rng = np.random.default_rng(0)
    table, total = _codes(catalogue.index.store.table(digest), rng)
    flat = table["vector"].combine_chunks().flatten().to_numpy(zero_copy_only=False)
    places = lay_out(flat.reshape(len(table), -1), rng) if len(table) else np.zeros((0, 2))
    records = table.select(["id", "name", "label"]).to_pylist()
    points = [
        record | {"x": round(float(x), _DIGITS), "y": round(float(y), _DIGITS)}
        for record, (x, y) in zip(records, places, strict=True)
    ]
    return to_json({"method": _METHOD, "points": points, "total": total})


def _codes(table: Any, rng: np.random.Generator) -> tuple[Any, int]:
    """Return names and codes in order of the ids, of very many those of a sample, and the number of rows."""
    columns = ["id", "name", "label", "vector"]
    total = int(table.count_rows())
    if total <= MOST_POINTS:
        return table.search().select(columns).to_arrow().sort_by("id"), total
    ids = np.sort(table.search().select(["id"]).to_arrow()["id"].to_numpy())
    chosen = rng.choice(ids, MOST_POINTS, replace=False)
    read = [
        table.search()
        .where(any_of("id", chosen[start : start + _AT_ONCE].tolist()))
        .select(columns)
        .to_arrow()
        for start in range(0, MOST_POINTS, _AT_ONCE)
    ]
    return require("pyarrow").concat_tables(read).sort_by("id"), total
