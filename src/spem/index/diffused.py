"""Answers put in the order of diffusion over the neighbourhood of a query."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from spem.index.comparison import Nearest
from spem.retrieval.diffusion import rerank
from spem.retrieval.distances import correlation_distance

# Rows that diffusion goes through: several times as many as people look at, and solved in a millisecond.
NEIGHBOURHOOD = 200
# Fewer have no neighbourhood.
_LEAST = 3


def diffused(near: Nearest, vector: NDArray[np.float32], k: int) -> Nearest:
    """Order the nearest codes by diffusion, as `spem.retrieval.diffusion.rerank` has it.

    Parameters
    ----------
    near
        The nearest codes, many more than are wanted.
    vector
        ``(n_code,)`` standardised code of the query, which takes part in the diffusion. Where it is among
        the nearest it takes part once.
    k
        Number of answers.

    Returns
    -------
    Nearest
        At most `k`, with diffusion distances.
    """
    found = len(near.distances)
    own = found > 0 and near.distances[0] == 0
    codes = near.vectors if own else np.concatenate([vector[None], near.vectors])
    if len(codes) < _LEAST:
        order, distances = np.arange(min(found, k)), near.distances[:k]
    else:
        codes = codes.astype(np.float64)
        spread = rerank(correlation_distance(codes, codes))[0, 0 if own else 1 :]
        order = np.argsort(spread, kind="stable")[:k]
        distances = spread[order]
    records = near.records
    return replace(
        near, distances=distances, vectors=near.vectors[order], records=lambda places: records(order[places])
    )
