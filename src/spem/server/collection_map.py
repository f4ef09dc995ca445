"""The map of a collection: its shapes in the plane, as the explorer draws them."""

from __future__ import annotations

import numpy as np

from spem.server.cards import to_json
from spem.server.catalogue import Catalogue

# Beyond so many points a browser has nothing to gain from more.
MOST_POINTS = 20_000
_METHOD = "t-SNE of correlation distances"
_DIGITS = 5


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
    table = catalogue.index.store.table(digest).search().select(["id", "name", "label", "vector"]).to_arrow()
    total = len(table)
    table = table.sort_by("id")
    if total > MOST_POINTS:
        table = table.take(np.sort(rng.choice(total, MOST_POINTS, replace=False)))
    flat = table["vector"].combine_chunks().flatten().to_numpy(zero_copy_only=False)
    places = lay_out(flat.reshape(len(table), -1), rng) if len(table) else np.zeros((0, 2))
    records = table.select(["id", "name", "label"]).to_pylist()
    points = [
        record | {"x": round(float(x), _DIGITS), "y": round(float(y), _DIGITS)}
        for record, (x, y) in zip(records, places, strict=True)
    ]
    return to_json({"method": _METHOD, "points": points, "total": total})
