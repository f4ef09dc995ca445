"""One door for shapes."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
import tifffile
import trimesh
from PIL import Image

from spem.errors import ParameterError, ReadError, ShapeError
from spem.shapes.distance import signed_distance
from spem.shapes.read import read, read_all
from spem.shapes.shape import Shape

BAR = np.zeros((12, 16), bool)
BAR[3:9, 4:13] = True
SPECKED = BAR.copy()
SPECKED[0, 0] = True
CUBE = (
    np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], float),
    np.array(
        [
            [0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1],
            [2, 3, 7], [2, 7, 6], [0, 2, 6], [0, 6, 4], [1, 5, 7], [1, 7, 3],
        ]
    ),
)  # fmt: skip


@pytest.fixture
def bar_png(tmp_path):
    """Write a black bar on white with a speck."""
    path = tmp_path / "bar.PNG"
    Image.fromarray(~SPECKED).save(path)
    return path


def test_images_are_read_with_their_largest_component(bar_png):
    """The suffix's case does not matter; specks go unless all is asked."""
    assert read(bar_png).n_nodes == BAR.sum()
    assert read(str(bar_png), components="all").n_nodes == SPECKED.sum()
    assert read(bar_png, name="other").name == "other"
    assert read(bar_png, dark=False).n_nodes == (~SPECKED).sum()


def test_grids_are_chosen_three_ways(bar_png):
    """A budget, a spacing or an inner radius, but no two of them."""
    assert read(bar_png, voxels=1000).n_nodes == pytest.approx(1000, rel=0.03)
    assert read(bar_png, spacing=0.5).spacing == (0.5, 0.5)
    deep = read(bar_png, inner_radius=9)
    assert signed_distance(deep).max() / deep.spacing[0] == pytest.approx(9, rel=0.03)
    with pytest.raises(ParameterError, match=r"voxels=9 and spacing=0.5 exclude each other"):
        read(bar_png, voxels=9, spacing=0.5)


def test_the_report_outlives_resampling(bar_png):
    """Components and repairs of every step are in the report."""
    report = read(bar_png, spacing=0.5).report
    assert report.components == 2
    assert report.volume_kept == pytest.approx(54 / 55)
    assert len(report.repairs) == 3


def test_arrays_are_masks_labels_or_images():
    """Arrays have the spacing that is given; 8-bit ones are images."""
    assert read(SPECKED, spacing=(1.0, 2.0)).spacing == (1.0, 2.0)
    assert read(BAR * 3 + (np.arange(16) > 14), label=3).n_nodes == BAR.sum()
    grey = np.full(BAR.shape, 255, np.uint8)
    grey[BAR], grey[3, 4] = 0, 100
    assert read(grey).n_nodes == BAR.sum()
    assert read(np.repeat(grey[:, :, None], 3, axis=2)).n_nodes == BAR.sum()
    assert read(1.0 - BAR, dark=True).n_nodes == BAR.sum()
    assert read(BAR, spacing=2.0, voxels=1000).volume == pytest.approx(4 * BAR.sum(), rel=0.06)


def test_meshes_come_as_files_objects_or_pairs(tmp_path):
    """A unit cube has a unit volume, however it is given."""
    lines = [f"v {x} {y} {z}" for x, y, z in CUBE[0]] + [f"f {a} {b} {c}" for a, b, c in CUBE[1] + 1]
    (tmp_path / "cube.obj").write_text("\n".join(lines))
    for source in (tmp_path / "cube.obj", CUBE, SimpleNamespace(vertices=CUBE[0], faces=CUBE[1])):
        shape = read(source, voxels=1000)
        assert shape.volume == pytest.approx(1.0, rel=0.05)
        assert shape.n_nodes == pytest.approx(1000, rel=0.05)
    with pytest.raises(ParameterError, match=r"cube.obj: label=1 does not apply to a mesh"):
        read(tmp_path / "cube.obj", label=1)


@pytest.mark.parametrize("side", ["negative", "positive"])
def test_signed_distances_are_cut_at_zero(tmp_path, side):
    """The zero level is the boundary, in arrays and files, whichever sign is inside."""
    x = np.arange(60) - 29.3
    radius = 10.42
    distance = np.hypot(x[:, None], x) - radius
    nodes = np.count_nonzero(distance < 0)
    stored = distance if side == "negative" else -distance
    np.save(tmp_path / "sd.npy", stored)
    np.savez(tmp_path / "sd.npz", volume=stored, spacing=0.5)
    tifffile.imwrite(tmp_path / "sd.tif", stored.astype(np.float32))
    for source in (stored, stored.astype(np.float32), *(tmp_path / f"sd.{s}" for s in ("npy", "npz", "tif"))):
        shape = read(source, signed_distance=side)
        assert shape.n_nodes == nodes
        assert shape.volume / np.prod(shape.spacing) == pytest.approx(np.pi * radius**2, rel=1e-3)
        assert f"signed distance, {side} inside" in shape.report.method
    assert "were these signed distances" in read(stored).report.method


def test_signed_distances_go_with_nothing_else(bar_png):
    """Other ways to tell inside from outside, wrong words and images are refused."""
    level = np.linspace(-1, 1, 9)
    with pytest.raises(
        ParameterError, match=r"threshold=0.5 and signed_distance=negative exclude each other"
    ):
        read(level, threshold=0.5, signed_distance="negative")
    with pytest.raises(
        ParameterError, match="array: signed distance 'yes' inside: expected 'negative' or 'positive'"
    ):
        read(level, signed_distance="yes")
    with pytest.raises(ShapeError, match=r"nowhere positive, so nothing is inside; .* say 'negative'"):
        read(level - 2, signed_distance="positive")
    with pytest.raises(ParameterError, match="signed_distance=negative does not apply to an image"):
        read(bar_png, signed_distance="negative")
    with pytest.raises(ParameterError, match="signed_distance=negative does not apply to a mesh"):
        read(CUBE, signed_distance="negative")


def test_components_of_a_shape_are_kept_when_asked():
    """A shape comes with all its components, unless one way or the other is asked for."""
    shape = Shape.from_mask(SPECKED)
    assert read(shape, components="largest").n_nodes == BAR.sum()
    assert read(shape, components="all").n_nodes == SPECKED.sum()
    with pytest.raises(ParameterError, match="components='some'"):
        read(shape, components="some")


def test_shapes_come_back_or_resampled():
    """A shape is a source as well."""
    shape = Shape.from_mask(SPECKED)
    assert read(shape) is shape
    assert read(shape, name="new").name == "new"
    assert read(shape, spacing=0.5).spacing == (0.5, 0.5)
    with pytest.raises(ParameterError, match="dark=True does not apply to a shape"):
        read(shape, dark=True)


def test_a_tiff_is_an_image_or_a_volume_by_its_pages(tmp_path):
    """One page is an image, more are a volume."""
    path = tmp_path / "a.tif"
    Image.fromarray(BAR).save(path)
    assert read(path).ndim == 2
    tifffile.imwrite(
        path, np.pad(np.repeat(BAR[None], 4, axis=0), 1).astype(np.uint8), photometric="minisblack"
    )
    assert read(path).ndim == 3
    assert read_all(path)[0].ndim == 3


def test_all_labels_of_a_file_are_read(tmp_path, bar_png):
    """One shape a label, each on the grid asked for; one for other files."""
    np.save(tmp_path / "two.npy", BAR * 1 + np.roll(BAR, 9, axis=1) * 2)
    shapes = read_all(tmp_path / "two.npy", voxels=500)
    assert [s.name for s in shapes] == ["two-1", "two-2", "two-3"][: len(shapes)]
    assert all(s.n_nodes == pytest.approx(500, rel=0.03) for s in shapes[:1])
    assert len(read_all(bar_png)) == 1


def test_what_cannot_be_read_is_refused(tmp_path, bar_png):
    """Unknown kinds list the known ones; arguments that do not apply are named."""
    (tmp_path / "notes.txt").write_text("x")
    with pytest.raises(
        ReadError, match=r"notes.txt: unknown kind of file .txt; expected one of .png, .*.npy.*.obj"
    ):
        read(tmp_path / "notes.txt")
    with pytest.raises(ReadError, match="nothing: no such file"):
        read(tmp_path / "nothing")
    with pytest.raises(ReadError, match="is a folder, expected a file"):
        read(tmp_path)
    for voxels in (np.nan, 2.5):
        with pytest.raises(ParameterError, match=r"voxels=.*: expected a whole number of at least 1"):
            read(bar_png, voxels=voxels)
    with pytest.raises(ReadError, match=r"absent.nii.gz: no such file"):
        read(tmp_path / "absent.nii.gz")
    with pytest.raises(ParameterError, match=r"bar.PNG: label=1 does not apply to an image"):
        read(bar_png, label=1)
    with pytest.raises(ParameterError, match="components='some'"):
        read(bar_png, components="some")
    with pytest.raises(ShapeError, match="thinner than the new grid"):
        read(bar_png, spacing=7.0)


def test_coarse_grids_are_told() -> None:
    """A mesh that its grid misses by a tenth of its volume says so, as does a shape of hardly a node."""
    ball = trimesh.creation.icosphere(3, 2.0)
    assert read(ball, spacing=0.2).report.repairs == ()
    coarse = read(ball, spacing=100.0)
    assert coarse.report.repairs[0].startswith("volume +")
    assert coarse.report.repairs[1] == "only 1 node inside: use a finer grid"
    assert "only 3 nodes inside" in read(np.ones((1, 3), bool)).report.repairs[-1]
