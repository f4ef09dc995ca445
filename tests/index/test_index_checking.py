"""Tests of whether an index is whole."""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from spem.codes.model import Model
from spem.index.index import Index
from spem.index.row import Row, row_id
from spem.index.schema import to_table
from spem.index.updates import write


def test_a_whole_index_has_no_findings(filled: Index) -> None:
    """Nothing is wrong with what was written."""
    assert filled.check() == ()


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        ({"code": np.zeros(64, np.float32)}, "its code has length 0, not 1"),
        ({"code": np.full(64, np.nan, np.float32)}, "its code has length"),
        ({"hash": "f" * 64}, "its id is not that of its hash"),
        ({"shape": b"nonsense"}, "its packed shape is damaged"),
        ({"n_nodes": 5}, "its shape has 6 nodes, not 5"),
    ],
)
def test_damaged_rows_are_found_and_removed(
    filled: Index, tiny_model: Model, ready_row: Callable[..., Row], change: dict[str, object], reason: str
) -> None:
    """A row that is not what it says is found; repair removes it and leaves the others."""
    table = filled.store.table(tiny_model.digest)
    table.add(to_table([replace(ready_row("hen"), **change)], 64))  # type: ignore[arg-type]
    found = filled.check(repair=True)
    assert [finding.where for finding in found] == [ready_row("hen").id]
    assert reason in str(found[0])
    assert filled.check() == ()
    assert len(filled) == 4


def test_doubled_rows_are_found_and_one_stays(
    filled: Index, tiny_model: Model, ready_row: Callable[..., Row]
) -> None:
    """Of rows of one id repair keeps one, whole."""
    filled.store.table(tiny_model.digest).add(to_table([ready_row("cat")], 64))
    [finding] = filled.check(repair=True)
    assert "is there twice" in str(finding)
    assert filled.check() == ()
    assert filled.count("name = 'cat'") == 1


def test_a_damaged_model_is_found(filled: Index, tiny_model: Model) -> None:
    """The model's file is checked against its digest."""
    filled.store.database.open_table("models").update(values={"model": b"nonsense"})
    [finding] = filled.check()
    assert f"model {tiny_model.digest} is damaged" in str(finding)


def test_unreadable_data_are_a_finding(filled: Index) -> None:
    """A file of the database that is gone is told, not raised."""
    for file in Path(filled.store.address).glob("codes-*.lance/data/*.lance"):
        file.unlink()
    [finding] = Index.open(filled.store.address).check()
    assert "damaged" in finding.reason
    assert not finding.repairable


def test_files_are_looked_at_when_asked(
    tmp_path: Path, filled: Index, tiny_model: Model, ready_row: Callable[..., Row]
) -> None:
    """Files that are gone or changed are told; shapes that were no files are left out."""
    same, other = tmp_path / "same.png", tmp_path / "other.png"
    same.write_bytes(b"one")
    other.write_bytes(b"two")
    key = hashlib.sha256(b"one").hexdigest()
    row = replace(ready_row("hen"), id=row_id(key), hash=key, path=str(same), copies=(str(other), "a name"))
    filled.remove(where="volume > 0")
    write(filled.store, tiny_model.digest, [row])
    assert [str(finding) for finding in filled.check(files=True)] == [
        f"{other}: has changed since it was added; add it again"
    ]
    same.unlink()
    assert "no such file any more" in str(filled.check(files=True)[0])
