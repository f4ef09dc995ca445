"""Tests of the facade: models, labels, rows; adding and searching have tests of their own."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from spem.codes.codes import Codes
from spem.codes.model import Model
from spem.codes.settings import Settings
from spem.errors import LabelError, ModelError, ParameterError, ReadError
from spem.index.index import Index
from spem.index.row import Row
from spem.index.updates import write


@pytest.fixture
def other_model() -> Model:
    """Return a model of its own, of codes of 16 numbers."""
    settings = Settings(features="spem", n_maps=2, n_centers=2, levels=1)
    return Model.fit(settings, [(np.random.default_rng(1).random((50, 2)),) for _ in range(3)], ndim=2)


def test_models_stand_side_by_side(filled: Index, tiny_model: Model, other_model: Model) -> None:
    """With several models one has to be named; each has its rows."""
    filled.store.save_model(other_model)
    facts = {model.digest: model for model in filled.models()}
    assert facts[tiny_model.digest].n_shapes == 4
    assert (facts[other_model.digest].n_shapes, facts[other_model.digest].n_code) == (0, other_model.n_code)
    assert facts[tiny_model.digest].features == "spem"
    with pytest.raises(ModelError, match=r"2 models \(.*, .*\); name one of them"):
        filled.rows()
    assert len(filled.rows(model=tiny_model.digest)) == 4
    assert filled.rows(model=other_model.digest) == []
    assert len(filled) == 4


def test_another_model_is_refused(filled: Index, tiny_model: Model, other_model: Model) -> None:
    """Codes and models that the index has not are refused, naming both."""
    codes = Codes(("a",), ("a",), ("0",), np.ones((1, other_model.n_code)), other_model)
    for stranger in (other_model, codes, other_model.digest):
        with pytest.raises(ModelError, match=f"model {other_model.digest} .* has {tiny_model.digest}"):
            filled.digest(stranger)
    assert filled.digest(tiny_model) == tiny_model.digest


def test_an_empty_index_says_so(tmp_path: Path) -> None:
    """Without a shape there is no model to ask with."""
    index = Index.open(tmp_path)
    assert (len(index), index.models(), index.check()) == (0, (), ())
    with pytest.raises(ModelError, match="an index without a shape; add some first"):
        index.rows()


def test_get_returns_everything(filled: Index, ready_row: Callable[..., Row]) -> None:
    """One row with code, picture and shape; an id that is none is told."""
    row = filled.get(ready_row("d'oh").id)
    assert row.name == "d'oh"
    assert np.linalg.norm(row.code) == pytest.approx(1)
    assert row.shape == ready_row("d'oh").shape
    with pytest.raises(ReadError, match="no shape x'y; see: spem index list"):
        filled.get("x'y")


def test_annotate_gives_labels_and_metadata(filled: Index) -> None:
    """A filter, ids or all; keys are added and taken away."""
    assert filled.annotate(where="label = 'cats'", label="", metadata={"site": None, "new": "it's"}) == 1
    [row] = filled.rows("metadata.new = 'it''s'")
    assert (row.label, dict(row.metadata)) == ("", {"the age": "3", "new": "it's"})
    assert filled.annotate(row.id, label="tiger") == 1
    assert filled.annotate(metadata={"all": "1"}) == 4
    with pytest.raises(ParameterError, match="expected a name and text"):
        filled.annotate(metadata={"n": 3})  # type: ignore[dict-item]


def test_label_takes_a_table(filled: Index, tmp_path: Path) -> None:
    """Rows are found by the ends of their paths; what fits no row is told."""
    table = tmp_path / "labels.csv"
    table.write_text("file,label\ncat.png,feline\nnowhere/cow.png,bovine\nhen.png,bird\n")
    assert filled.label(table) == (2, ["hen.png"])
    assert {row.name: row.label for row in filled.rows()} == {
        "cat": "feline",
        "cow": "bovine",
        "dog": "dogs",
        "d'oh": "it's",
    }
    with pytest.raises(LabelError, match="none of the 4 shapes has a label"):
        filled.label({"hen.png": "bird"})


def test_labels_reach_copies_and_label_volumes(
    filled: Index, tiny_model: Model, ready_row: Callable[..., Row]
) -> None:
    """A copy's path finds its row, and a shape of a file of several goes by its name."""
    rows = [ready_row("teeth", "-1"), ready_row("teeth", "-2"), ready_row("cow", path="/else/where.png")]
    write(filled.store, tiny_model.digest, rows)
    assert filled.label({"teeth-2": "molar", "where.png": "bovine"}) == (2, [])
    assert filled.count("name = 'teeth-2' AND label = 'molar'") == 1
    assert filled.count("name = 'cow' AND label = 'bovine'") == 1


def test_remove_takes_ids_or_a_filter(filled: Index) -> None:
    """One of both, not neither."""
    with pytest.raises(ParameterError, match="remove takes ids or a filter"):
        filled.remove()
    assert filled.remove(filled.rows("name = 'cat'")[0].id) == 1
    assert filled.remove(where="label IS NOT NULL") == 3


def test_drop_takes_a_model_with_its_rows(filled: Index, tiny_model: Model, other_model: Model) -> None:
    """The other model stays, and the index needs no name again; the model may come back."""
    filled.store.save_model(other_model)
    assert filled.drop(tiny_model.digest) == 4
    assert [model.digest for model in filled.models()] == [other_model.digest]
    with pytest.raises(ModelError, match="is none of"):
        filled.drop(tiny_model.digest)
    filled.store.save_model(tiny_model)
    assert filled.count(model=tiny_model.digest) == 0
    assert filled.model(tiny_model.digest).digest == tiny_model.digest
