"""Runs that keep what they made and go on where they stopped."""

from __future__ import annotations

import json
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest

from spem.errors import ParameterError, ShapeError
from spem.paper.catalogue import Item
from spem.paper.data import Data
from spem.paper.findings import Finding, Picture, Table, judged
from spem.paper.report import write_report
from spem.paper.runs import RECORD, load, load_all, plain, run
from spem.plots.style import new_figure


@dataclass(frozen=True)
class Counted(Item):
    """An item that counts how often it is made."""

    folder: Path = Path()

    @property
    def script(self) -> Path:
        """Return a script of this test's own."""
        return self.folder / f"{self.name}.py"

    def make(self, data: Data) -> Finding:
        """Count, and find a little of everything."""
        counter = self.folder / f"{self.name}.count"
        counter.write_text(counter.read_text() + "x" if counter.exists() else "x")
        if self.name == "broken":
            msg = "no node is left; use more voxels"
            raise ShapeError(msg)
        claims = (
            judged("1 < 2.", "yes", "<yes>", True, note=""),
            judged("3 < 2.", "yes", "no", False, note="& so"),
        )
        picture = Picture("plain", new_figure(1, 1), "A caption")
        table = Table("Numbers", ("a", "b"), (("1", "2"),))
        return Finding("none", claims, (picture,), tables=(table,), numbers={"x": np.array([1.0, np.inf])})


@pytest.fixture
def items(tmp_path):
    made = []
    for name in ("first", "second"):
        (tmp_path / f"{name}.py").write_text(f'"""\nTitle of {name}\n=====\n\nText.\n"""\n')
        made.append(Counted(name, "1", folder=tmp_path))
    return made


def times_made(item):
    return len((item.folder / f"{item.name}.count").read_text())


def test_what_is_made_can_be_read_again(items, tmp_path):
    """Claims, tables and numbers come back as they were, infinite numbers as a word."""
    (record, _) = run(items, Data(), tmp_path / "out")
    found = load(items[0], tmp_path / "out")
    assert found == record
    assert (found.title, found.shapes, found.failure) == ("Title of first", "none", "")
    assert [claim.verdict for claim in found.claims] == ["holds", "differs"]
    assert found.tables == (Table("Numbers", ("a", "b"), (("1", "2"),)),)
    assert found.numbers == {"x": [1.0, "inf"]}
    assert (found.folder / "plain.png").is_file()


def test_items_made_already_are_kept(items, tmp_path):
    """They are made once, unless asked for again."""
    kept = []
    for again in (False, False, True):
        run(items, Data(), tmp_path / "out", again=again, tell=lambda item, record, was: kept.append(was))
    assert kept == [False, False, True, True, False, False]
    assert [times_made(item) for item in items] == [2, 2]


def test_an_interrupted_run_goes_on(items, tmp_path):
    """What was whole before the interruption is kept, the rest is made."""

    class Stop(Exception):  # noqa: N818
        pass

    def stop(item, record, kept):
        raise Stop

    with pytest.raises(Stop):
        run(items, Data(), tmp_path / "out", tell=stop)
    run(items, Data(), tmp_path / "out")
    assert [times_made(item) for item in items] == [1, 1]


@pytest.mark.parametrize("change", ["size", "script", "picture", "record"])
def test_what_does_not_fit_any_more_is_made_again(items, tmp_path, change):
    """Another size, a changed script, a lost picture or a damaged record."""
    out, item = tmp_path / "out", items[0]
    run([item], Data(), out)
    if change == "script":
        item.script.write_text(item.script.read_text() + "# changed\n")
    elif change == "picture":
        (out / "first" / "plain.png").unlink()
    elif change == "record":
        record = out / "first" / RECORD
        record.write_text(record.read_text()[:50])
    run([item], Data(quick=change == "size"), out)
    assert times_made(item) == 2


@pytest.mark.parametrize(
    "change",
    [
        {"made": [1]},
        {"made": {"seconds": "long"}},
        {"made": {"seconds": None}},
        {"numbers": 3},
        {"claims": [{"statement": "1 < 2."}]},
        {"pictures": [{"file": 5, "caption": ""}]},
        {"pictures": [{"file": "../second/plain.png", "caption": ""}]},
    ],
)
def test_a_record_of_another_form_is_made_again(items, tmp_path, change):
    """Valid JSON of the wrong kind, or a picture from elsewhere."""
    out = tmp_path / "out"
    run(items, Data(), out)
    record = out / "first" / RECORD
    record.write_text(json.dumps(json.loads(record.read_text()) | change))
    assert load(items[0], out) is None
    run(items[:1], Data(), out)
    assert times_made(items[0]) == 2


@pytest.mark.parametrize("damage", ["[" * 100_000, "", "[]", "null", "\ud800"])
def test_a_record_that_is_none_is_made_again(items, tmp_path, damage):
    """Nested without end, empty, of another kind, or no text at all."""
    run(items[:1], Data(), tmp_path / "out")
    (tmp_path / "out" / "first" / RECORD).write_bytes(damage.encode("utf-8", "surrogatepass"))
    assert load(items[0], tmp_path / "out") is None


def test_a_damaged_picture_is_made_again(items, tmp_path):
    """A report needs all of it."""
    run(items[:1], Data(), tmp_path / "out")
    (tmp_path / "out" / "first" / "plain.png").write_bytes(b"")
    assert load(items[0], tmp_path / "out") is None


def test_another_collection_makes_it_again(items, tmp_path):
    """A record made without real shapes is not one made with them."""
    (tmp_path / "shapes" / "tari1000").mkdir(parents=True)
    run(items[:1], Data(), tmp_path / "out")
    run(items[:1], Data(tmp_path / "shapes"), tmp_path / "out")
    assert times_made(items[0]) == 2


def test_one_that_fails_does_not_stop_the_others(items, tmp_path):
    """Its record says why; it is tried again the next time."""
    (tmp_path / "broken.py").write_text('"""\nBroken\n======\n\nText.\n"""\n')
    broken = replace(items[0], name="broken")
    records = run([broken, items[1]], Data(), tmp_path / "out")
    assert [record.failure for record in records] == ["no node is left; use more voxels", ""]
    assert [record.item for record in load_all([broken, items[1]], tmp_path / "out")] == ["second"]


def test_a_folder_that_is_a_file_is_refused(items, tmp_path):
    """The message names it."""
    (tmp_path / "out").write_text("")
    with pytest.raises(ParameterError, match=r"out.first: cannot be written to"):
        run(items, Data(), tmp_path / "out")


def test_the_report_holds_everything_escaped(items, tmp_path):
    """Titles, pictures, tables and statements; what could not be made is told."""
    (tmp_path / "broken.py").write_text('"""\nBroken\n======\n\nText.\n"""\n')
    broken = replace(items[0], name="broken")
    records = run([*items, broken], Data(), tmp_path / "out")
    page = write_report(tmp_path / "index.html", records).read_text(encoding="utf-8")
    assert (
        "3 figures, tables and claims; of the statements judged: 2 hold, 2 differ; 1 could not be made"
        in page
    )
    assert page.count("data:image/png;base64,") == 2
    assert "&lt;yes&gt;" in page
    assert "<yes>" not in page
    assert "&amp; so" in page
    assert "no node is left" in page
    assert page.count("<h2>Title of") == 2


def test_plain_values_are_valid_json():
    """Whatever an experiment measures."""
    values = {"a": np.float32(1.5), 2: (np.nan, None, True), "path": Path("x")}
    assert json.dumps(plain(values)) == '{"a": 1.5, "2": ["nan", null, true], "path": "x"}'
