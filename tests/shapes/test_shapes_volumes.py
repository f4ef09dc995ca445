"""Masks, labels and grey volumes, in arrays and files."""

from __future__ import annotations

import nibabel
import numpy as np
import pytest
import tifffile

from spem.errors import ParameterError, ReadError, ShapeError, SizeError
from spem.shapes.stacks import tiff_pages
from spem.shapes.volumes import read_labels, read_volume, volume_shape

BOX = np.zeros((6, 7, 8), bool)
BOX[2:4, 2:5, 1:6] = True
LABELS = np.zeros((4, 9), np.int16)
LABELS[1:3, 1:3] = 3
LABELS[1:3, 5:8] = 40


def grey_ball(n=24, radius=8.3):
    """Grey levels that fall linearly with the distance from the middle."""
    index = np.moveaxis(np.indices((n, n, n)), 0, -1) - (n - 1) / 2
    return 100 + radius - np.linalg.norm(index, axis=-1)


@pytest.mark.parametrize("dtype", [bool, np.uint8, np.int32, np.float32])
def test_two_values_are_a_mask(dtype):
    """The non-zero value is inside, whatever the type."""
    shape = volume_shape(BOX.astype(dtype), (1, 2, 3))
    assert shape.n_nodes == BOX.sum()
    assert shape.spacing == (1, 2, 3)
    assert shape.origin == (1, 2, 0)
    assert len(shape.cuts) == 0


def test_two_values_without_a_zero_take_the_greater():
    """Of 1 and 2, 2 is inside; of 0 and -1, -1 is."""
    assert volume_shape(BOX + 1).n_nodes == BOX.sum()
    assert volume_shape(-BOX.astype(int)).n_nodes == BOX.sum()


def test_labels_are_picked_or_taken_together():
    """One label, or all that are not zero with a word about it."""
    assert volume_shape(LABELS, label=3).n_nodes == 4
    together = volume_shape(LABELS)
    assert together.n_nodes == 10
    assert together.report.method == "2 labels together: 3, 40"
    with pytest.raises(ShapeError, match=r"no label 7 in the volume; it has 0, 3, 40"):
        volume_shape(LABELS, label=7)
    with pytest.raises(ParameterError, match=r"label=3 and threshold=1.0 exclude each other"):
        volume_shape(LABELS, label=3, threshold=1.0)


@pytest.mark.parametrize("array", [np.array([[-1, 5], [7, 5]]), np.array([[0, 128], [255, 5]], np.uint8)])
def test_labels_of_volumes_that_look_grey_are_picked(array):
    """What is asked for is taken, negative numbers and eight bits notwithstanding."""
    assert volume_shape(array, label=5).n_nodes == np.count_nonzero(array == 5)
    with pytest.raises(ShapeError, match=r"no label 6 in the volume; it has "):
        volume_shape(array, label=6)


def test_labels_lie_among_negative_values_of_a_scan():
    """Any value that is there can be chosen."""
    assert volume_shape(np.array([[-1, 5], [7, 5]]), label=-1).n_nodes == 1


def test_grey_levels_are_cut_between_voxels():
    """A grey volume is cut where its level is crossed, by Otsu's method or as given."""
    shape = volume_shape(grey_ball(), threshold=100.0)
    assert shape.volume == pytest.approx(4 / 3 * np.pi * 8.3**3, rel=0.03)
    assert len(shape.cuts) > 0
    assert np.ptp(shape.cuts.fraction) > 0.8
    assert "Otsu" in volume_shape(grey_ball()).report.method
    with pytest.raises(ShapeError, match="threshold=200 leaves no voxel inside: the values run"):
        volume_shape(grey_ball(), threshold=200)


@pytest.mark.parametrize("dtype", [np.int16, np.uint8, np.float64])
def test_whole_numbers_of_a_scan_are_grey_not_labels(dtype):
    """Noise, negative numbers and eight bits up to 255 are grey levels."""
    rng = np.random.default_rng(0)
    scan = rng.integers(0, 60, BOX.shape) + 180 * BOX
    scan[0, 0, 0], scan[2, 2, 1] = 0, 255
    scan = scan - (100 if dtype == np.int16 else 0)
    shape = volume_shape(scan.astype(dtype))
    assert "grey volume" in shape.report.method
    assert shape.n_nodes == BOX.sum()


def test_values_that_make_no_shape_are_refused():
    """NaN, nothing inside, and arrays of other things are refused."""
    with pytest.raises(ShapeError, match=r"1 of 3 values are NaN or infinite, the first at \[1\]"):
        volume_shape(np.array([0.0, np.nan, 1.0]))
    with pytest.raises(ShapeError, match="all 4 values are zero, so no voxel lies inside"):
        volume_shape(np.zeros((2, 2)))
    with pytest.raises(ShapeError, match=r"expected an array of numbers, got complex128 of shape \(2,\)"):
        volume_shape(np.zeros(2, complex))
    with pytest.raises(ParameterError, match="expected one positive number, or 3 of them"):
        volume_shape(BOX, (1, 2))
    with pytest.raises(SizeError, match=r"6 x 7 x 8 cells need .* the limit is 1 KiB"):
        volume_shape(BOX, memory_limit=1024)


def test_touching_the_border_is_reported():
    """A full array is padded."""
    assert volume_shape(np.ones((2, 2))).report.repairs == (
        "touched the border of the array on axis 0, 1: padded",
    )


def test_numpy_files_are_read(tmp_path):
    """Arrays of any dimension; archives with their spacing and origin."""
    np.save(tmp_path / "flat.npy", BOX[2])
    assert read_volume(tmp_path / "flat.npy").ndim == 2
    np.savez(tmp_path / "box.npz", other=np.ones(3), mask=BOX, spacing=[1, 2, 3], origin=[10, 20, 30])
    shape = read_volume(tmp_path / "box.npz")
    assert (shape.spacing, shape.origin, shape.n_nodes) == ((1, 2, 3), (11, 22, 30), BOX.sum())
    assert "array 'mask' of 2" in shape.report.method
    assert read_volume(tmp_path / "box.npz", spacing=0.5).spacing == (0.5,) * 3


def test_nifti_keeps_zooms_and_affine(tmp_path):
    """Spacing comes from the header, the affine stays beside it, a last axis of one is dropped."""
    affine = np.diag([-0.5, 0.75, 2.0, 1.0])
    for name, data in (("a.nii", BOX), ("b.nii.gz", BOX[..., None])):
        nibabel.save(nibabel.Nifti1Image(data.astype(np.uint8), affine), tmp_path / name)
        shape = read_volume(tmp_path / name)
        assert shape.name == name[0]
        assert shape.spacing == (0.5, 0.75, 2.0)
        assert np.allclose(shape.affine, affine)
        assert shape.n_nodes == BOX.sum()


def test_a_slice_in_nifti_is_flat(tmp_path):
    """Axes of length one are dropped, with their columns of the affine: places stay those of the scan."""
    affine = np.array([[0, 0.5, 0.1, 3], [2, 0, 0, 4], [0, 0.2, 1, 5], [0, 0, 0, 1.0]])
    image = nibabel.Nifti1Image(BOX[2:3, :, :, None].astype(np.uint8), affine)
    nibabel.save(image, tmp_path / "slice.nii")
    shape = read_volume(tmp_path / "slice.nii")
    assert shape.n_nodes == BOX[2].sum()
    assert shape.affine.shape == (4, shape.ndim + 1) == (4, 3)
    assert np.allclose(shape.affine @ [3, 4, 1], affine @ [0, 3, 4, 1])
    assert shape.spacing == pytest.approx(image.header.get_zooms()[1:3])


def test_time_series_are_refused(tmp_path):
    """As in TIFF, several times are no shape."""
    series = np.repeat(BOX[..., None], 5, axis=3).astype(np.uint8)
    nibabel.save(nibabel.Nifti1Image(series, np.eye(4)), tmp_path / "t.nii")
    with pytest.raises(ReadError, match=r"t.nii: 6 x 7 x 8 x 5 values hold several times or channels"):
        read_volume(tmp_path / "t.nii")


def test_archives_of_other_things_are_refused(tmp_path):
    """Fields and maps that spem wrote are no shapes; one array alone is, whatever its name."""
    np.savez(tmp_path / "F.npz", points=np.ones((9, 2)), values=np.ones((9, 3)), rho=[1, 2, 3], spacing=1)
    with pytest.raises(
        ReadError, match=r"F.npz: no volume among its arrays points, values, rho, spacing; expected one named"
    ):
        read_volume(tmp_path / "F.npz")
    np.savez(tmp_path / "lone.npz", anything=BOX, spacing=0.5)
    assert read_volume(tmp_path / "lone.npz").n_nodes == BOX.sum()


def test_text_called_npy_is_told_without_a_word_of_pickles(tmp_path):
    """The message does not tell the user to load what cannot be trusted."""
    (tmp_path / "a.npy").write_text("1 2 3")
    with pytest.raises(ReadError, match=r"a.npy: damaged, truncated or not a .npy file \(it does not begin"):
        read_volume(tmp_path / "a.npy")


def test_tiff_stacks_are_read_with_their_spacing(tmp_path):
    """ImageJ and OME metadata give the spacing, plain stacks have one."""
    data = BOX.astype(np.uint8) * 255
    tifffile.imwrite(tmp_path / "plain.tif", data, photometric="minisblack")
    assert read_volume(tmp_path / "plain.tif").spacing == (1, 1, 1)
    assert tiff_pages(tmp_path / "plain.tif") == 6
    metadata = {"spacing": 3.0, "unit": "um", "axes": "ZYX"}
    tifffile.imwrite(tmp_path / "ij.tif", data, imagej=True, resolution=(4, 2), metadata=metadata)
    shape = read_volume(tmp_path / "ij.tif")
    assert shape.spacing == (3.0, 0.5, 0.25)
    assert "ImageJ" in shape.report.method
    sizes = {"axes": "ZYX", "PhysicalSizeX": 0.1, "PhysicalSizeY": 0.2, "PhysicalSizeZ": 0.7}
    tifffile.imwrite(tmp_path / "ome.ome.tif", data, metadata=sizes, photometric="minisblack")
    assert read_volume(tmp_path / "ome.ome.tif").spacing == (0.7, 0.2, 0.1)
    assert shape.n_nodes == BOX.sum()


def test_channels_of_a_tiff_are_refused(tmp_path):
    """Several channels are no volume."""
    tifffile.imwrite(
        tmp_path / "c.tif", np.zeros((3, 2, 5, 6), np.uint8), imagej=True, metadata={"axes": "ZCYX"}
    )
    with pytest.raises(ReadError, match="axes ZCYX hold several channels or times"):
        read_volume(tmp_path / "c.tif")


def test_each_label_gives_a_shape(tmp_path):
    """Shapes are named by label and lie where their label lies."""
    np.save(tmp_path / "teeth.npy", LABELS)
    shapes = read_labels(tmp_path / "teeth.npy", spacing=(1.0, 2.0))
    assert [s.name for s in shapes] == ["teeth-3", "teeth-40"]
    assert [s.n_nodes for s in shapes] == [4, 6]
    assert np.allclose(shapes[1].points.min(axis=0), (1, 10))
    np.save(tmp_path / "box.npy", BOX)
    assert [s.name for s in read_labels(tmp_path / "box.npy")] == ["box"]


def test_files_that_are_no_volumes_are_refused_in_one_line(tmp_path):
    """Missing, empty, truncated, pickled and foreign files are told apart."""
    with pytest.raises(ReadError, match=r"absent.npy: no such file"):
        read_volume(tmp_path / "absent.npy")
    (tmp_path / "x.txt").write_text("x")
    with pytest.raises(ReadError, match=r"x.txt: not a volume file; expected one of .npy, .npz"):
        read_volume(tmp_path / "x.txt")
    for name in ("a.npy", "a.npz", "a.tif", "a.nii", "a.nii.gz"):
        (tmp_path / name).touch()
        with pytest.raises(ReadError, match=r"the file is empty \(0 bytes\)"):
            read_volume(tmp_path / name)
        (tmp_path / name).write_bytes(b"no volume at all" * 40)
        with pytest.raises(ReadError, match=r"damaged, truncated or not a \.\w+ file \([^\n]*$"):
            read_volume(tmp_path / name)
    np.save(tmp_path / "a.npy", BOX)
    whole = (tmp_path / "a.npy").read_bytes()
    (tmp_path / "a.npy").write_bytes(whole[:-40])
    with pytest.raises(ReadError, match=r"a.npy: damaged, truncated"):
        read_volume(tmp_path / "a.npy")
    np.save(tmp_path / "p.npy", np.array([{}], object), allow_pickle=True)
    with pytest.raises(ReadError, match=r"p.npy: holds Python objects, which spem never loads"):
        read_volume(tmp_path / "p.npy")
    np.savez(tmp_path / "s.npz", spacing=np.ones(3))
    with pytest.raises(
        ReadError, match="no volume among its arrays spacing; expected one named mask, volume or labels"
    ):
        read_volume(tmp_path / "s.npz")


def test_headers_are_checked_before_the_data_is_read(tmp_path):
    """A header that asks for too much is refused whatever follows it."""
    with (tmp_path / "huge.npy").open("wb") as file:
        header = {"descr": "|u1", "fortran_order": False, "shape": (3000, 3000, 3000)}
        np.lib.format.write_array_header_1_0(file, header)
        file.truncate(3000**3 + 200)
    with pytest.raises(SizeError, match=r"3000 x 3000 x 3000 cells need .* the limit is"):
        read_volume(tmp_path / "huge.npy", memory_limit=1 << 30)
    np.savez_compressed(tmp_path / "z.npz", mask=np.zeros((300, 300, 30), bool))
    nibabel.save(nibabel.Nifti1Image(np.zeros((300, 300, 30), np.uint8), np.eye(4)), tmp_path / "z.nii.gz")
    tifffile.imwrite(tmp_path / "z.tif", np.zeros((30, 300, 300), np.uint8), photometric="minisblack")
    for name in ("z.npz", "z.nii.gz", "z.tif"):
        with pytest.raises(SizeError, match=r"300 cells need|30 cells need"):
            read_volume(tmp_path / name, memory_limit=1 << 20)


def test_every_value_is_a_label_when_told(tmp_path):
    """A segmentation that looks like grey levels or a mask gives one shape a value, if that is asked."""
    grey = np.zeros((4, 9), np.uint8)
    grey[1:3, 1:3], grey[1:3, 5:8] = 7, 255
    np.save(tmp_path / "seg.npy", grey)
    assert [shape.name for shape in read_labels(tmp_path / "seg.npy")] == ["seg"]
    told = read_labels(tmp_path / "seg.npy", per_label=True)
    assert [(shape.name, shape.volume) for shape in told] == [("seg-7", 4.0), ("seg-255", 6.0)]


@pytest.mark.parametrize("values", [[[0.5, 1.0]], [[-1, 2]], [[0, 0]]])
def test_values_that_are_no_labels_are_refused(tmp_path, values):
    """Labels are whole numbers from zero up, not all zero."""
    np.save(tmp_path / "seg.npy", np.asarray(values))
    with pytest.raises(ShapeError, match="seg: its values are no labels"):
        read_labels(tmp_path / "seg.npy", per_label=True)


@pytest.mark.parametrize("spacing", [1e300, 1e-300])
def test_a_spacing_out_of_any_unit_is_refused(tmp_path, spacing):
    """A file whose voxels have a volume that is no number is refused, not filled with infinities."""
    np.savez(tmp_path / "far.npz", mask=np.pad(np.ones((4, 4, 4)), 2), spacing=[spacing] * 3)
    with pytest.raises(ParameterError, match="take another unit"):
        read_volume(tmp_path / "far.npz")


def test_a_header_of_gigabytes_is_refused_before_it_is_read(tmp_path):
    """No room is made for a header that only says it is long."""
    (tmp_path / "long.npy").write_bytes(b"\x93NUMPY\x02\x00\xff\xff\xff\xff{")
    with pytest.raises(ReadError, match="its header says it has 4294967295 bytes"):
        read_volume(tmp_path / "long.npy")


def test_a_giant_spacing_of_an_archive_is_refused_by_its_header(tmp_path):
    """What lies beside the volume is held to the memory limit too."""
    np.savez_compressed(tmp_path / "bomb.npz", mask=np.ones((2, 2)), spacing=np.zeros(100_000))
    with pytest.raises(SizeError, match="100000 cells"):
        read_volume(tmp_path / "bomb.npz", memory_limit=1 << 20)


def test_an_archive_of_many_arrays_is_told_in_short(tmp_path):
    """Names of arrays are listed up to a few, without what a terminal would obey."""
    np.savez(tmp_path / "many.npz", **{f"a\x1b{i}": np.ones(1) for i in range(50)})
    with pytest.raises(ReadError, match=r"a\?0, .* and 42 more") as caught:
        read_volume(tmp_path / "many.npz")
    assert str(caught.value).isprintable()
