"""Tests of what an addition has to do."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from spem.index.changes import Known, place, plan
from spem.index.row import UPLOADED
from spem.shapes.shape import Shape


def test_plan_encodes_each_new_content_once() -> None:
    """Equal files are one content, read from the first."""
    made = plan([], [(Path("a.png"), "1"), (Path("b.png"), "1"), (Path("c.png"), "2")])
    assert dict(made.encode) == {"1": (Path("a.png"), Path("b.png")), "2": (Path("c.png"),)}
    assert (made.n_unchanged, made.n_updated, dict(made.gained), dict(made.lost)) == (0, 0, {}, {})


def test_plan_leaves_what_is_there_alone() -> None:
    """The same file is told however its path is written, and a copy is not lost."""
    known = [Known("1", ("a.png", str(Path("b.png").absolute())))]
    made = plan(known, [(Path("./folder/../a.png"), "1"), (Path("b.png"), "1")])
    assert made.n_unchanged == 2
    assert not made.encode
    assert not made.gained
    assert not made.lost


def test_plan_moves_a_path_to_its_new_content() -> None:
    """A file that changed is encoded, and the row of its old content loses the path."""
    made = plan([Known("1", ("a.png", "b.png"))], [(Path("a.png"), "2")])
    assert list(made.encode) == ["2"]
    assert dict(made.lost) == {"1": ("a.png",)}
    assert made.n_updated == 1


def test_plan_swaps_two_files() -> None:
    """Files that changed places are not encoded again."""
    known = [Known("1", ("a.png",)), Known("2", ("b.png",))]
    made = plan(known, [(Path("a.png"), "2"), (Path("b.png"), "1")])
    assert not made.encode
    assert dict(made.gained) == {"2": ("a.png",), "1": ("b.png",)}
    assert dict(made.lost) == {"2": ("b.png",), "1": ("a.png",)}


def test_plan_keeps_shapes_of_one_name_apart() -> None:
    """Shapes that are no files replace nothing, whatever their names."""
    shape = Shape.from_mask(np.ones((2, 2)), name="disk")
    made = plan([Known("1", ("disk",))], [(shape, "2")])
    assert list(made.encode) == ["2"]
    assert not made.lost


def test_plan_prunes_files_that_are_gone(tmp_path: Path) -> None:
    """Of a folder that is pruned, paths that are no longer there are lost; others stay."""
    here = tmp_path / "here.png"
    here.touch()
    known = [Known("1", (str(tmp_path / "gone.png"), "/elsewhere/gone.png")), Known("2", (str(here), "name"))]
    assert dict(plan(known, []).lost) == {}
    assert dict(plan(known, [], prune=[tmp_path]).lost) == {"1": (str(tmp_path / "gone.png"),)}


def test_place_follows_the_working_directory(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A relative path means another file elsewhere."""
    before = place("a.png")
    monkeypatch.chdir(tmp_path)
    assert place("a.png") == tmp_path.resolve() / "a.png" != before


@settings(max_examples=60, deadline=None)
@given(
    st.lists(st.tuples(st.sampled_from("abcd"), st.sampled_from("1234")), max_size=8),
    st.dictionaries(st.sampled_from("abcd"), st.sampled_from("1234"), max_size=4),
)
def test_plan_applied_gives_what_the_files_hold(before: list[tuple[str, str]], now: dict[str, str]) -> None:
    """Applied, every file given stands under its content alone, and a second plan has nothing to do."""
    rows: dict[str, set[str]] = {}
    for path, content in dict(before).items():
        rows.setdefault(content, set()).add(f"{path}.png")
    known = [Known(content, tuple(sorted(paths))) for content, paths in rows.items()]
    sources = [(Path(f"{path}.png"), content) for path, content in now.items()]
    made = plan(known, sources)
    for content, found in made.encode.items():
        rows.setdefault(content, set()).update(map(str, found))
    for content, gained in made.gained.items():
        rows[content].update(gained)
    for content, lost in made.lost.items():
        rows[content].difference_update(lost)
    for path, content in now.items():
        assert [key for key, paths in rows.items() if f"{path}.png" in paths] == [content]
    again = plan([Known(key, tuple(paths)) for key, paths in rows.items() if paths], sources)
    assert again.n_unchanged == len(sources)
    assert [dict(again.encode), dict(again.gained), dict(again.lost)] == [{}, {}, {}]


def test_uploads_are_no_files_that_could_be_gone() -> None:
    """What came over the network lies nowhere, so following a folder does not drop it."""
    known = [Known("1", (f"{UPLOADED}9f/cat.obj",)), Known("2", ("gone.obj",))]
    assert dict(plan(known, [], prune=["."]).lost) == {"2": ("gone.obj",)}
