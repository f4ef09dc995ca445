"""Tests of rows as files."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np
import pytest

from spem.codes.codes import Codes
from spem.errors import ParameterError
from spem.index.index import Index


def test_csv_has_a_row_each_and_a_column_a_key(filled: Index, tmp_path: Path) -> None:
    """A table of text that any program reads, in order of name, without codes."""
    assert filled.export(tmp_path / "shapes.csv") == 4
    with (tmp_path / "shapes.csv").open(newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert [row["name"] for row in rows] == ["cat", "cow", "d'oh", "dog"]
    assert [row["metadata.site"] for row in rows] == ["Oslo", "", "", "Rome"]
    assert rows[0]["path"] == "/nowhere/cat.png"
    assert float(rows[0]["volume"]) == 3.0
    assert not any(key.startswith("code") for key in rows[0])


def test_codes_are_written_when_asked(filled: Index, tmp_path: Path) -> None:
    """CSV has a column for each number, Parquet a list; both are the codes of the index."""
    parquet = pytest.importorskip("pyarrow.parquet")
    filled.export(tmp_path / "shapes.csv", with_codes=True, where="label = 'cats'")
    filled.export(tmp_path / "shapes.parquet", with_codes=True, where="label = 'cats'")
    code = filled.get(filled.find(["/nowhere/cat.png"])[0]).code
    with (tmp_path / "shapes.csv").open(newline="", encoding="utf-8") as file:
        [row] = csv.DictReader(file)
    assert [float(row[f"code_{i}"]) for i in range(64)] == pytest.approx(code.tolist(), abs=1e-6)
    table = parquet.read_table(tmp_path / "shapes.parquet")
    assert table.column("code")[0].as_py() == code.tolist()
    assert table.column("name").to_pylist() == ["cat"]


def test_codes_files_hold_the_same_distances(filled: Index, tmp_path: Path) -> None:
    """What is exported for scores is the index's codes under its model, with volumes for the control."""
    assert filled.export(tmp_path / "shapes.spem") == 4
    codes = Codes.load(tmp_path / "shapes.spem")
    assert codes.names == ("cat", "cow", "d'oh", "dog")
    assert codes.model.digest == filled.digest()
    assert np.linalg.norm(codes.vectors, axis=1) == pytest.approx(1.0, abs=1e-6)
    assert np.array_equal(codes.vectors, filled.codes().vectors)
    assert codes.volumes.tolist() == [row.volume for row in filled.rows(sort="name")]


def test_what_cannot_be_written_is_refused(filled: Index, tmp_path: Path) -> None:
    """Another ending, a folder that is not there, and no row at all."""
    with pytest.raises(ParameterError, match=r"ends in .csv, .parquet, .spem"):
        filled.export(tmp_path / "shapes.xlsx")
    with pytest.raises(ParameterError, match="cannot be written"):
        filled.export(tmp_path / "nowhere" / "shapes.csv")
    with pytest.raises(ParameterError, match="there are no codes to write"):
        filled.export(tmp_path / "shapes.spem", where="volume > 100")
    assert filled.export(tmp_path / "none.csv", where="volume > 100") == 0
