"""spem parts: arrays, tables, pictures, pages and meshes of parts, and what is refused."""

from __future__ import annotations

import inspect
import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import trimesh
from PIL import Image
from typer.testing import Result

import spem as package
from spem.api.parts import part_sources
from spem.cli.parts import PartsRequest

Spem = Callable[..., Result]
Refused = Callable[..., None]


def dumbbell() -> np.ndarray:
    """Return the mask of two squares of 8 x 8 pixels joined by a bar."""
    mask = np.zeros((12, 28), bool)
    mask[2:10, 2:10] = mask[2:10, 18:26] = mask[5:7, 10:18] = True
    return mask


@pytest.fixture
def bone(tmp_path: Path) -> Path:
    """Return a picture of the dumbbell."""
    path = tmp_path / "bone.png"
    Image.fromarray(255 * dumbbell().astype(np.uint8)).save(path)
    return path


@pytest.fixture(scope="session")
def solid(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a mesh of two boxes joined by a bar."""
    path = tmp_path_factory.mktemp("solid") / "bone.obj"
    boxes = [((4, 4, 4), -6), ((10, 1.5, 1.5), 0), ((4, 4, 4), 6)]
    whole = trimesh.util.concatenate(
        [
            trimesh.creation.box(size, trimesh.transformations.translation_matrix((x, 0, 0)))
            for size, x in boxes
        ]
    )
    whole.export(path)
    return path


def test_parts_are_written(spem: Spem, bone: Path, tmp_path: Path) -> None:
    """Two parts of a dumbbell are its ends; the file is read back as parts, and by plain NumPy."""
    target = tmp_path / "new" / "p.npz"
    result = spem("parts", bone, "-k", "2", "-o", target)
    assert result.exit_code == 0, result.stderr
    assert "Parts('bone', 2 parts of its region" in result.stdout
    assert f"wrote {target}" in result.stdout
    with np.load(target) as found:
        own = {"points", "labels", "components", "basis", "sources", "source_labels", "intensity", "rho"}
        assert own <= set(found)
        n, m = len(found["points"]), len(found["sources"])
        assert found["components"].shape == (2, n)
        assert found["basis"].shape == (2, m)
        left, right = (set(found["labels"][found["points"][:, 1] // 14 == side]) - {-1} for side in (0, 1))
    assert {*left, *right} == {0, 1}
    assert len(left) == len(right) == 1
    assert package.Parts.load(target).n_parts == 2


def test_summary_for_machines(spem: Spem, bone: Path, tmp_path: Path) -> None:
    """--json tells of shape, sources, sizes, intensities and files, and repeats what was asked."""
    target = tmp_path / "p.npz"
    options = ("-k", "3", "--sparsity", "0.05", "--rho", "4", "--boundary-parts", "--seed", "2")
    summary = json.loads(spem("parts", bone, *options, "-o", target, "--json").stdout)
    assert (summary["name"], summary["voxels"], summary["n_parts"]) == ("bone", 144, 3)
    assert (summary["over"], summary["boundary"], summary["rho"]) == ("boundary", "voxel", 4.0)
    assert (summary["sparsity"], summary["seed"], summary["output"]) == (0.05, 2, str(target))
    assert sum(summary["sizes"]) + summary["unexplained"] == pytest.approx(1)
    assert sum(summary["intensity"]) == pytest.approx(1)
    parts = package.Parts.load(target)
    assert (parts.over, parts.rho, parts.sources.n_sources) == ("boundary", 4.0, summary["n_sources"])
    assert parts.components.shape == (3, summary["n_sources"])


def test_parts_are_those_of_the_library(spem: Spem, bone: Path, tmp_path: Path) -> None:
    """The command gives what `spem.parts` gives with the same options, and the same again."""
    for name in ("a.npz", "b.npz"):
        assert spem("parts", bone, "-k", "4", "--patches", "20", "-o", tmp_path / name).exit_code == 0
    expected = package.parts(package.read(bone), 4, n_patches=20, rng=np.random.default_rng(0))
    for name in ("a.npz", "b.npz"):
        found = package.Parts.load(tmp_path / name)
        np.testing.assert_array_equal(found.node_labels, expected.node_labels)


def test_defaults_are_those_of_the_library() -> None:
    """What the command divides by, where nothing is asked for, is what `spem.parts` divides by."""
    known = inspect.signature(package.parts).parameters
    request = PartsRequest()
    for name in ("n_parts", "over", "rho", "sparsity", "n_patches", "boundary"):
        assert getattr(request, name) == known[name].default, name
    assert known["n_patches"].default == inspect.signature(part_sources).parameters["n_patches"].default


def test_sources_are_patches_or_every_node(spem: Spem, tmp_path: Path) -> None:
    """There are 200 sources where the boundary has as many nodes; `--patches all` takes every node."""
    np.save(tmp_path / "square.npy", np.pad(np.ones((60, 60), bool), 1))
    for options, count in (((), 200), (("--patches", "all"), 240)):
        run = spem("parts", tmp_path / "square.npy", "-k", "2", *options, "-o", tmp_path / "p.npz", "--json")
        assert json.loads(run.stdout)["n_sources"] == count


def test_number_of_parts_by_the_curve(spem: Spem, bone: Path, tmp_path: Path) -> None:
    """--curve prints and draws the error against k; -k auto takes the k that it suggests."""
    plot = tmp_path / "curve.png"
    result = spem("parts", bone, "--curve", "-k", "6", "--plot", plot)
    assert result.exit_code == 0, result.stderr
    lines = result.stdout.splitlines()
    assert [line.split()[0] for line in lines[2:8]] == list("123456")
    assert plot.read_bytes()[:4] == b"\x89PNG"
    curve = json.loads(spem("parts", bone, "--curve", "--json").stdout)
    assert curve["k"] == list(range(1, 17))
    assert (np.diff(curve["error"]) <= 0).all()
    auto = json.loads(spem("parts", bone, "-k", "auto", "-o", tmp_path / "p.npz", "--json").stdout)
    assert auto["n_parts"] == curve["suggested"]


def test_pictures_of_a_solid(spem: Spem, solid: Path, tmp_path: Path) -> None:
    """Of a mesh there are a picture, a page, and a PLY file with its own vertices, labelled."""
    plot, page, mesh = (tmp_path / name for name in ("p.png", "p.html", "p.ply"))
    options = ("-k", "2", "--patches", "30", "--voxels", "600", "--components", "all")
    result = spem("parts", solid, *options, "--plot", plot, "--page", page, "--mesh", mesh)
    assert result.exit_code == 0, result.stderr
    assert plot.read_bytes()[:4] == b"\x89PNG"
    assert "<canvas" in page.read_text(encoding="utf-8")
    found, original = (trimesh.load(path, process=False) for path in (mesh, solid))
    np.testing.assert_allclose(found.vertices, original.vertices)
    np.testing.assert_array_equal(found.faces, original.faces)
    labels = np.asarray(found.metadata["_ply_raw"]["vertex"]["data"]["label"]).ravel()
    assert len({*labels[found.vertices[:, 0] < -4]}) == len({*labels[found.vertices[:, 0] > 4]}) == 1
    assert len(set(labels)) == 2


def test_parts_of_a_volume(spem: Spem, tmp_path: Path) -> None:
    """A solid without a mesh has a surface of its own; default patches are no more than its points."""
    np.save(tmp_path / "rod.npy", np.pad(np.ones((2, 2, 7), bool), 1))
    mesh = tmp_path / "p.ply"
    result = spem("parts", tmp_path / "rod.npy", "-k", "2", "--mesh", mesh)
    assert result.exit_code == 0, result.stderr
    assert len(trimesh.load(mesh).faces) > 50


def test_components_apart_have_parts_apart(spem: Spem, tmp_path: Path) -> None:
    """Sources do not reach other components: no part lies in two of them, and nothing is NaN."""
    np.save(tmp_path / "two.npy", np.pad(np.kron([[1, 0, 1]], np.ones((5, 5), bool)), 1) > 0)
    target = tmp_path / "p.npz"
    result = spem("parts", tmp_path / "two.npy", "--components", "all", "-k", "2", "-o", target)
    assert result.exit_code == 0, result.stderr
    with np.load(target) as found:
        assert np.isfinite(found["components"]).all()
        assert np.isfinite(found["basis"]).all()
        sides = [set(found["labels"][found["points"][:, 1] // 8 == side]) - {-1} for side in (0, 1)]
    assert sides in ([{0}, {1}], [{1}, {0}])


@pytest.fixture
def clubs(tmp_path: Path) -> list[Path]:
    """Return three clubs: a large end, a handle of some length, a small end; one of them turned round."""
    paths = []
    for i, length in enumerate((10, 12, 14)):
        mask = np.zeros((16, 24 + length), bool)
        mask[2:14, 2:14] = mask[7:9, 14 : 14 + length] = mask[5:11, 14 + length : 20 + length] = True
        paths.append(tmp_path / f"club{i}.npy")
        np.save(paths[-1], mask[:, ::-1] if i == 1 else mask)
    return paths


def test_several_shapes_have_the_same_parts(spem: Spem, clubs: list[Path], tmp_path: Path) -> None:
    """A label is the same part in all shapes: a file each in a folder, one picture for all."""
    folder, plot = tmp_path / "parts", tmp_path / "p.png"
    result = spem("parts", *clubs, "-k", "2", "--patches", "40", "-o", folder, "--plot", plot)
    assert result.exit_code == 0, result.stderr
    assert sorted(path.name for path in folder.iterdir()) == ["club0.npz", "club1.npz", "club2.npz"]
    assert f"wrote {folder / 'club2.npz'}" in result.stdout
    assert plot.read_bytes()[:4] == b"\x89PNG"
    large = []
    for path in clubs:
        parts = package.Parts.load(folder / f"{path.stem}.npz")
        mask = np.load(path)
        column = 8 if path.stem != "club1" else mask.shape[1] - 9
        large.append(int(parts.node_labels[np.argmin(abs(parts.shape.points - [8, column]).sum(axis=1))]))
    assert len(set(large)) == 1


def test_several_solids_have_meshes_of_their_own(spem: Spem, solid: Path, tmp_path: Path) -> None:
    """Meshes of several shapes go to a folder, one page shows all; a second run replaces them."""
    copy, folder, page = tmp_path / "copy.obj", tmp_path / "meshes", tmp_path / "p.htm"
    copy.write_bytes(solid.read_bytes())
    options = ("-k", "2", "--patches", "20", "--voxels", "300", "--components", "all")
    for _ in range(2):
        result = spem("parts", solid, copy, *options, "--mesh", folder, "--page", page, "--json")
        assert result.exit_code == 0, result.stderr
    assert sorted(path.name for path in folder.iterdir()) == ["bone.ply", "copy.ply"]
    summary = json.loads(result.stdout)
    assert [shape["name"] for shape in summary["shapes"]] == ["bone", "copy"]
    assert (summary["mesh"], summary["page"], summary["output"]) == (str(folder), str(page), None)
    assert "2 shapes" in page.read_text(encoding="utf-8")


def test_files_of_several_shapes(
    spem: Spem, refused: Refused, clubs: list[Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Shapes of one name, a file in place of a folder, and files that are not of parts are refused."""
    monkeypatch.chdir(tmp_path)
    twin = tmp_path / "twin" / "club0.npy"
    twin.parent.mkdir()
    twin.write_bytes(clubs[0].read_bytes())
    refused(spem("parts", clubs[0], twin, "-o", "out"), "club0.npy: both are named club0; rename one")
    refused(spem("parts", *clubs, "-o", "out.npz"), "out.npz: 3 shapes are written to a folder")
    refused(spem("parts", *clubs, "--mesh", "out.ply"), "out.ply: 3 shapes are written to a folder")
    np.savez(tmp_path / "club1.npz", mask=np.load(clubs[1]))
    refused(spem("parts", *clubs, "-o", "."), "club1.npz: is there already and not parts that spem wrote")
    refused(spem("parts", clubs[0], "club1.npz", "-o", "."), "club1.npz: is a file that is read")
    refused(spem("parts", *clubs, "-k", "auto", "-o", "out"), "-k auto: takes one shape, got 3")
    refused(spem("parts", *clubs, "--curve"), "--curve: takes one shape, got 3")
    refused(spem("parts", *clubs, "none.npy", "-o", "out"), "none.npy: no such file")
    assert not list(tmp_path.glob("out*/*"))


def test_unlike_shapes_are_told(spem: Spem, clubs: list[Path], tmp_path: Path) -> None:
    """A shape whose interactions are unlike those of the others is named."""
    np.save(tmp_path / "disk.npy", np.hypot(*np.mgrid[-12:13, -12:13]) < 11)
    options = ("-k", "2", "--patches", "40", "-o", tmp_path / "out")
    assert "unlike" not in spem("parts", *clubs, *options).stderr
    result = spem("parts", *clubs[::2], tmp_path / "disk.npy", *options)
    assert result.exit_code == 0, result.stderr
    assert "is unlike" in result.stderr


def test_several_shapes_that_do_not_fit_in_memory(
    spem: Spem, refused: Refused, clubs: list[Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Fields and measurements of all shapes are held at once, so they must fit in memory together."""
    monkeypatch.setenv("SPEM_MEMORY_LIMIT", "300K")
    result = spem("parts", *clubs, "--patches", "40", "-o", tmp_path / "out")
    refused(result, "fields and measurements of 3 shapes together need", "the limit is 300 KiB")


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (("-k", "0"), ("-k 0: expected a number of parts from 1 on, or auto",)),
        (("-k", "x"), ("-k x: expected a number of parts from 1 on, or auto",)),
        (("-k", "500"), ("-k 500: bone has 72 sources and 144 nodes; expected at most 72",)),
        (("--patches", "5", "-k", "6"), ("-k 6: bone has 5 sources",)),
        (("--patches", "0"), ("--patches 0: expected a number of patches from 1 on, or all",)),
        (("--patches", "some"), ("--patches some: expected",)),
        (("--sparsity", "-0.1"), ("--sparsity -0.1: expected 0 to less than 1, where all codes vanish",)),
        (("--sparsity", "1"), ("--sparsity 1: expected 0 to less than 1",)),
        (("--sparsity", "nan"), ("--sparsity nan",)),
        (("--rho", "0"), ("--rho 0: expected a length above zero, or inf",)),
        (("--rho", "nan"), ("--rho nan",)),
        (("--rho", "1e-200"), ("rho", "or inf")),
        (("--curve",), ("--curve makes no parts",)),
        (("--curve", "-k", "auto"), ("-k auto: --curve suggests a number already",)),
        (("--page", "p.html"), ("bone: has 2 dimensions; --page takes shapes of 3",)),
        (("--mesh", "p.ply"), ("bone: has 2 dimensions; --mesh takes shapes of 3",)),
        (("--page", "p.txt"), ("p.txt: expected a file that ends in .html",)),
        (("--mesh", "p.obj"), ("p.obj: expected a file that ends in .ply",)),
        (("--plot", "p.bmp"), ("p.bmp: expected a file that ends in .png",)),
        (("-o", "p.txt"), ("p.txt: expected a file that ends in .npz",)),
        (("--plot", "bone.png"), ("bone.png: is a file that is read",)),
        (("--seed", "-1"), ("--seed",)),
    ],
)
def test_wrong_requests(
    spem: Spem,
    refused: Refused,
    bone: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    options: tuple[str, ...],
    words: tuple[str, ...],
) -> None:
    """Numbers out of range, files of other kinds and options at odds are refused, and nothing is written."""
    monkeypatch.chdir(tmp_path)
    refused(spem("parts", bone, "-o", "p.npz", *options), *words)
    assert [path.name for path in tmp_path.iterdir()] == ["bone.png"]


def test_nothing_to_write(spem: Spem, refused: Refused, bone: Path) -> None:
    """Without a file to write the parts are told, as a table or for machines."""
    table = spem("parts", bone, "-k", "2")
    assert table.exit_code == 0, table.stderr
    assert [line.split()[0] for line in table.stdout.splitlines()[-2:]] == ["0", "1"]
    assert "wrote" not in table.stdout
    summary = json.loads(spem("parts", bone, "-k", "2", "--json").stdout)
    assert (summary["n_parts"], summary["output"], summary["plot"]) == (2, None, None)
    assert [path.name for path in bone.parent.iterdir()] == ["bone.png"]
    refused(spem("parts", "no-such-shape.png"), "no-such-shape.png: no such file")


@pytest.mark.parametrize(
    ("options", "word"),
    [((), "-k 8: one has 4 sources and 1 node; expected at most 1"), (("-k", "1"), "nothing to divide")],
)
def test_one_pixel(spem: Spem, tmp_path: Path, options: tuple[str, ...], word: str) -> None:
    """A shape of one node, which is warned of when it is read, has no parts."""
    np.save(tmp_path / "one.npy", np.pad([[1]], 1))
    result = spem("parts", tmp_path / "one.npy", *options, "-o", tmp_path / "p.npz")
    assert result.exit_code == 2
    warning, error = result.stderr.splitlines()
    assert "only 1 node inside" in warning
    assert word in error


def test_sources_that_do_not_fit_in_memory(
    spem: Spem, refused: Refused, bone: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """More sources than the memory limit allows are refused with how many fit and the options that help."""
    monkeypatch.setenv("SPEM_MEMORY_LIMIT", "60K")
    result = spem("parts", bone, "-o", tmp_path / "p.npz")
    refused(
        result, "bone: 72 fields of 144 nodes need", "would fit; ask for fewer sources, as with --patches M"
    )
    assert spem("parts", bone, "--patches", "20", "-o", tmp_path / "p.npz").exit_code == 0


def test_interrupted_run_leaves_nothing(
    spem: Spem, bone: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Ctrl-C while a file is written leaves no part of it, and exit status 130."""

    def stop(*_: object, **__: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("spem.decomposition.parts_files.np.savez", stop)
    result = spem("parts", bone, "-k", "2", "-o", tmp_path / "p.npz")
    assert (result.exit_code, result.stderr.strip()) == (130, "spem: interrupted")
    assert [path.name for path in tmp_path.iterdir()] == ["bone.png"]
