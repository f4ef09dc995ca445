"""Codes of several kinds of features from the command line: what is taken, kept, refused and told."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import trimesh
from typer.testing import Result

from spem.codes.codes import Codes

Spem = Callable[..., Result]
QUICK = ("--voxels", "400", "--n-maps", "3", "--n-centers", "4", "--n-rho", "16")


@pytest.fixture(scope="module")
def meshes(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder of three boxes and three capsules, with their labels."""
    folder = tmp_path_factory.mktemp("meshes")
    made = {
        f"{kind}{i}": mesh
        for i in range(3)
        for kind, mesh in {
            "box": trimesh.creation.box((4 + i, 5, 7)).subdivide().subdivide(),
            "rod": trimesh.creation.capsule(height=8 + i, radius=1.5, count=[12, 12]),
        }.items()
    }
    for name, mesh in made.items():
        mesh.export(folder / f"{name}.off")
    (folder / "labels.csv").write_text("file,label\n" + "".join(f"{name}.off,{name[:3]}\n" for name in made))
    return folder


@pytest.fixture(scope="module")
def joined(meshes: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return codes of the meshes as they come when no kind is named."""
    from typer.testing import CliRunner

    from spem.cli.app import app

    target = tmp_path_factory.mktemp("codes") / "joined.spem"
    told = CliRunner().invoke(app, ["encode", str(meshes), "-o", str(target), *QUICK])
    assert told.exit_code == 0, told.output
    return target


def test_meshes_get_codes_of_volume_and_surface(spem: Spem, meshes: Path, joined: Path) -> None:
    """Without being asked; the file names the kinds, and shapes find their like."""
    model = Codes.load(joined).model
    assert model.settings.features == "spem+surface-wks"
    assert (model.ndim, len(model.weights)) == (3, 2)
    answers = json.loads(spem("search", joined, meshes / "rod1.off", "-k", "3", "--json").stdout)
    assert {answer["name"][:3] for answer in answers} == {"rod"}


def test_codes_are_added_to_under_any_name_of_their_features(
    spem: Spem, meshes: Path, joined: Path, tmp_path: Path, refused: Callable[..., None]
) -> None:
    """Both "auto" and "spem+surface" are what the file has; maps alone are not."""
    target = tmp_path / "codes.spem"
    target.write_bytes(joined.read_bytes())
    for features in ("auto", "spem+surface", "spem+surface-wks"):
        assert spem("encode", meshes, "-o", target, "--features", features).exit_code == 0
    told = spem("encode", meshes, "-o", target, "--features", "spem")
    refused(told, "features=spem", "has features=spem+surface-wks", "write another file")


def test_surfaces_are_of_solids(
    spem: Spem, joined: Path, tmp_path: Path, refused: Callable[..., None]
) -> None:
    """A silhouette asked of codes of solids, and a surface of four dimensions, are refused in one line."""
    np.save(tmp_path / "square.npy", np.ones((9, 9)))
    refused(spem("search", joined, tmp_path / "square.npy"), "a 2-D shape", "3-D ones")
    rng = np.random.default_rng(0)
    for name in "ab":
        np.save(tmp_path / f"{name}.npy", rng.random((7, 7, 7, 7)) < 0.99)
    four = [tmp_path / f"{name}.npy" for name in "ab"]
    told = spem("encode", *four, "-o", tmp_path / "four.spem", "--features", "surface", "--own-grid")
    assert told.exit_code == 2
    assert "features 'surface' are of 2-D or 3-D shapes, not of 4-D ones; take features 'spem'" in told.stderr
    options = ("--own-grid", "--n-maps", "3", "--n-centers", "4", "--n-rho", "16")
    assert spem("encode", *four, "-o", tmp_path / "four.spem", *options).exit_code == 0
    assert Codes.load(tmp_path / "four.spem").model.settings.features == "spem"


def test_unknown_features_are_refused_before_any_work(
    spem: Spem, meshes: Path, tmp_path: Path, refused: Callable[..., None]
) -> None:
    """The line names what there is."""
    told = spem("encode", meshes, "-o", tmp_path / "x.spem", "--features", "spem+curvature")
    refused(told, "features='spem+curvature'", "surface-wks")


def test_scores_after_diffusion_come_apart(spem: Spem, meshes: Path, joined: Path) -> None:
    """They have a row of their own, and those before stay what they are."""
    plain = ("evaluate", joined, "--labels", meshes / "labels.csv")
    before, both = spem(*plain), spem(*plain, "--rerank")
    assert both.exit_code == 0, both.stderr
    plain_rows, rows = ([line.split() for line in told.stdout.splitlines()] for told in (before, both))
    assert rows[: len(plain_rows)] == plain_rows
    assert rows[-1][:3] == ["codes,", "diffusion", "re-ranked"]
    facts = json.loads(spem(*plain, "--rerank", "--json", "-").stdout)
    assert set(facts["after_diffusion"]) == {"NN", "FT", "ST", "E", "DCG", "bulls_eye"}
    assert facts["NN"] == json.loads(spem(*plain, "--json", "-").stdout)["NN"]


def test_info_says_what_the_surface_is(spem: Spem, meshes: Path, tmp_path: Path) -> None:
    """The mesh where it is sound, else where it was taken from; silhouettes have none."""
    told = json.loads(spem("info", meshes / "box0.off", *QUICK[:2], "--json").stdout)["surface"]
    assert told == "its mesh: 98 vertices, 192 faces"
    two = trimesh.util.concatenate(
        [trimesh.creation.icosphere(2), trimesh.creation.icosphere(2).apply_translation([0.9, 0, 0])]
    )
    two.export(tmp_path / "two.off")
    told = json.loads(spem("info", tmp_path / "two.off", "--voxels", "2000", "--json").stdout)["surface"]
    assert told.startswith("remeshed from the filled volume: 2 parts of the mesh bound it: ")
    np.save(tmp_path / "square.npy", np.ones((9, 9)))
    assert json.loads(spem("info", tmp_path / "square.npy", "--json").stdout)["surface"] is None
