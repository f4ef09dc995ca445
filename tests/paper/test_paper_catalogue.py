"""What of the paper is reproduced."""

from __future__ import annotations

from pathlib import Path

import pytest

import spem
from spem.errors import ParameterError
from spem.paper.catalogue import ITEMS, Item, choose
from spem.paper.data import Data


def test_each_script_is_an_item_and_each_item_has_a_script():
    """The folder of examples and the catalogue hold the same names."""
    folder = Path(spem.__file__).parents[2] / "examples"
    assert sorted(item.name for item in ITEMS) == sorted(path.stem for path in folder.glob("*.py"))


def test_titles_and_texts_are_there():
    """Every item has a title and a text of its own."""
    titles = [item.words[0] for item in ITEMS]
    assert len(set(titles)) == len(ITEMS)
    assert all(item.words[1] for item in ITEMS)


def test_all_stands_for_every_item():
    """Whatever other item is named."""
    assert choose(["fig1", "all"]) == ITEMS


@pytest.mark.parametrize("name", ["fig21", "tabel1", "Fig13", "nothing like it", ""])
def test_unknown_item_is_refused_with_the_nearest(name):
    """The message names the wrong word and what to do."""
    with pytest.raises(ParameterError, match=f"{name or 'an empty name'}: no such item of the paper"):
        choose(["all", name])


def test_a_missing_script_is_told(tmp_path, monkeypatch):
    """On one line, with what to do."""
    monkeypatch.setattr("spem.paper.catalogue._folder", lambda: tmp_path)
    with pytest.raises(
        ParameterError, match=r"fig2.py: the script of fig2 cannot be read; install spem again"
    ):
        _ = Item("fig2", "2.2").words
    with pytest.raises(ParameterError, match="install spem again"):
        Item("nowhere", "2.2").make(Data())
