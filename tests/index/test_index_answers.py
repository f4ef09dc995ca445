"""Tests of answers as tables."""

from __future__ import annotations

import json
from collections.abc import Callable

import pytest

from spem.index.answers import Answers, Found
from spem.index.index import Index
from spem.index.row import Row


@pytest.fixture
def answers(ready_row: Callable[..., Row]) -> Answers:
    """Return two answers."""
    rows = (ready_row("cat", label="cats", metadata={"site": "Oslo"}), ready_row("<b>dog</b>"))
    return Answers(tuple(Found(i, 0.25 * i, row) for i, row in enumerate(rows, 1)), "approximate", "9f", 0.98)


def test_answers_are_a_sequence(answers: Answers) -> None:
    """They have a length, are gone through in order, and taken by place and slice."""
    assert len(answers) == 2
    assert [one.rank for one in answers] == [1, 2]
    assert answers[1].distance == 0.5
    assert answers[:1] == (answers[0],)


def test_text_has_aligned_columns_and_the_method(answers: Answers) -> None:
    """The text is a table, with how the answers were found below it."""
    header, first, second, method = repr(answers).splitlines()
    assert header.split() == ["rank", "distance", "name", "label", "id"]
    assert first.split()[:4] == ["1", "0.2500", "cat", "cats"]
    assert header.index("id") == first.index(answers[0].row.id) == second.index(answers[1].row.id)
    assert method == "approximate (recall 0.980)"


def test_html_escapes_names(answers: Answers) -> None:
    """A name cannot become markup in a notebook."""
    page = answers._repr_html_()
    assert "&lt;b&gt;dog" in page
    assert "<b>dog" not in page


def test_answers_become_plain_values_and_tables(answers: Answers) -> None:
    """Plain values go through JSON; pandas and Arrow have a row for each answer."""
    pytest.importorskip("pandas")
    plain = json.loads(json.dumps(answers.to_dicts()))
    assert plain[0]["metadata"] == {"site": "Oslo"}
    frame, table = answers.to_pandas(), answers.to_arrow()
    assert list(frame.columns) == table.column_names
    assert frame["name"].tolist() == table.column("name").to_pylist() == ["cat", "<b>dog</b>"]
    assert frame["distance"].tolist() == [0.25, 0.5]
    assert dict(frame["metadata"][0]) == dict(table.column("metadata").to_pylist()[0]) == {"site": "Oslo"}


def test_no_answers_are_a_table_too(filled: Index) -> None:
    """Without answers there is the header, and the method."""
    none = filled.search("cat", where="label = 'nothing'")
    assert repr(none).splitlines() == ["rank  distance  name  label  id", "exact"]
    assert none.to_dicts() == []
    assert none.to_arrow().num_rows == 0
