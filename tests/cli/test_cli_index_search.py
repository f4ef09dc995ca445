"""Tests of ``spem search`` of an index, ``spem index optimize`` and ``spem index duplicates``."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from typer.testing import Result

from spem.index.index import Index
from spem.index.row import Row
from spem.index.updates import write

Command = Callable[..., Result]
Refused = Callable[..., None]
QUICK = {"features": "spem", "voxels": None, "n_maps": 2, "n_centers": 4, "n_rho": 8}


@pytest.fixture
def db(folder: Path, tmp_path: Path) -> Path:
    """Return an index of nine shapes in three classes."""
    index = Index.open(tmp_path / "shapes.db")
    index.add(folder, labels=folder / "labels.csv", **QUICK)
    return tmp_path / "shapes.db"


def test_search_of_an_index_by_file_name_and_id(spem: Command, db: Path, folder: Path) -> None:
    """The same answers whatever names the query; how they were found stands below them, or in the JSON."""
    told = spem("search", db, folder / "long1.npy", "-k", "3").stdout.splitlines()
    assert told[0].split() == ["rank", "distance", "name", "label", "id", "path"]
    assert told[1].split()[1:4] == ["0.0000", "long1", "long"]
    assert (len(told), told[-1]) == (5, "exact")
    by_name = json.loads(spem("search", db, "long1", "-k", "3", "--json").stdout)
    assert by_name["method"] == "exact"
    assert by_name["recall"] is None
    assert [one["label"] for one in by_name["answers"]] == ["long"] * 3
    by_id = json.loads(spem("search", db, by_name["answers"][0]["id"], "-k", "3", "--json").stdout)
    assert by_id == by_name


def test_search_by_a_file_that_is_new(spem: Command, db: Path, tmp_path: Path) -> None:
    """A file that the index has not is encoded with its model."""
    y, x = np.mgrid[-18:19, -18:19]
    np.save(tmp_path / "new.npy", (x / 11) ** 2 + (y / 11.5) ** 2 < 1)
    answers = json.loads(spem("search", db, tmp_path / "new.npy", "--json").stdout)["answers"]
    assert answers[0]["label"] == "round"
    assert answers[0]["distance"] > 0


def test_filters_sizes_and_reranking(spem: Command, db: Path) -> None:
    """Filters and sizes leave rows out; re-ranking is named."""
    some = json.loads(spem("search", db, "long1", "--where", "label <> 'long'", "--json").stdout)
    assert len(some["answers"]) == 6
    near = json.loads(spem("search", db, "long1", "--matched-size", "1.2", "--json").stdout)
    volumes = [one["volume"] for one in near["answers"]]
    assert max(volumes) <= 1.2 * volumes[0]
    assert min(volumes) >= volumes[0] / 1.2
    assert spem("search", db, "long1", "--rerank").stdout.splitlines()[-1] == "exact, diffusion re-ranked"


def test_what_search_refuses(spem: Command, refused: Refused, db: Path, codes: Path, tmp_path: Path) -> None:
    """Wrong filters, names and models are told on a line, and so are options that codes have not."""
    refused(spem("search", db, "nobody"), "nobody: no such file, and no shape of the index")
    refused(spem("search", db, "long1", "--where", "lable = 3"), "no filter of rows")
    refused(spem("search", db, "long1", "--model", "0123"), "model 0123 is none of")
    refused(spem("search", db, "long1", "--approximate"), "spem index optimize", "--approximate")
    refused(spem("search", tmp_path / "shapes", "long1"), "not an index")
    refused(spem("search", codes, "long1", "--rerank"), "--rerank", "is a file of codes")
    refused(spem("search", codes, "long1", "--exact"), "--exact", "is a file of codes")


def test_optimize_tells_sizes_and_recall(spem: Command, refused: Refused, db: Path) -> None:
    """Without an approximate index search is exact; a small index is refused one."""
    told = spem("index", "optimize", db, "--older-than", "0s").stdout.splitlines()
    assert told[0].split() == ["model", "shapes", "MB", "search", "recall", "seconds"]
    assert told[1].split()[1] == "9"
    assert "exact" in told[1]
    assert len(Index.open(db)) == 9
    refused(spem("index", "optimize", db, "--approximate"), "9 codes, an approximate index needs 256")
    refused(spem("index", "optimize", db, "--older-than", "soon"), "--older-than soon: expected a number")


def test_optimize_makes_an_approximate_index(spem: Command, db: Path) -> None:
    """What was built is told, and search says which way it went and how much it finds."""
    index = Index.open(db)
    rng, digest = np.random.default_rng(0), index.digest()
    codes = rng.standard_normal((300, index.model().n_code)).astype(np.float32)
    rows = [Row(f"{i:020x}", f"{i:064x}", f"made {i}", f"made {i}", code) for i, code in enumerate(codes)]
    write(index.store, digest, rows)
    [done] = json.loads(spem("index", "optimize", db, "--approximate", "--json").stdout)
    assert done["n_rows"] == 309
    assert done["approximate"]["recall"] > 0.9
    found = json.loads(spem("search", db, "made 7", "--approximate", "--json").stdout)
    assert (found["method"], found["recall"]) == ("approximate", done["approximate"]["recall"])
    assert found["answers"][0]["name"] == "made 7"
    assert spem("search", db, "made 7", "--approximate").stdout.splitlines()[-1].startswith("approximate (")


def test_duplicates_lists_groups_and_copies(spem: Command, refused: Refused, db: Path, folder: Path) -> None:
    """Near ones are grouped; files of equal bytes are named with all their paths."""
    (folder / "again.npy").write_bytes((folder / "oval0.npy").read_bytes())
    index = Index.open(db)
    index.add(folder)
    like = index.get(index.search("long0", 1)[0].row.id)
    other = replace(like, id="9" * 20, hash="9" * 64, name="nearly", path="nearly")
    write(index.store, index.digest(), [other])
    told = spem("index", "duplicates", db, "--distance", "0.0001").stdout.splitlines()
    assert told[0] == "group 1: 2 shapes, diameter 0.0000"
    assert told[-2].startswith("copies: ")
    assert "again.npy" in told[-2]
    assert told[-1] == "1 group within 0.0001, exact; 1 file with copies"
    plain = json.loads(spem("index", "duplicates", db, "--distance", "0.0001", "--json").stdout)
    assert len(plain["groups"][0]["shapes"]) == 2
    assert len(plain["copies"][0]["paths"]) == 2
    refused(
        spem("index", "duplicates", db, "--distance", "2"), "distance=2.0: expected a correlation distance"
    )
