"""Small files of every kind, and the command line called in this process or in one of its own."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from typer.testing import CliRunner, Result

from spem.cli.app import app


@pytest.fixture
def spem() -> Callable[..., Result]:
    """Return a call of the command line in this process."""
    runner = CliRunner()
    return lambda *arguments: runner.invoke(app, [str(argument) for argument in arguments])


@pytest.fixture
def refused() -> Callable[..., None]:
    """Return a check for one line on stderr with the given words, and exit status 2."""

    def refused(result: Result, *words: str) -> None:
        assert result.exit_code == 2, result.output
        lines = result.stderr.strip().splitlines()
        assert len(lines) == 1, result.stderr
        assert lines[0].startswith("spem: ")
        for word in words:
            assert word in lines[0]

    return refused


@pytest.fixture
def start() -> Callable[..., subprocess.Popen[str]]:
    """Return a start of the command line in a process group of its own."""

    def start(*arguments: object) -> subprocess.Popen[str]:
        return subprocess.Popen(
            [sys.executable, "-m", "spem", *map(str, arguments)],
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            env=os.environ | {"OMP_NUM_THREADS": "1"},
            start_new_session=True,
        )

    return start


@pytest.fixture(scope="session")
def image(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a picture of a white ellipse on black."""
    path = tmp_path_factory.mktemp("image") / "ellipse.png"
    Image.fromarray(255 * ellipse(9, 14).astype(np.uint8)).save(path)
    return path


@pytest.fixture(scope="session")
def mesh(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a mesh of a box."""
    path = tmp_path_factory.mktemp("mesh") / "box.obj"
    corners = [(x, y, z) for x in (0, 2) for y in (0, 3) for z in (0, 4)]
    faces = ["1 2 4 3", "5 7 8 6", "1 5 6 2", "3 4 8 7", "1 3 7 5", "2 6 8 4"]
    lines = [f"v {x} {y} {z}" for x, y, z in corners] + [f"f {face}" for face in faces]
    path.write_text("\n".join(lines) + "\n")
    return path


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """Return a folder of nine shapes in three classes, with labels."""
    shapes = tmp_path / "shapes"
    shapes.mkdir()
    rows = ["file,label"]
    for kind, (a, b) in {"round": (11, 11), "long": (4, 15), "oval": (7, 14)}.items():
        for i in range(3):
            np.save(shapes / f"{kind}{i}.npy", ellipse(a, b - i))
            rows.append(f"{kind}{i}.npy,{kind}")
    (shapes / "labels.csv").write_text("\n".join(rows) + "\n")
    return shapes


@pytest.fixture
def codes(folder: Path, tmp_path: Path, spem: Callable[..., Result]) -> Path:
    """Return the codes of `folder`."""
    path = tmp_path / "codes.spem"
    assert spem("encode", folder, "-o", path, *QUICK).exit_code == 0
    return path


QUICK = ("--own-grid", "--features", "spem", "--n-maps", "3", "--n-centers", "4", "--n-rho", "16")


def ellipse(a: float, b: float, half: int = 18) -> np.ndarray:
    """Return the mask of an ellipse with semi-axes `a` and `b`."""
    y, x = np.mgrid[-half : half + 1, -half : half + 1]
    return (x / a) ** 2 + (y / b) ** 2 < 1
