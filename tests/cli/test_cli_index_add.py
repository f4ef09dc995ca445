"""``spem index add``: what it tells, its exit status, and interruptions."""

from __future__ import annotations

import json
import os
import signal
from collections.abc import Callable
from pathlib import Path
from subprocess import Popen

import numpy as np
import pytest
from typer.testing import Result

from spem.codes.codes import Codes

pytest.importorskip("lancedb")

QUICK = ("--own-grid", "--features", "spem", "--n-maps", "3", "--n-centers", "4", "--n-rho", "16")

Spem = Callable[..., Result]


def test_folder_is_added_and_kept_up_to_date(spem: Spem, folder: Path, tmp_path: Path) -> None:
    """The numbers of files that are new, changed, unchanged and gone are told on one line."""
    db = tmp_path / "shapes.db"
    first = spem("index", "add", db, folder, "--labels", folder / "labels.csv", "--meta", "site=Oslo", *QUICK)
    assert first.exit_code == 0, first.output
    assert first.stdout.startswith(f"{db}: 9 added; 9 shapes, model ")
    (folder / "round0.npy").unlink()
    np.save(folder / "round1.npy", np.ones((9, 13)))
    second = spem("index", "add", db, folder)
    assert ": 1 updated, 7 unchanged; 9 shapes" in second.stdout
    assert "1 file of" in second.stderr
    assert "--prune removes it" in second.stderr
    third = json.loads(spem("index", "add", db, folder, "--prune", "--json").stdout)
    assert {
        key: third[key] for key in ("added", "updated", "unchanged", "removed", "failed", "n_shapes")
    } == {
        "added": 0,
        "updated": 0,
        "unchanged": 8,
        "removed": 1,
        "failed": 0,
        "n_shapes": 8,
    }
    rows = json.loads(spem("index", "list", db, "--json").stdout)
    assert {row["label"] for row in rows} == {"round", "long", "oval", ""}
    assert sum(row["metadata"] == {"site": "Oslo"} for row in rows) == 7


def test_failures_have_a_line_each_and_a_status(spem: Spem, folder: Path, tmp_path: Path) -> None:
    """A shape that fails is told, and the status is that of a part."""
    (folder / "bad.obj").write_text("nothing")
    result = spem("index", "add", tmp_path / "db", folder, *QUICK)
    assert result.exit_code == 1
    [line] = result.stderr.strip().splitlines()
    assert "bad.obj" in line
    assert ": 9 added, 1 failed; 9 shapes" in result.stdout


def test_model_of_a_file_and_by_digest(spem: Spem, folder: Path, codes: Path, tmp_path: Path) -> None:
    """An index takes the model of a codes file; of several models one is named."""
    db = tmp_path / "db"
    made = spem("index", "add", db, folder, "--model", codes)
    digest = made.stdout.split()[-1]
    assert digest == Codes.load(codes).model.digest
    again = spem("index", "add", db, folder, "--model", digest)
    assert f"9 unchanged; 9 shapes, model {digest}" in again.stdout


def test_wrong_usage(spem: Spem, refused: Callable[..., None], folder: Path, tmp_path: Path) -> None:
    """What cannot be meant is refused on one line."""
    db = tmp_path / "db"
    refused(spem("index", "add", db, folder, "--voxels", 5, "--own-grid"), "--own-grid", "exclude each other")
    refused(spem("index", "add", db, folder, "--meta", "site"), "--meta site: expected KEY=VALUE")
    refused(spem("index", "add", db, tmp_path / "no*.obj"), "no file fits this pattern")
    refused(spem("index", "add", db, folder, "--cluster", "head"), "expected the address of a Dask scheduler")
    assert spem("index", "add", db, folder, *QUICK).exit_code == 0
    refused(
        spem("index", "add", db, folder, "--n-maps", "5"), "n_maps=5: model", "has n_maps=3; leave it out"
    )
    refused(spem("index", "add", db, folder, "--model", "0" * 12), "0" * 12)


def test_interrupted_addition_tells_how_to_go_on(
    start: Callable[..., Popen[str]], spem: Spem, folder: Path, tmp_path: Path
) -> None:
    """Ctrl-C ends with one line and status 130, and the same command finishes."""
    for i in range(60):
        np.save(folder / f"many{i}.npy", np.ones((30 + i, 40)))
    process = start("index", "add", tmp_path / "db", folder, "-j", "1", *QUICK)
    while not list((tmp_path / "db").rglob("*.drafts.work")):
        assert process.poll() is None
    os.killpg(process.pid, signal.SIGINT)
    _, stderr = process.communicate(timeout=60)
    assert process.returncode == 130
    assert "give the same command again to go on" in stderr.strip().splitlines()[-1]
    for file in folder.glob("many*"):
        file.unlink()
    assert spem("index", "add", tmp_path / "db", folder, "-j", "1", *QUICK).exit_code == 0
