"""info, field and maps: what they print, what they write, and that it fits the equation."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import nibabel
import numpy as np
import pytest
from typer.testing import Result

Spem = Callable[..., Result]


def test_info_tells_what_was_read(spem: Spem, image: Path) -> None:
    """`info` prints the facts about a shape for people, and the same as JSON."""
    facts = json.loads(spem("info", image, "--json").stdout)
    text = spem("info", image).stdout
    assert facts["dimensions"] == 2
    assert facts["spacing"] == [1.0, 1.0]
    assert f"{facts['voxels']}" in text
    assert set(facts) >= {"name", "method", "components", "repairs", "watertight", "volume", "default_rho"}


def test_repairs_are_told(spem: Spem, tmp_path: Path) -> None:
    """A dropped speck is told among the facts, and on stderr where a field is made of the rest."""
    mask = np.zeros((9, 9), bool)
    mask[1:5, 1:5], mask[7, 7] = True, True
    np.save(tmp_path / "speck.npy", mask)
    facts = json.loads(spem("info", tmp_path / "speck.npy", "--json").stdout)
    assert "kept the largest of 2 components" in facts["repairs"][0]
    result = spem("field", tmp_path / "speck.npy", "--rho", "2", "-o", tmp_path / "f.npz")
    assert "speck.npy: kept the largest of 2 components" in result.stderr
    kept = spem("info", tmp_path / "speck.npy", "--json", "--components", "all")
    assert json.loads(kept.stdout)["voxels"] == 17


def test_field_writes_points_and_values(spem: Spem, image: Path, tmp_path: Path) -> None:
    """`field` writes one row a node and one column a ρ, on the image's own grid; inf gives one everywhere."""
    target = tmp_path / "new" / "f.npz"
    result = spem("field", image, "--rho", "2,4", "--rho", "inf", "-o", target, "--json")
    assert result.exit_code == 0, result.stderr
    with np.load(target) as found:
        assert set(found) == {"points", "values", "rho", "spacing", "origin", "name", "boundary"}
        assert (str(found["name"]), str(found["boundary"])) == ("ellipse", "surface")
        index = (found["points"] - found["origin"]) / found["spacing"]
        np.testing.assert_array_equal(index.min(axis=0), [1, 1])
        assert found["points"].shape == (found["values"].shape[0], 2)
        np.testing.assert_array_equal(found["rho"], [2, 4, np.inf])
        assert found["values"].shape[1] == 3
        assert 0 < found["values"][:, 0].min() < found["values"][:, 0].max() < 1
        np.testing.assert_allclose(found["values"][:, 2], 1, atol=1e-9)
        np.testing.assert_array_equal(found["points"] % 1, 0)
    summary = json.loads(result.stdout)
    assert summary["rho"] == [2.0, 4.0, "inf"]
    assert summary["output"] == str(target)


def test_affine_of_a_scan_is_in_the_file(spem: Spem, tmp_path: Path) -> None:
    """Points of a scan stay index times spacing; the affine beside them takes indices to the world."""
    affine = np.array([[0.0, 2, 0, 7], [-1, 0, 0, 5], [0, 0, 3, 1], [0, 0, 0, 1]])
    nibabel.save(nibabel.Nifti1Image(np.pad(np.ones((5, 6, 7), np.uint8), 2), affine), tmp_path / "s.nii")
    assert spem("field", tmp_path / "s.nii", "--rho", "3", "-o", tmp_path / "f.npz").exit_code == 0
    with np.load(tmp_path / "f.npz") as found:
        np.testing.assert_allclose(found["affine"], affine)
        np.testing.assert_allclose(found["spacing"], [1, 2, 3])
        np.testing.assert_allclose(found["points"].min(axis=0), [2, 4, 6])


def test_field_of_a_mesh_takes_the_voxel_budget(spem: Spem, mesh: Path, tmp_path: Path) -> None:
    """A mesh has about as many voxels as asked for, in the mesh's own coordinates."""
    result = spem("field", mesh, "--rho", "0.5", "--voxels", "3000", "-o", tmp_path / "f.npz")
    assert result.exit_code == 0, result.stderr
    with np.load(tmp_path / "f.npz") as found:
        assert 2700 < len(found["points"]) < 3300
        assert (found["points"] > 0).all()
        assert (found["points"] < [2, 3, 4]).all()


def test_spacing_of_the_grid_is_declared(spem: Spem, image: Path, mesh: Path, tmp_path: Path) -> None:
    """--grid-spacing says what a file does not, and `info` where the spacing came from."""
    np.save(tmp_path / "box.npy", np.ones((3, 4, 5), bool))
    facts = json.loads(spem("info", tmp_path / "box.npy", "--grid-spacing", "2,1,0.5", "--json").stdout)
    assert (facts["spacing"], facts["voxels"], facts["volume"]) == ([2.0, 1.0, 0.5], 60, 60.0)
    assert facts["spacing_from"] == "spacing as given"
    facts = json.loads(spem("info", image, "--grid-spacing", "2", "--spacing", "1", "--json").stdout)
    assert facts["spacing_from"] == "resampled from spacing 2 x 2 to 1 x 1"
    assert json.loads(spem("info", image, "--json").stdout)["spacing_from"] == "none in the file, 1 taken"
    assert json.loads(spem("info", mesh, "--json").stdout)["spacing_from"] == "the grid asked for"
    assert "does not apply to a mesh" in spem("info", mesh, "--grid-spacing", "2").stderr
    assert "--grid-spacing 2;1: expected" in spem("info", image, "--grid-spacing", "2;1").stderr


@pytest.mark.parametrize("grid", [("--spacing", "0.2"), ("--inner-radius", "6")])
def test_grid_options(spem: Spem, mesh: Path, grid: tuple[str, str]) -> None:
    """The spacing and the inner radius choose the grid."""
    facts = json.loads(spem("info", mesh, "--json", *grid).stdout)
    spacing = 0.2 if grid[0] == "--spacing" else 1 / 6
    assert facts["spacing"] == pytest.approx([spacing] * 3, rel=0.1)


def test_what_is_done_unasked_is_told(spem: Spem, image: Path, tmp_path: Path) -> None:
    """Labels that are taken together are told with the way to take one; resampling as asked is a note."""
    np.save(tmp_path / "labels.npy", np.kron([[0, 1, 2, 5, 0]], np.ones((4, 4), int)))
    result = spem("field", tmp_path / "labels.npy", "--rho", "2", "-o", tmp_path / "f.npz")
    assert "labels.npy: 3 labels together: 1, 2, 5; --label takes one of them" in result.stderr
    result = spem("field", image, "--rho", "2", "--spacing", "0.8", "-o", tmp_path / "f.npz")
    assert "ellipse.png: note: resampled from spacing 1 x 1 to 0.8 x 0.8" in result.stderr


def test_boundary_voxel_lowers_the_field(spem: Spem, image: Path, tmp_path: Path) -> None:
    """With v = 1 on the voxels outside, the boundary is farther off."""
    for boundary in ("surface", "voxel"):
        target = tmp_path / f"{boundary}.npz"
        assert spem("field", image, "--rho", "3", "--boundary", boundary, "-o", target).exit_code == 0
    with np.load(tmp_path / "surface.npz") as near, np.load(tmp_path / "voxel.npz") as far:
        assert (far["values"] < near["values"]).all()


def test_maps_write_basis_and_variance(spem: Spem, image: Path, tmp_path: Path) -> None:
    """`maps` writes maps, an orthonormal basis and variances that fit each other."""
    target = tmp_path / "m.npz"
    options = ("--n-maps", "3", "--rho-min", "1", "--rho-max", "8", "--n-rho", "20", "--rho-scheme", "log")
    result = spem("maps", image, *options, "--device", "cpu", "-o", target, "--json")
    assert result.exit_code == 0, result.stderr
    with np.load(target) as found:
        own = {"maps", "basis", "variance", "explained"}
        assert set(found) == own | {"points", "rho", "spacing", "origin", "name", "boundary"}
        assert found["maps"].shape == (len(found["points"]), 3)
        np.testing.assert_allclose(found["basis"].T @ found["basis"], np.eye(3), atol=1e-9)
        np.testing.assert_allclose((found["maps"] ** 2).mean(axis=0), found["variance"], rtol=1e-3)
        np.testing.assert_allclose(found["rho"], np.geomspace(1, 8, 20))
    assert json.loads(result.stdout)["n_maps"] == 3


@pytest.mark.parametrize("command", [("field", "--rho", "3"), ("maps", "--n-maps", "2")])
def test_pictures_need_no_arrays(spem: Spem, image: Path, tmp_path: Path, command: tuple[str, ...]) -> None:
    """A picture is written alone when no array file is asked for."""
    result = spem(command[0], image, *command[1:], "--plot", tmp_path / "p.png")
    assert result.exit_code == 0, result.stderr
    assert (tmp_path / "p.png").read_bytes()[:4] == b"\x89PNG"
    assert [p.name for p in tmp_path.iterdir()] == ["p.png"]


def test_signed_distances_are_cut_at_zero(spem: Spem, tmp_path: Path) -> None:
    """--signed-distance names the sign inside; info, field and maps take it."""
    x = np.arange(30) - 14.2
    distance = np.hypot(x[:, None], x) - 8.3
    np.save(tmp_path / "sd.npy", distance)
    option = ("--signed-distance", "negative", "--json")
    facts = json.loads(spem("info", tmp_path / "sd.npy", *option).stdout)
    assert facts["voxels"] == np.count_nonzero(distance < 0)
    for command in (("field", "--rho", "2"), ("maps", "--n-maps", "2")):
        result = spem(command[0], tmp_path / "sd.npy", *command[1:], *option, "-o", tmp_path / "out.npz")
        assert json.loads(result.stdout)["voxels"] == facts["voxels"]


def test_label_and_polarity_options(spem: Spem, tmp_path: Path, image: Path) -> None:
    """--label takes one label of a volume, --dark the ground of a bright shape."""
    np.save(tmp_path / "labels.npy", [[0, 3, 3, 0, 7], [0, 3, 3, 0, 7]])
    facts = json.loads(spem("info", tmp_path / "labels.npy", "--label", "3", "--json").stdout)
    assert facts["voxels"] == 4
    bright, dark = (
        json.loads(spem("info", image, o, "--json").stdout)["voxels"] for o in ("--light", "--dark")
    )
    assert bright + dark == 37 * 37
