"""Tests of the approximate index and of putting an index in order."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from spem.codes.model import Model
from spem.errors import ParameterError
from spem.index import optimizing, searching
from spem.index.approximate import Approximation, nearest_cosines
from spem.index.index import Index
from spem.index.row import Row
from spem.index.updates import write

pytestmark = pytest.mark.usefixtures("few_queries")


def test_optimize_builds_measures_and_drops(crowd: Index) -> None:
    """The approximate index is there when asked for, its recall told and kept, and gone when not wanted."""
    (done,) = crowd.optimize(approximate=True)
    assert (done.model, done.n_rows) == (crowd.digest(), 300)
    assert done.n_bytes > 300 * 64 * 4
    assert done.approximate is not None
    assert done.approximate.recall >= 0.95
    found = crowd.search("shape 7", 10, exact=False)
    assert (found.method, found.recall) == ("approximate", done.approximate.recall)
    assert crowd.search("shape 7", 10).method == "exact"
    near = crowd.search("shape 7", 10, exact=True)
    assert [one.row.id for one in found] == [one.row.id for one in near]
    assert [one.distance for one in found] == [one.distance for one in near]
    assert crowd.optimize(approximate=False)[0].approximate is None
    assert Approximation.of(crowd.store.table(crowd.digest())) is None


def test_small_indexes_have_none_of_their_own_accord(crowd: Index, monkeypatch: pytest.MonkeyPatch) -> None:
    """Beyond a number of rows the index is built, and asked, without being named; it then stays."""
    assert crowd.optimize()[0].approximate is None
    for module in (optimizing, searching):
        monkeypatch.setattr(module, "EXACT_ROWS", 200)
    assert crowd.search("shape 7").method == "exact"
    assert crowd.optimize()[0].approximate is not None
    assert crowd.search("shape 7").method == "approximate"
    assert crowd.search("shape 7", exact=True).method == "exact"
    monkeypatch.setattr(optimizing, "EXACT_ROWS", 1000)
    assert crowd.optimize()[0].approximate is not None


def test_rows_that_came_later_are_found(
    crowd: Index, tiny_model: Model, ready_row: Callable[..., Row], monkeypatch: pytest.MonkeyPatch
) -> None:
    """New rows are found before the index has them; it takes them in, and is built anew when few are old."""
    before = crowd.optimize(approximate=True)[0].approximate
    assert before is not None
    write(crowd.store, tiny_model.digest, [ready_row("late")])
    assert crowd.search("late", 1, exact=False)[0].row.name == "late"
    taken = crowd.optimize()[0].approximate
    assert taken is not None
    assert (taken.n_rows, taken.n_trained) == (301, before.n_trained)
    assert crowd.search("late", 1, exact=False)[0].row.name == "late"
    monkeypatch.setattr(optimizing, "_GROWN", 1)
    anew = crowd.optimize()[0].approximate
    assert anew is not None
    assert anew.n_trained == 301


def test_filters_and_reranking_of_the_approximate_index(crowd: Index) -> None:
    """Filters come before the nearest; diffusion says that it followed an approximate search."""
    crowd.optimize(approximate=True)
    found = crowd.search("shape 7", 5, exact=False, where="label = '20'")
    assert [one.row.label for one in found] == ["20"] * 5
    assert crowd.search("shape 7", exact=False, rerank=True).method == "approximate, diffusion re-ranked"


def test_few_codes_are_refused(filled: Index) -> None:
    """Too few codes to train on are told, with their number."""
    with pytest.raises(ParameterError, match="4 codes, an approximate index needs 256"):
        filled.optimize(approximate=True)


def test_cosines_of_the_nearest_in_one_pass(crowd: Index) -> None:
    """The largest cosines, batch by batch, are those of the full product."""
    table = crowd.store.table(crowd.digest())
    flat = table.search().select(["vector"]).to_arrow().column("vector").combine_chunks()
    codes = flat.flatten().to_numpy().reshape(300, -1)
    expected = np.sort(codes[:5] @ codes.T, axis=1)[:, ::-1][:, :4]
    assert np.allclose(nearest_cosines(table, codes[:5], 4), expected, atol=1e-6)
    assert nearest_cosines(table, codes[:2], 999).shape == (2, 300)


def test_search_asks_as_many_cells_as_recall_needs(crowd: Index) -> None:
    """What is kept of the index is how it is asked."""
    crowd.optimize(approximate=True)
    way = Approximation.of(crowd.store.table(crowd.digest()))
    assert way is not None
    assert replace(way, recall=1.0).n_probes in (8, 16, 32, 64, 128, 256)
