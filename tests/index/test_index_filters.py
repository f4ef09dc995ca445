"""Tests of filters of rows."""

from __future__ import annotations

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from spem.errors import ParameterError
from spem.index.filters import any_of, literal, to_sql
from spem.index.index import Index


@pytest.mark.parametrize(
    ("where", "names"),
    [
        ("label = 'cats'", {"cat"}),
        ("metadata.site = 'Oslo'", {"cat"}),
        ("METADATA . site IN ('Oslo', 'Rome')", {"cat", "dog"}),
        ("metadata.'the age' = '3'", {"cat"}),
        ("metadata.\"the age\" = '3' OR name = 'cow'", {"cat", "cow"}),
        ("metadata.site IS NULL", {"cow", "d'oh"}),
        ("label = 'it''s' AND volume > 3", {"d'oh"}),
        ("name = 'metadata.site'", set()),
        ("name LIKE 'c%' AND volume BETWEEN 1 AND 2", {"cow"}),
        ("array_length(copies) > 0", set()),
    ],
)
def test_filters_choose_rows(filled: Index, where: str, names: set[str]) -> None:
    """SQL over columns and keys of metadata chooses rows; what is quoted is text."""
    assert {row.name for row in filled.rows(where)} == names
    assert filled.count(where) == len(names)


@pytest.mark.parametrize(
    "where", ["label = ", "nope = 1", "label ~ 3", "label = 'x", "volume = 'abc'", "foo(label)", "label"]
)
def test_filters_without_meaning_are_refused(filled: Index, where: str) -> None:
    """What is no filter is told as such, on one line."""
    for read in (filled.rows, filled.count):
        with pytest.raises(ParameterError, match="no filter of rows") as refused:
            read(where)
        assert "\n" not in str(refused.value)


def test_filters_are_not_empty() -> None:
    """An empty filter is refused rather than taken for all or nothing."""
    with pytest.raises(ParameterError, match="leave it out"):
        to_sql(" ")


@settings(max_examples=100, deadline=None)
@given(st.text(alphabet="ab'\"\\;-. metadata", max_size=12))
def test_literal_survives_rewriting(text: str) -> None:
    """Whatever a literal holds, it is passed over, and what follows is not."""
    assert to_sql(f"label = {literal(text)} AND metadata.k = 'v'") == (
        f"label = {literal(text)} AND map_extract(metadata, 'k')[1] = 'v'"
    )


def test_literal_refuses_null_characters() -> None:
    """The database ends text at a null character."""
    with pytest.raises(ParameterError, match="null character"):
        literal("a\0b")


def test_any_of_nothing_is_false(filled: Index) -> None:
    """A choice among no values lets no row through."""
    assert filled.rows(any_of("id", [])) == []
    assert filled.count(any_of("label", ["cats", "it's"])) == 2


def test_refusals_are_short(filled: Index) -> None:
    """Of a filter of many characters the refusal repeats the first."""
    with pytest.raises(ParameterError, match="no filter of rows") as refused:
        filled.rows("(" * 20_000)
    assert len(str(refused.value)) < 600


def test_text_that_is_no_unicode_is_no_damage(filled: Index) -> None:
    """Half a character, which no database keeps, is told as such."""
    with pytest.raises(ParameterError, match="no Unicode"):
        filled.annotate(where="true", metadata={"a": "\ud800"})
