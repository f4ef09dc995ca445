"""Tests of near-duplicates."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from spem.codes.model import Model
from spem.errors import ParameterError
from spem.index import duplicates
from spem.index.duplicates import components, near_pairs
from spem.index.index import Index
from spem.index.row import Row
from spem.index.schema import standardised_codes
from spem.index.snapshot import Snapshots
from spem.index.updates import write
from spem.retrieval.distances import correlation_distance


@pytest.fixture
def chained(filled: Index, tiny_model: Model, ready_row: Callable[..., Row]) -> Index:
    """Return an index with a chain of three, a pair of copies, and a file that is there twice."""
    one, two = np.random.default_rng(2).standard_normal((2, tiny_model.n_code))
    turn = {
        name: np.cos(angle) * one + np.sin(angle) * two
        for name, angle in zip("abc", (0, 0.1, 0.2), strict=True)
    }
    rows = [replace(ready_row(name), code=code.astype(np.float32)) for name, code in turn.items()]
    rows += [replace(ready_row(name), code=ready_row("cat").code) for name in ("cat again",)]
    rows.append(ready_row("twice", path="/nowhere/first.png", copies=("/nowhere/second.png",)))
    write(filled.store, tiny_model.digest, rows)
    return filled


def test_groups_are_chains_with_their_middle_and_width(chained: Index) -> None:
    """A chain is one group; its middle stands for it, and its diameter is the distance of its ends."""
    found = chained.duplicates(0.008)
    chain, pair = found
    assert chain.representative.name == "b"
    assert {row.name for row in chain.rows} == {"a", "b", "c"}
    assert chain.distances[0] == 0
    assert chain.distances == tuple(sorted(chain.distances))
    assert chain.distances[-1] < 0.008 < chain.diameter
    assert {row.name for row in pair.rows} == {"cat", "cat again"}
    assert pair.diameter == pytest.approx(0, abs=1e-12)
    assert [row.path for row in found.copies] == ["/nowhere/first.png"]
    assert repr(found) == "Duplicates(2 groups of 5 shapes within 0.008, exact)"
    assert found.to_dicts()[0]["shapes"][0]["name"] == "b"


def test_filters_leave_rows_out(chained: Index) -> None:
    """Rows that a filter does not let through join nothing."""
    assert len(chained.duplicates(0.008, where="name <> 'b'")) == 1
    assert not chained.duplicates(0.008, where="name = 'a'").copies


def test_distances_without_meaning_are_refused(chained: Index, monkeypatch: pytest.MonkeyPatch) -> None:
    """The distance lies between 0 and 1, and may not join all with all."""
    with pytest.raises(ParameterError, match=r"distance=0: expected a correlation distance in \(0, 1\)"):
        chained.duplicates(0)
    monkeypatch.setattr(duplicates, "_MANY_PAIRS", 2)
    with pytest.raises(ParameterError, match="joins more than 2 pairs; give a smaller one"):
        chained.duplicates(0.9)
    with pytest.raises(ParameterError, match="over 10 bytes of memory"):
        replace(chained, snapshots=Snapshots(10)).duplicates(0.01)


@settings(max_examples=20, deadline=None)
@given(st.integers(0, 2**32 - 1), st.integers(0, 30), st.floats(0.01, 0.9))
def test_pairs_are_those_of_the_whole_matrix(seed: int, n: int, limit: float) -> None:
    """Blocks of any size find the pairs that the matrix of distances has below the limit."""
    codes = standardised_codes(np.random.default_rng(seed).standard_normal((n, 5)))
    whole = correlation_distance(codes, codes.copy()) if n else np.empty((0, 0))
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(duplicates, "_BLOCK", 7)
        pairs = near_pairs(codes, limit)
    clear = np.abs(whole - limit) > 1e-6
    expected = {(i, j) for i, j in np.argwhere((whole <= limit) & clear).tolist() if i < j}
    assert {(i, j) for i, j in pairs.tolist() if clear[i, j]} == expected


def test_components_of_no_pairs() -> None:
    """Without pairs there is no group."""
    assert components(np.empty((0, 2), np.intp), 3) == []
    assert components(np.empty((0, 2), np.intp), 0) == []


@pytest.mark.usefixtures("few_queries")
def test_the_approximate_index_finds_the_same_groups(crowd: Index, monkeypatch: pytest.MonkeyPatch) -> None:
    """Where pairs are asked of the approximate index the groups are those of all pairs."""
    exact = crowd.duplicates(0.12)
    crowd.optimize(approximate=True)
    monkeypatch.setattr(duplicates, "EXACT_ROWS", 100)
    asked = crowd.duplicates(0.12)
    assert (exact.method, asked.method) == ("exact", "approximate")
    assert asked.to_dicts() == exact.to_dicts()
    assert len(exact) == 30
