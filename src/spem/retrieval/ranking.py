"""Ranked answers to a query: the shapes of a collection, nearest first."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from spem.codes.arguments import whole_number
from spem.codes.codes import Codes
from spem.retrieval.distances import correlation_distance


@dataclass(frozen=True)
class Answer:
    """One shape that answers a query.

    Parameters
    ----------
    rank
        Place among the answers, from 1.
    name, path
        The shape, as its codes name it.
    distance
        Correlation distance to the query, in [0, 2].
    """

    rank: int
    name: str
    path: str
    distance: float


def rank(query: ArrayLike, codes: Codes, k: int | None = 10) -> list[Answer]:
    """Rank the shapes of a collection by correlation distance to a query (section 5.5).

    Parameters
    ----------
    query
        ``(n_code,)`` code of the query, made with the model of the collection.
    codes
        The collection.
    k
        Number of answers; all with None.

    Returns
    -------
    list of Answer
        Nearest first, equally near ones in the order of the collection.

    Raises
    ------
    ParameterError
        If `k` is below 1, or the query is no code of the collection's model.

    Examples
    --------
    >>> from spem.codes.model import Model
    >>> from spem.codes.settings import Settings
    >>> rng = np.random.default_rng(0)
    >>> settings = Settings(features="spem", n_maps=2, n_centers=4)
    >>> model = Model.fit(settings, [rng.random((50, 2)) for _ in range(3)])
    >>> vectors = np.eye(2, model.n_code)
    >>> codes = Codes(("a", "b"), ("a.png", "b.png"), ("0", "1"), vectors, model)
    >>> [(answer.rank, answer.name) for answer in rank(vectors[1], codes)]
    [(1, 'b'), (2, 'a')]
    """
    count = None if k is None else whole_number("k", k)
    distances = correlation_distance(np.atleast_2d(np.asarray(query, float)), codes.vectors)[0]
    order = np.argsort(distances, kind="stable")[:count]
    return [
        Answer(place, codes.names[i], codes.paths[i], float(distances[i])) for place, i in enumerate(order, 1)
    ]
