"""Bad input: one line on stderr that says what and where, exit status 2, nothing written."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from typer.testing import Result

import spem as package

Spem = Callable[..., Result]
Refused = Callable[..., None]


def _bad(tmp_path: Path, kind: str) -> Path:
    """Write a bad file."""
    path = tmp_path / {"typed": "bad.xyz", "text": "bad.png", "cut": "bad.png"}.get(kind, "bad.npy")
    if kind == "empty":
        path.write_bytes(b"")
    elif kind == "cut":
        Image.fromarray(np.random.default_rng(0).integers(0, 255, (64, 64), np.uint8)).save(path)
        path.write_bytes(path.read_bytes()[:500])
    elif kind in ("typed", "text"):
        path.write_text("hello")
    elif kind == "nan":
        np.save(path, np.full((6, 6, 6), np.nan))
    elif kind == "void":
        np.save(path, np.zeros((6, 6), bool))
    return path


@pytest.mark.parametrize("kind", ["missing", "empty", "cut", "typed", "text", "nan", "void"])
def test_bad_files(spem: Spem, refused: Refused, tmp_path: Path, kind: str) -> None:
    """Files that are missing, empty, cut short, of another kind, or hold no shape are refused by name."""
    path = _bad(tmp_path, kind)
    refused(spem("info", path), "bad")
    refused(spem("field", path, "--rho", "2", "-o", tmp_path / "f.npz"), "bad")
    assert not (tmp_path / "f.npz").exists()


def test_image_of_one_value(spem: Spem, refused: Refused, tmp_path: Path) -> None:
    """A blank picture holds no shape."""
    Image.new("L", (20, 20), 255).save(tmp_path / "blank.png")
    refused(spem("info", tmp_path / "blank.png"), "blank")


def test_mesh_without_an_interior_node(spem: Spem, refused: Refused, tmp_path: Path) -> None:
    """A mesh without volume is refused by name."""
    (tmp_path / "flat.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    refused(spem("info", tmp_path / "flat.obj"), "flat")


@pytest.mark.parametrize("rho", ["0", "-1", "nan"])
def test_bad_rho(spem: Spem, refused: Refused, image: Path, tmp_path: Path, rho: str) -> None:
    """Screening lengths that are not positive are refused."""
    refused(spem("field", image, f"--rho={rho}", "-o", tmp_path / "f.npz"), "rho", "positive")


@pytest.mark.parametrize(
    ("options", "word"),
    [
        (("--rho-min", "5", "--rho-max", "2"), "ascending"),
        (("--rho-min", "50"), "--rho-max is 5."),
        (("--rho-max", "0.1"), "--rho-min is 0.5"),
        (("--rho-max", "0"), "positive"),
        (("--n-maps", "9", "--n-rho", "4"), "n_maps=9"),
        (("--device", "cuda"), "--device cuda"),
        (("--voxels", "500", "--spacing", "1"), "exclude each other"),
        (("--label", "3"), "label"),
    ],
)
def test_bad_options(
    spem: Spem, refused: Refused, image: Path, tmp_path: Path, options: tuple[str, ...], word: str
) -> None:
    """Options out of range, or that do not go together, are named."""
    refused(spem("maps", image, *options, "-o", tmp_path / "m.npz"), word)


def test_unknown_label(spem: Spem, refused: Refused, tmp_path: Path) -> None:
    """A label that the volume does not have is refused."""
    np.save(tmp_path / "labels.npy", [[0, 3, 3, 0, 7], [0, 3, 3, 0, 7]])
    refused(spem("info", tmp_path / "labels.npy", "--label", "5"), "5", "3")


@pytest.mark.parametrize(
    ("target", "word"), [("file/f.npz", "folder cannot be made"), ("f.txt", ".npz"), ("d.npz", "is a folder")]
)
def test_targets_are_checked_first(
    spem: Spem, refused: Refused, tmp_path: Path, target: str, word: str
) -> None:
    """Output that cannot be written is refused before the shape is even read."""
    (tmp_path / "file").write_text("")
    (tmp_path / "d.npz").mkdir()
    refused(spem("field", "no-such-shape.png", "--rho", "2", "-o", tmp_path / target), word)


@pytest.mark.skipif(os.geteuid() == 0, reason="the superuser may write to every folder")
def test_folder_without_permission(spem: Spem, refused: Refused, image: Path, tmp_path: Path) -> None:
    """A folder that may not be written to is named."""
    (tmp_path / "locked").mkdir(mode=0o500)
    refused(spem("field", image, "--rho", "2", "-o", tmp_path / "locked" / "f.npz"), "no permission")


def test_nothing_to_write(spem: Spem, refused: Refused, image: Path) -> None:
    """`field` without a file to write is told so."""
    refused(spem("field", image, "--rho", "2"), "nothing to write")


def test_four_dimensions_cannot_be_drawn(spem: Spem, refused: Refused, tmp_path: Path) -> None:
    """A picture of a shape in four dimensions is refused before it is solved, with what to do."""
    np.save(tmp_path / "four.npy", np.pad(np.ones((3,) * 4, bool), 1))
    result = spem("field", tmp_path / "four.npy", "--rho", "2", "--plot", tmp_path / "p.png")
    refused(result, "4 dimensions", "leave out --plot")


@pytest.mark.parametrize(
    ("options", "word"),
    [
        (("--rho", "2", "--boundary", "foo"), "'--boundary': 'foo' is not one of 'surface', 'voxel'"),
        (("--rho", "4,x"), "--rho 4,x: expected numbers above zero, or inf"),
        (("--rho", "2", "--voxels", "0"), "Invalid value for '--voxels'"),
        (("--rho", "2", "--bogus"), "--bogus"),
        ((), "Missing option '--rho'"),
    ],
)
def test_wrong_usage_is_one_line(
    spem: Spem, refused: Refused, image: Path, tmp_path: Path, options: tuple[str, ...], word: str
) -> None:
    """What the parser refuses is told as any other error, on one line."""
    result = spem("field", image, "-o", tmp_path / "f.npz", *options)
    refused(result, word)
    assert "Input should" not in result.stderr


@pytest.mark.parametrize("name", ["none.png", "none.npy", "none.obj", "none.xyz"])
def test_missing_files_are_told_alike(spem: Spem, refused: Refused, tmp_path: Path, name: str) -> None:
    """A file that is not there is told in the same words whatever its kind."""
    refused(spem("info", tmp_path / name), f"{name}: no such file; check the path")
    refused(spem("evaluate", tmp_path / name, "--labels", "x.csv"), f"{name}: no such file")


def test_sources_that_are_no_files(spem: Spem, refused: Refused, image: Path, tmp_path: Path) -> None:
    """A folder, an empty name, Python objects and faces without their vertices are told as such."""
    refused(spem("info", tmp_path), "is a folder")
    refused(spem("info", ""), "empty name")
    refused(spem("encode", "", "-o", tmp_path / "c.spem"), "a path is empty")
    np.save(tmp_path / "objects.npy", np.array([{}], object), allow_pickle=True)
    refused(spem("info", tmp_path / "objects.npy"), "holds Python objects, which spem never loads")
    refused(spem("info", image, "--spacing", "0.0001"), "fewer --voxels or a larger --spacing")


@pytest.mark.parametrize("options", [(), ("--overwrite",)])
def test_codes_do_not_replace_an_image(
    spem: Spem, refused: Refused, image: Path, mesh: Path, tmp_path: Path, options: tuple[str, ...]
) -> None:
    """An image under the name of the codes is neither read as codes nor lost."""
    target = tmp_path / "hand.png"
    target.write_bytes(image.read_bytes())
    refused(spem("encode", mesh, "-o", target, *options), "hand.png: is an image, not spem codes")
    assert target.read_bytes() == image.read_bytes()


def test_unexpected_error_is_one_line(
    spem: Spem, refused: Refused, image: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """An error that nobody foresaw is named with its type; SPEM_DEBUG=1 gives the traceback."""
    monkeypatch.setattr("spem.shapes.read.read", lambda *_, **__: 1 / 0)
    refused(spem("info", image), "unexpected ZeroDivisionError", "please report")
    monkeypatch.setenv("SPEM_DEBUG", "1")
    assert "Traceback" in spem("info", image).stderr


def test_every_public_name_resolves() -> None:
    """`spem.__all__` is sorted and every name of it is there."""
    assert list(package.__all__) == sorted(package.__all__)
    for name in package.__all__:
        assert getattr(package, name) is not None


def test_an_interrupt_while_text_is_executed_ends_with_its_status(tmp_path: Path) -> None:
    """As while a dataclass is made: the status is 130, not death by the signal."""
    script = """
import signal, sys
from spem.cli.app import app, guarded

def command() -> None:
    exec("import signal; signal.raise_signal(signal.SIGINT)")

signal.signal(signal.SIGINT, signal.default_int_handler)
app.command("stop")(guarded(command))
sys.argv = ["spem", "stop"]
app()
"""
    (tmp_path / "stopped.py").write_text(script)
    command = [sys.executable, "-m", "stopped"]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == 130, done.stderr
    assert done.stderr == "spem: interrupted\n"
