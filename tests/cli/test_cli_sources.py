"""field --source and --patch: fields of single sources, where they are, and what is refused."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from typer.testing import Result

import spem as package

Spem = Callable[..., Result]
Refused = Callable[..., None]


@pytest.fixture
def bar(tmp_path: Path) -> Path:
    """Return a bar of 3 x 12 pixels, rows 2 to 4 and columns 2 to 13."""
    path = tmp_path / "bar.npy"
    np.save(path, np.pad(np.ones((3, 12), bool), 2))
    return path


def test_source_is_the_nearest_boundary_node(spem: Spem, bar: Path, tmp_path: Path) -> None:
    """The file holds v and log v of the source next to the point, in the voxel model an outside voxel."""
    target = tmp_path / "f.npz"
    result = spem("field", bar, "--boundary", "voxel", "--source", "3.2,0.5", "-o", target)
    assert result.exit_code == 0, result.stderr
    assert "--source 3.2,0.5: boundary node" in result.stdout
    assert "at 3,1, 0.5385 away" in result.stdout
    with np.load(target) as found:
        own = {"values", "log", "sources", "distance"}
        assert set(found) == own | {"points", "rho", "spacing", "origin", "name", "boundary"}
        assert found["values"].shape == found["log"].shape == (36, 1, 1)
        np.testing.assert_array_equal(found["sources"], [[3, 1]])
        np.testing.assert_allclose(found["distance"], np.hypot(0.2, 0.5))
        np.testing.assert_array_equal(found["rho"], [np.inf])
        np.testing.assert_allclose(np.exp(found["log"]), found["values"], rtol=1e-14)
        peak = found["points"][found["values"][:, 0, 0].argmax()]
    np.testing.assert_array_equal(peak, [3, 2])


def test_sources_and_rho_make_a_field_each(spem: Spem, bar: Path, tmp_path: Path) -> None:
    """Several sources and ρ are axes of the values; each entry is that of the library."""
    target, places = tmp_path / "f.npz", [(3.0, 1.5), (4.5, 8.0)]
    options = [word for a, b in places for word in ("--source", f"{a},{b}")]
    result = spem("field", bar, "--rho", "2,inf", *options, "-o", target, "--json")
    summary = json.loads(result.stdout)
    assert summary["rho"] == [2.0, "inf"]
    np.testing.assert_allclose(summary["sources"], places)
    assert np.shape(summary["min_log"]) == (2, 2)
    expected = package.source_fields(package.sources(package.read(bar), at=places), 2.0)
    with np.load(target) as found:
        assert found["log"].shape == (36, 2, 2)
        np.testing.assert_allclose(found["log"][:, 0].T, expected.log, rtol=1e-12)


def test_patches_sum_to_the_field_of_the_whole_boundary(
    spem: Spem, refused: Refused, bar: Path, tmp_path: Path
) -> None:
    """With one patch for each end and side, the fields together are v (2.3)."""
    patches = package.sources(package.read(bar), 4)
    target = tmp_path / "f.npz"
    places = [word for p in patches.points.position for word in ("--patch", f"{p[0]},{p[1]}")]
    result = spem("field", bar, *places, "--patches", "4", "-o", target)
    refused(result, "fall on one source")
    first = patches.points.position[np.unique(patches.group, return_index=True)[1]]
    places = [word for p in first for word in ("--patch", f"{p[0]},{p[1]}")]
    result = spem("field", bar, *places, "--patches", "4", "-o", target)
    assert "patch 0 of 4 about" in result.stdout
    with np.load(target) as found:
        np.testing.assert_allclose(found["values"].sum(axis=2), 1, rtol=1e-12)


def test_default_patches_are_as_many_as_there_are_points(spem: Spem, bar: Path, tmp_path: Path) -> None:
    """A boundary of fewer points than the default number of patches is no error."""
    result = spem("field", bar, "--patch", "3,1.5", "-o", tmp_path / "f.npz")
    assert result.exit_code == 0, result.stderr
    assert "of 30 about" in result.stdout


def test_point_with_negative_coordinates(spem: Spem, mesh: Path, tmp_path: Path) -> None:
    """Coordinates may be negative and are those of the mesh."""
    target = tmp_path / "f.npz"
    result = spem("field", mesh, "--voxels", "300", "--source", "-0.1,1.5,2", "--rho", "0.5", "-o", target)
    assert result.exit_code == 0, result.stderr
    with np.load(target) as found:
        np.testing.assert_allclose(found["sources"][0], [0, 1.5, 2], atol=0.3)
        assert found["boundary"] == "surface"


def test_other_components_are_zero(spem: Spem, tmp_path: Path) -> None:
    """In components that the source does not touch the field is 0, its log -inf, and that is told."""
    np.save(tmp_path / "two.npy", np.pad([[1, 1, 1, 0, 0, 0, 1, 1]], 1))
    target = tmp_path / "f.npz"
    result = spem("field", tmp_path / "two.npy", "--components", "all", "--source", "1,0.5", "-o", target)
    assert "-inf, at 2 nodes in components that no source touches" in result.stderr
    with np.load(target) as found:
        np.testing.assert_array_equal(np.isneginf(found["log"]).ravel(), [False] * 3 + [True] * 2)
        np.testing.assert_array_equal(found["values"].ravel() == 0, [False] * 3 + [True] * 2)
    plot = tmp_path / "p.png"
    result = spem("field", tmp_path / "two.npy", "--components", "all", "--source", "1,0.5", "--plot", plot)
    assert result.exit_code == 0, result.stderr


def test_one_pixel(spem: Spem, tmp_path: Path) -> None:
    """The field of one side of a single pixel is a quarter, for the sides sum to one."""
    np.save(tmp_path / "one.npy", np.pad([[1]], 1))
    target = tmp_path / "f.npz"
    assert spem("field", tmp_path / "one.npy", "--source", "1,0", "-o", target).exit_code == 0
    with np.load(target) as found:
        np.testing.assert_allclose(found["values"], 0.25)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (
            ("--source", "6,7"),
            ("the point 6,7 is 4.5 from the boundary, more than 3; the nearest boundary node is",),
        ),
        (("--source", "90,90"), ("from the boundary, more than 3",)),
        (("--source", "1,2,3"), ("--source 1,2,3: a point of bar has 2 finite coordinates",)),
        (("--source", "1,x"), ("--source 1,x: a point of bar has 2 finite coordinates",)),
        (("--source", "nan,1"), ("--source nan,1: a point of bar has 2 finite coordinates",)),
        (("--source", "3,1", "--source", "3,1.2"), ("fall on one source",)),
        (("--source", "3,1", "--patch", "3,1"), ("exclude each other",)),
        (("--source", "3,1", "--patches", "9"), ("--patches 9: no patch is asked for",)),
        (("--patch", "3,1", "--patches", "0"), ("--patches",)),
        (("--source", "3,1", "--rho", "0"), ("rho", "positive")),
    ],
)
def test_what_is_no_source(
    spem: Spem, refused: Refused, tmp_path: Path, options: tuple[str, ...], words: tuple[str, ...]
) -> None:
    """Points that are far, of another dimension or no numbers, and options at odds, are refused."""
    wide = tmp_path / "bar.npy"
    np.save(wide, np.pad(np.ones((9, 12), bool), 2))
    refused(spem("field", wide, *options, "-o", tmp_path / "f.npz"), *words)
    assert not (tmp_path / "f.npz").exists()


def test_rho_is_needed_without_a_source(spem: Spem, refused: Refused, bar: Path, tmp_path: Path) -> None:
    """Of the whole boundary the field for ρ = inf is 1 everywhere, so ρ has no default there."""
    refused(spem("field", bar, "-o", tmp_path / "f.npz"), "Missing option '--rho'", "--source")


def test_what_is_read_is_not_written_over(spem: Spem, refused: Refused, image: Path, tmp_path: Path) -> None:
    """A picture does not replace the image that it is made of."""
    copy = tmp_path / "copy.png"
    copy.write_bytes(image.read_bytes())
    refused(spem("field", copy, "--rho", "2", "--plot", copy), "copy.png: is a file that is read")
    assert copy.read_bytes() == image.read_bytes()


def test_sources_that_do_not_fit_in_memory(
    spem: Spem, refused: Refused, bar: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A memory limit below a few fields is told, with what it would take."""
    np.save(tmp_path / "line.npy", np.pad(np.ones(400, bool), 1))
    monkeypatch.setenv("SPEM_MEMORY_LIMIT", "12K")
    result = spem("field", tmp_path / "line.npy", "--source", "0", "-o", tmp_path / "f.npz")
    refused(result, "line: 1 fields of 400 nodes need", "the limit is 12 KiB", "--patches")
    assert "Sources.select" not in result.stderr


@pytest.mark.parametrize("shape", [(9,), (5, 7), (3, 4, 5)])
def test_pictures_of_logs(spem: Spem, tmp_path: Path, shape: tuple[int, ...]) -> None:
    """Log v is drawn in one, two and three dimensions."""
    np.save(tmp_path / "box.npy", np.ones(shape, bool))
    point = ",".join(["-0.5", *(str((n - 1) / 2) for n in shape[1:])])
    result = spem("field", tmp_path / "box.npy", "--source", point, "--plot", tmp_path / "p.png")
    assert result.exit_code == 0, result.stderr
    assert (tmp_path / "p.png").read_bytes()[:4] == b"\x89PNG"
