"""Filters become SQL in which nothing of the request is but text."""

from __future__ import annotations

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

pytest.importorskip("pyarrow")
pytest.importorskip("lancedb")

import lancedb
import pyarrow as pa

from spem.server.queries import Filters, is_id, parse_metadata
from spem.server.refusals import Refusal

TEXTS = st.text(st.characters(min_codepoint=32, exclude_categories=("Cs",)), min_size=1, max_size=12)


@pytest.fixture(scope="module")
def table(tmp_path_factory):
    database = lancedb.connect(str(tmp_path_factory.mktemp("queries")))
    columns = pa.schema([("name", pa.string()), ("label", pa.string()), ("ndim", pa.int32()),
                         ("metadata", pa.map_(pa.string(), pa.string()))])  # fmt: skip
    rows = pa.table({"name": ["a"], "label": ["b"], "ndim": [2], "metadata": [[("k", "v")]]}, schema=columns)
    return database.create_table("t", rows)


@settings(max_examples=25, deadline=None)
@given(text=TEXTS, label=TEXTS)
def test_no_text_is_more_than_text(table, text, label):
    """Whatever is asked for, the filter is valid and finds only what has that text."""
    assert table.count_rows(Filters(text, label).where()) == (text.lower() == "a" and label == "b")


def test_all_terms_hold_together(table):
    """Each term of a filter counts."""
    found = Filters("A", "b", 2, (("k", "v"),))
    assert table.count_rows(found.where()) == 1
    for other in (Filters(ndim=3), Filters(metadata=(("k", "w"),)), Filters(metadata=(("l", "v"),))):
        assert table.count_rows(other.where()) == 0
    assert Filters().where() is None


def test_control_characters_are_refused():
    """No literal has control characters."""
    with pytest.raises(Refusal, match="control characters"):
        Filters("a\x00b").where()


@pytest.mark.parametrize("pair", ["a", ":b", "a'b:c", "x" * 65 + ":y"])
def test_keys_of_metadata_are_checked(pair):
    """A key has letters, digits and little else."""
    with pytest.raises(Refusal, match="KEY:VALUE"):
        parse_metadata([pair])


@pytest.mark.parametrize(
    "text", ["", "x" * 20, "0" * 19, "0" * 20 + "-" + "9" * 81, "0" * 20 + "\n", "0" * 20 + "-a/b"]
)
def test_other_texts_are_no_ids(text):
    """An id is of hex digits, and perhaps a short suffix."""
    assert not is_id(text)
    assert is_id("0" * 20 + "-3")
