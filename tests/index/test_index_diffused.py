"""Tests of re-ranking over the neighbourhood of a query."""

from __future__ import annotations

import numpy as np
import pytest

from spem.index.index import Index
from spem.retrieval.diffusion import rerank
from spem.retrieval.distances import correlation_distance


def test_reranking_is_diffusion_over_the_neighbourhood(crowd: Index) -> None:
    """Answers have the order that diffusion of the 200 nearest rows gives them, and say so."""
    near = crowd.search("shape 7", 200)
    codes = np.stack([crowd.get(one.row.id).code for one in near])
    spread = rerank(correlation_distance(codes.astype(float), codes.astype(float)))[0]
    order = np.argsort(spread, kind="stable")[:12]
    found = crowd.search("shape 7", 12, rerank=True)
    assert found.method == "exact, diffusion re-ranked"
    assert [one.row.id for one in found] == [near[int(i)].row.id for i in order]
    assert [one.distance for one in found] == pytest.approx(spread[order].tolist(), abs=1e-5)


def test_a_query_of_its_own_takes_part(crowd: Index) -> None:
    """A code that the index does not hold is reranked among its own class, none of it at distance zero."""
    codes = np.stack([crowd.get(crowd.find([f"/nowhere/shape {i}.png"])[0]).code for i in range(70, 80)])
    found = crowd.search(codes.mean(axis=0), 10, rerank=True)
    assert {one.row.label for one in found} == {"7"}
    assert found[0].distance > 0


def test_a_few_rows_have_no_neighbourhood(filled: Index) -> None:
    """With fewer than three codes the order stays."""
    plain = filled.search("cat", 2, where="name IN ('cat', 'dog')")
    again = filled.search("cat", 2, where="name IN ('cat', 'dog')", rerank=True)
    assert [one.row.id for one in again] == [one.row.id for one in plain]
    assert [one.rank for one in filled.search("cat", 10, rerank=True)] == [1, 2, 3, 4]
    assert len(filled.search("cat", 10, where="name = 'nobody'", rerank=True)) == 0
