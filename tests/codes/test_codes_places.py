"""Paths in codes files."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from spem.codes.codes import Codes
from spem.codes.collection import encode_collection
from spem.codes.places import found_path, stored_path
from spem.codes.settings import Settings


def test_relative_paths_are_found_from_everywhere(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Codes and shapes that are moved together, or read from another folder, stay together."""
    (tmp_path / "old" / "shapes").mkdir(parents=True)
    (tmp_path / "old" / "out").mkdir()
    monkeypatch.chdir(tmp_path / "old")
    for n in (6, 9):
        np.save(f"shapes/{n}.npy", np.ones((n, n), bool))
    given = ("shapes/6.npy", "shapes/9.npy", "shapes/gone.npy")
    codes = encode_collection(given, Settings(features="spem", voxels=None, n_maps=2, n_centers=4))
    codes.save("out/c.spem")
    again = Codes.load("out/c.spem")
    assert again.paths == given[:2]
    assert again.failures[0].path == given[2]
    monkeypatch.chdir(tmp_path)
    (tmp_path / "old").rename(tmp_path / "new")
    moved = Codes.load(tmp_path / "new" / "out" / "c.spem")
    assert moved.paths == ("new/shapes/6.npy", "new/shapes/9.npy")
    monkeypatch.chdir(tmp_path / "new" / "out")
    assert Codes.load("c.spem").paths == tuple(str(tmp_path / "new" / path) for path in given[:2])


@pytest.mark.parametrize("path", ["disk", "/data/hand.png", "star 5/2"])
def test_names_and_absolute_paths_stay(path: str, tmp_path: Path) -> None:
    """What is no relative path of a file is left as it is."""
    assert stored_path(path, tmp_path) == found_path(path, tmp_path) == path
