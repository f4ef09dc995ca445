"""Ranked answers of an index: exact from memory, or from the database's own search."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from spem.codes.model import Model
from spem.index.answers import Answers, Found
from spem.index.schema import LIGHT, standardised_codes, to_row
from spem.index.store import Store


def nearest(
    store: Store, model: Model, code: NDArray[np.float32], k: int, where: str | None = None
) -> Answers:
    """Return the `k` rows whose codes are nearest to one."""
    vector = standardised_codes(code[None])[0]
    query = store.table(model.digest).search(vector).distance_type("dot")
    if where:
        query = query.where(where, prefilter=True)
    records = query.select([*LIGHT, "_distance"]).limit(k).to_list()
    found = (
        Found(place, float(np.clip(record["_distance"], 0, 2)), to_row(record))
        for place, record in enumerate(records, 1)
    )
    return Answers(tuple(found), "exact", model.digest)
