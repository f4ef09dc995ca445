"""Tests of ``spem index``: list, label, remove, export, check; other commands have tests of their own."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from typer.testing import Result

from spem.codes.model import Model
from spem.codes.settings import Settings
from spem.index.index import Index
from spem.index.row import Row, row_id
from spem.index.schema import to_table
from spem.index.updates import write

Command = Callable[..., Result]


@pytest.fixture
def db(tmp_path: Path) -> Path:
    """Return the folder of an index of three rows."""
    rng = np.random.default_rng(0)
    settings = Settings(features="spem", n_maps=2, n_centers=4)
    model = Model.fit(settings, [(rng.random((50, 2)),) for _ in range(3)], ndim=2)
    index = Index.open(tmp_path / "shapes.db")
    index.store.save_model(model)
    write(index.store, model.digest, [_row(name) for name in ("cat", "cow", "dog")])
    return tmp_path / "shapes.db"


def _row(name: str) -> Row:
    """Return a row of one content for each name."""
    key = hashlib.sha256(name.encode()).hexdigest()
    code = np.random.default_rng(int(key[:8], 16)).standard_normal(64).astype(np.float32)
    return Row(row_id(key), key, name, f"/nowhere/{name}.png", code, volume=float(ord(name[1])))


def test_list_tells_the_rows(spem: Command, db: Path) -> None:
    """A line each in order, with what is left out told; JSON has all that is known."""
    listed = spem("index", "list", db, "--sort", "volume", "--limit", "2")
    assert [line.split()[0] for line in listed.stdout.splitlines()] == ["name", "cat", "cow"]
    assert "2 of 3 shapes; --limit 0 lists all" in listed.stderr
    rows = json.loads(spem("index", "list", db, "--where", "name = 'cow'", "--json").stdout)
    assert [(row["name"], row["copies"], row["metadata"]) for row in rows] == [("cow", [], {})]


def test_list_tells_the_models(spem: Command, db: Path) -> None:
    """Digest, features, length of codes, number of shapes."""
    [model] = json.loads(spem("index", "list", db, "--models", "--json").stdout)
    assert (model["features"], model["ndim"], model["n_code"], model["n_shapes"]) == ("spem", 2, 64, 3)
    assert model["digest"] in spem("index", "list", db, "--models").stdout


def test_label_takes_a_file_or_a_filter(spem: Command, db: Path, tmp_path: Path) -> None:
    """Labels that fit nothing are told, metadata found by filters."""
    (tmp_path / "labels.csv").write_text("file,label\ncat.png,cats\nhen.png,birds\n")
    done = spem("index", "label", db, tmp_path / "labels.csv")
    assert done.stdout == "changed 1 shape\n"
    assert "1 label without a shape, such as hen.png" in done.stderr
    spem("index", "label", db, "--where", "name <> 'cat'", "--as", "others", "--meta", "site=Oslo")
    listed = spem("index", "list", db, "--where", "metadata.site = 'Oslo'", "--json")
    assert {row["label"] for row in json.loads(listed.stdout)} == {"others"}


def test_label_asks_for_one_of_both(spem: Command, refused: Callable[..., None], db: Path) -> None:
    """Neither a file nor a label, and metadata without a value, are refused."""
    refused(spem("index", "label", db), "give a FILE of labels, or --as or --meta")
    refused(spem("index", "label", db, "--meta", "site"), "expected KEY=VALUE")


def test_remove_takes_ids_paths_or_a_filter(spem: Command, refused: Callable[..., None], db: Path) -> None:
    """What is removed is counted; what is not there is refused."""
    assert spem("index", "remove", db, _row("cat").id, "/nowhere/cow.png").stdout == "removed 2 shapes\n"
    assert spem("index", "remove", db, "--where", "volume > 0").stdout == "removed 1 shape\n"
    refused(spem("index", "remove", db, "cat.png"), "cat.png: neither id nor path")
    refused(spem("index", "remove", db), "give the ids or paths of shapes, or --where")


def test_remove_takes_a_model_with_its_shapes(spem: Command, refused: Callable[..., None], db: Path) -> None:
    """All shapes go only where the model is named."""
    refused(spem("index", "remove", db, "--all"), "--model with --all")
    [model] = Index.open(db).models()
    assert spem("index", "remove", db, "--model", model.digest, "--all").stdout == "removed 3 shapes\n"
    assert Index.open(db).models() == ()


def test_export_writes_what_evaluate_takes(spem: Command, refused: Callable[..., None], db: Path) -> None:
    """Tables, and codes that other commands read."""
    assert spem("index", "export", db, db.parent / "shapes.csv").stdout.endswith("shapes.csv: 3 shapes\n")
    spem("index", "export", db, db.parent / "shapes.spem", "--where", "name <> 'dog'")
    (db.parent / "labels.csv").write_text("file,label\ncat.png,one\ncow.png,one\n")
    scores = spem("evaluate", db.parent / "shapes.spem", "--labels", db.parent / "labels.csv", "--json", "-")
    assert json.loads(scores.stdout)["n_shapes"] == 2
    refused(spem("index", "export", db, "shapes.xlsx"), "ends in .csv, .parquet, .spem")


def test_check_fails_where_something_is_wrong(spem: Command, db: Path) -> None:
    """A line each finding and status 1; after repair nothing is wrong."""
    assert spem("index", "check", db).stdout == "3 shapes of 1 model: nothing is wrong\n"
    index = Index.open(db)
    index.store.table(index.digest()).add(to_table([_row("cat")], 64))
    found = spem("index", "check", db, "--repair")
    assert found.exit_code == 1
    assert found.stdout.splitlines()[0].startswith(f"{_row('cat').id}: is there twice")
    assert spem("index", "check", db).exit_code == 0
    assert spem("index", "check", db, "--files").stdout.count("no such file any more") == 3


def test_what_is_no_index_is_refused(
    spem: Command, refused: Callable[..., None], tmp_path: Path, db: Path
) -> None:
    """Nothing there, a file, a folder of other things, a filter without meaning: one line each."""
    refused(spem("index", "list", tmp_path / "none"), "no index there; make one with: spem index add")
    refused(spem("index", "list", tmp_path), "a folder of other things (shapes.db)")
    refused(spem("index", "list", db, "--where", "colour = 1"), "no filter of rows")
    refused(spem("index", "list", db, "--model", "abc"), "model abc is none of")
    assert not (tmp_path / "none").exists()


def test_evaluate_takes_the_labels_of_an_index(spem: Command, db: Path, tmp_path: Path) -> None:
    """An index is scored by its own labels or a file's; unlabelled shapes are left out when asked."""
    refused = spem("evaluate", db)
    assert refused.exit_code == 2
    assert "3 shapes without a label" in refused.stderr
    spem("index", "label", db, "--where", "name LIKE 'c%'", "--as", "c")
    told = spem("evaluate", db, "--ignore-unlabelled", "--json", "-")
    assert told.exit_code == 0, told.stderr
    facts = json.loads(told.stdout)
    assert (facts["n_shapes"], facts["n_classes"], facts["NN"]) == (2, 1, 100.0)
    assert "size_alone" in facts
    labels = tmp_path / "labels.csv"
    labels.write_text("cat.png,a\ncow.png,a\ndog.png,b\n")
    assert json.loads(spem("evaluate", db, "--labels", labels, "--json", "-").stdout)["n_shapes"] == 3


def test_codes_need_a_file_of_labels(spem: Command, tmp_path: Path) -> None:
    """A file of codes knows no labels."""
    refused = spem("evaluate", tmp_path / "codes.spem")
    assert refused.exit_code == 2
    assert "needs --labels" in refused.stderr


def test_names_keep_to_their_line(spem: Command, db: Path) -> None:
    """What a terminal obeys is shown as an escape."""
    index = Index.open(db)
    key = hashlib.sha256(b"evil").hexdigest()
    code = np.random.default_rng(0).standard_normal(64).astype(np.float32)
    write(index.store, index.digest(), [Row(row_id(key), key, "a\n\x1b[31mb", "/nowhere/a.png", code)])
    lines = spem("index", "list", db).stdout.splitlines()
    assert len(lines) == 5
    assert any(line.startswith("a\\n\\x1b[31mb ") for line in lines)
