"""Silhouettes out of images."""

from __future__ import annotations

import struct
import zlib

import numpy as np
import pytest
from PIL import Image

from spem.errors import ParameterError, ReadError, ShapeError, SizeError
from spem.shapes.images import image_shape, read_image

BAR = np.zeros((12, 16), bool)
BAR[3:9, 4:13] = True


def disk(n=64, radius=20.3, centre=(30.2, 33.7)):
    """Area coverage of a disk, and its area."""
    x = (np.arange(n * 8) + 0.5) / 8 - 0.5
    fine = (x[:, None] - centre[0]) ** 2 + (x - centre[1]) ** 2 < radius**2
    return fine.reshape(n, 8, n, 8).mean(axis=(1, 3)), np.pi * radius**2


def colours(values):
    """Three equal channels."""
    return np.repeat(np.asarray(values)[:, :, None], 3, axis=2)


def bar_image(mode):
    """Make the bar as an image of a mode, dark on bright for half of them."""
    bright = np.where(BAR, 255, 0).astype(np.uint8)
    images = {
        "1": lambda: Image.fromarray(BAR),
        "L": lambda: Image.fromarray(255 - bright),
        "P": lambda: Image.fromarray(255 - bright).convert("P"),
        "RGB": lambda: Image.fromarray(colours(bright)),
        "RGBA": lambda: Image.fromarray(np.dstack([colours(255 - bright), np.full_like(bright, 255)])),
        "alpha": lambda: Image.fromarray(np.dstack([colours(np.zeros_like(bright)), bright])),
        "LA": lambda: Image.fromarray(np.dstack([np.zeros_like(bright), bright]), "LA"),
        "I;16": lambda: Image.fromarray(bright.astype(np.uint16) * 200),
    }
    return images[mode]()


MODES = ("1", "L", "P", "RGB", "RGBA", "alpha", "LA", "I;16")


@pytest.mark.filterwarnings("ignore:'mode' parameter is deprecated")
@pytest.mark.parametrize("mode", MODES)
def test_every_kind_of_pixel_gives_the_same_shape(tmp_path, mode):
    """One bit, grey, palette, colour, opacity and sixteen bits all mean the same bar."""
    path = tmp_path / "bar.png"
    bar_image(mode).save(path)
    shape = read_image(path)
    assert shape.name == "bar"
    assert shape.n_nodes == BAR.sum()
    assert shape.origin == (2, 3)
    assert len(shape.cuts) == 0
    assert shape.report.source == str(path)


@pytest.mark.parametrize("suffix", ["png", "gif", "bmp", "tif", "tiff", "webp", "pgm"])
def test_every_lossless_file_gives_the_same_shape(tmp_path, suffix):
    """The kind of file does not matter."""
    path = tmp_path / f"bar.{suffix}"
    kwargs = {"lossless": True} if suffix == "webp" else {}
    bar_image("L").save(path, **kwargs)
    assert read_image(path).n_nodes == BAR.sum()


def test_a_transparent_palette_colour_is_background(tmp_path):
    """A GIF whose background is transparent is told by its opacity."""
    path = tmp_path / "clear.gif"
    image = Image.new("P", (16, 12), 0)
    image.putpalette([9, 9, 9, 9, 9, 9])
    image.paste(1, (4, 3, 13, 9))
    image.save(path, transparency=0)
    shape = read_image(path)
    assert shape.n_nodes == BAR.sum()
    assert "opaque shape" in shape.report.method


def test_opacity_that_parts_no_shape_from_its_ground_does_not_hide_the_drawing():
    """A clear corner or a solid pixel among nearly solid ones leaves a black bar on white as it is."""
    drawing = colours(np.where(BAR, 0, 255).astype(np.uint8))
    corner = np.full(BAR.shape, 255, np.uint8)
    corner[0, 0] = 0
    nearly = np.full(BAR.shape, 254, np.uint8)
    nearly[5, 5] = 255
    for alpha in (corner, nearly):
        shape = image_shape(np.dstack([drawing, alpha]))
        assert shape.n_nodes == BAR.sum()
        assert "dark shape on bright" in shape.report.method
        assert shape.report.repairs == ("put on white by its opacity",)


def test_opacity_is_taken_where_it_alone_tells_the_shape():
    """Of one colour, whatever of it reaches the border; half transparent; or white on nothing."""
    wide = np.ones((12, 16), bool)
    wide[:3, :3] = wide[-3:, -3:] = False
    for inside, solid, colour in ((BAR, 255, 255), (BAR, 128, 255), (wide, 255, 0), (wide, 255, 200)):
        alpha = np.where(inside, solid, 0).astype(np.uint8)
        shape = image_shape(np.dstack([colours(np.full_like(alpha, colour)), alpha]))
        assert shape.n_nodes == inside.sum()
        assert shape.report.method == f"two opacities, 0 and {solid}; opaque shape"


@pytest.mark.parametrize("kind", [np.uint16, np.float32, np.float64])
def test_opacity_has_the_scale_of_its_numbers(kind):
    """Sixteen bits and shares of one put a half transparent bar on white alike."""
    top = 65535 if kind is np.uint16 else 1
    alpha = np.where(BAR, top, top * 0.5).astype(kind)
    shape = image_shape(np.dstack([np.zeros_like(alpha), alpha]))
    assert shape.n_nodes == BAR.sum()
    assert "dark shape on bright" in shape.report.method


def test_masked_pixels_are_refused():
    """A mask is not dropped in silence; one that masks nothing is no mask."""
    pixels = np.ma.masked_array(BAR.astype(float), mask=np.zeros_like(BAR))
    assert image_shape(pixels).n_nodes == BAR.sum()
    pixels[2, 3] = np.ma.masked
    with pytest.raises(ShapeError, match=r"image: 1 of 192 values are masked, the first at \[2, 3\]; give"):
        image_shape(pixels)


@pytest.mark.parametrize("suffix", ["jpg", "png", "tif", "webp"])
@pytest.mark.parametrize("orientation", [3, 6, 7])
def test_exif_orientation_is_honoured(tmp_path, suffix, orientation):
    """A shape stands as a viewer shows it, and the report says that it was turned."""
    path = tmp_path / f"turned.{suffix}"
    tall = np.zeros((16, 24), bool)
    tall[1:9, 2:20] = tall[9:12, 2:6] = True
    image = Image.fromarray(np.where(tall, 255, 0).astype(np.uint8)).convert("RGB")
    exif = Image.Exif()
    exif[0x0112] = orientation
    image.save(path, exif=exif, **({"lossless": True} if suffix == "webp" else {}))
    shape = read_image(path)
    upright = {3: tall[::-1, ::-1], 6: np.rot90(tall, -1), 7: tall[::-1, ::-1].T}[orientation]
    assert np.array_equal(shape.mask[1:-1, 1:-1], upright[upright.any(1)][:, upright.any(0)])
    assert shape.report.repairs == (f"turned as its EXIF orientation {orientation} says",)


@pytest.mark.parametrize(("kind", "top"), [(float, 1.7e308), (float, 1e-320), ("f4", 3e38), ("f2", 6e4)])
def test_grey_levels_of_any_size_are_told_apart(kind, top):
    """Neither huge nor tiny floating point numbers overflow, and the method has them as they are."""
    coverage, area = disk()
    shape = image_shape(((2 * coverage - 1) * top).astype(kind))
    assert shape.volume == pytest.approx(area, rel=0.005)
    assert "area coverage" in shape.report.method
    shape = image_shape(((2 * coverage - 1) * top).astype(kind), threshold=top / 2)
    assert f"over {top / 2:.4g} (given)" in shape.report.method
    assert image_shape((BAR * top).astype(kind)).n_nodes == BAR.sum()


def test_polarity_is_told_from_the_border_and_can_be_given():
    """Most of the border is background, whichever way round; an argument overrides."""
    for pixels in (BAR, ~BAR):
        assert image_shape(pixels).n_nodes == BAR.sum()
    assert image_shape(BAR, dark=True).n_nodes == (~BAR).sum()
    assert image_shape(~BAR, dark=False).n_nodes == (~BAR).sum()
    cropped = BAR[3:, 4:9]
    assert image_shape(cropped, dark=False).report.repairs == (
        "touched the border of the array on axis 0, 1: padded",
    )


def test_a_border_of_two_halves_falls_back_to_the_larger_side():
    """When the border does not tell, the smaller side of the image is the shape."""
    pixels = np.array([[1, 1, 1, 0, 0, 0]] * 6)
    pixels[2:4, 2] = 0
    assert image_shape(pixels).n_nodes == pixels.sum()


@pytest.mark.parametrize("bits", [8, 16, 0])
@pytest.mark.parametrize("dark", [False, True])
def test_grey_edges_give_cuts_within_a_hundredth_of_a_pixel(bits, dark):
    """Area coverage at any depth places the circle far below a pixel."""
    coverage, _ = disk()
    top = 2**bits - 1 if bits else 1.0
    pixels = np.round(coverage * top) if bits else coverage
    pixels = (top - pixels) if dark else pixels
    pixels = pixels.astype({8: np.uint8, 16: np.uint16, 0: float}[bits])
    shape = image_shape(pixels)
    assert "area coverage" in shape.report.method
    place = np.stack(np.unravel_index(shape.cuts.voxel, shape.mask.shape), axis=1).astype(float)
    step = np.where(shape.cuts.direction % 2, 1.0, -1.0) * shape.cuts.fraction
    place[np.arange(len(place)), shape.cuts.direction // 2] += step
    error = np.linalg.norm(place + shape.origin - (30.2, 33.7), axis=1) - 20.3
    assert np.sqrt(np.mean(error**2)) < 0.02


def test_jpeg_keeps_the_disk(tmp_path):
    """Compression moves the edge of a disk by little, and its area by less than one part in a hundred."""
    coverage, area = disk()
    path = tmp_path / "disk.jpg"
    Image.fromarray(np.round(255 * (1 - coverage)).astype(np.uint8)).save(path, quality=60)
    assert read_image(path).volume == pytest.approx(area, rel=0.01)


def test_a_given_threshold_is_the_level_of_the_edge():
    """Grey levels are interpolated about a threshold that is given."""
    ramp = np.tile(np.linspace(0, 200, 21), (5, 1))
    shape = image_shape(ramp, threshold=56.0, dark=False)
    assert shape.cuts.fraction == pytest.approx(np.full(5, 0.4))
    with pytest.raises(
        ShapeError, match="threshold=300 has all pixels on one side; grey levels run 0 to 200"
    ):
        image_shape(ramp, threshold=300)


def test_colours_of_one_luminance_are_told_by_their_widest_channel():
    """Red on green of equal luminance still has an edge."""
    pixels = np.zeros((12, 16, 3), np.uint8)
    pixels[~BAR] = (0, 130, 0)
    pixels[BAR] = (255, 0, 0)
    shape = image_shape(pixels)
    assert shape.n_nodes == BAR.sum()
    assert "levels of the red channel, 0 and 255; luminance is flat; bright shape" in shape.report.method


def test_the_first_frame_of_an_animation_is_taken(tmp_path):
    """An animated GIF gives its first frame, and the report says so."""
    path = tmp_path / "moving.gif"
    frames = [Image.fromarray(np.where(np.roll(BAR, k, axis=1), 255, 0).astype(np.uint8)) for k in range(3)]
    frames[0].save(path, save_all=True, append_images=frames[1:])
    shape = read_image(path)
    assert shape.n_nodes == BAR.sum()
    assert shape.report.repairs == ("took the first of 3 frames",)


def test_a_tiff_of_many_pages_is_sent_to_the_volumes(tmp_path):
    """A stack is no image."""
    path = tmp_path / "stack.tif"
    page = Image.fromarray(BAR)
    page.save(path, save_all=True, append_images=[page, page])
    with pytest.raises(ReadError, match="a TIFF of 3 pages is a volume; read it with read_volume"):
        read_image(path)


@pytest.mark.parametrize("pixels", [np.zeros((4, 4)), np.full((4, 4, 3), 7, np.uint8)])
def test_an_image_of_one_value_has_no_shape(pixels):
    """A blank image is refused."""
    with pytest.raises(ShapeError, match=r"has the single .* so there is no shape"):
        image_shape(pixels)


def test_arrays_that_are_no_image_are_refused():
    """Dimensions and values are checked."""
    with pytest.raises(ShapeError, match=r"an image is \(rows, columns\).*got \(2, 2, 7\)"):
        image_shape(np.ones((2, 2, 7)))
    with pytest.raises(ShapeError, match=r"1 of 4 values are NaN or infinite, the first at \[0, 1, 0\]"):
        image_shape(np.array([[1.0, np.nan], [0.0, 2.0]]))


def png_header(width, height):
    """Write the start of a PNG of a size, with next to no pixels."""

    def chunk(kind, body):
        return struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(kind + body))

    header = struct.pack(">IIBBBBB", width, height, 8, 0, 0, 0, 0)
    body = zlib.compress(b"\0" * 100)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", body) + chunk(b"IEND", b"")


def test_a_huge_image_is_refused_by_its_header(tmp_path, monkeypatch):
    """Nothing is decoded when the header asks for more memory than the limit."""
    monkeypatch.delenv("SPEM_MEMORY_LIMIT", raising=False)
    pixels, path = Image.MAX_IMAGE_PIXELS, tmp_path / "huge.png"
    path.write_bytes(png_header(60_000, 60_000))
    with pytest.raises(SizeError, match=r"huge.png: 60000 x 60000 cells need 80.5 GiB, the limit is 2 GiB"):
        read_image(path)
    path.write_bytes(png_header(10_000, 9_500))
    with pytest.raises(SizeError, match=r"9500 x 10000 cells need .* the limit is 1 KiB"):
        read_image(path, memory_limit=1024)
    with pytest.raises(ReadError, match="damaged or truncated"):
        read_image(path, memory_limit=1 << 40)
    assert pixels == Image.MAX_IMAGE_PIXELS


def test_a_wrong_limit_is_no_damage(tmp_path, monkeypatch):
    """What is wrong with the memory limit is said, not that the image is damaged."""
    path = tmp_path / "bar.png"
    Image.fromarray(np.eye(5, dtype=bool)).save(path)
    with pytest.raises(ParameterError, match="memory_limit=-1: expected a positive number of bytes"):
        read_image(path, memory_limit=-1)
    monkeypatch.setenv("SPEM_MEMORY_LIMIT", "lots")
    with pytest.raises(ParameterError, match="SPEM_MEMORY_LIMIT='lots': expected a positive size"):
        read_image(path)


def test_files_that_are_no_images_are_refused_in_one_line(tmp_path):
    """Missing, empty, truncated and foreign files are told apart, without a dump of the decoder."""
    path = tmp_path / "bad.png"
    with pytest.raises(ReadError, match=r"bad.png: no such file"):
        read_image(path)
    path.touch()
    with pytest.raises(ReadError, match=r"bad.png: the file is empty"):
        read_image(path)
    path.write_text("no image at all")
    with pytest.raises(ReadError, match=r"bad.png: not an image that can be decoded; [^\n]*$"):
        read_image(path)
    coverage, _ = disk()
    for suffix in ("png", "jpg", "gif", "bmp"):
        whole = tmp_path / f"whole.{suffix}"
        Image.fromarray(np.round(255 * coverage).astype(np.uint8)).save(whole)
        whole.write_bytes(whole.read_bytes()[: whole.stat().st_size // 2])
        with pytest.raises(ReadError, match=rf"whole.{suffix}: the image is damaged or truncated \([^\n]*$"):
            read_image(whole)


@pytest.mark.data
@pytest.mark.parametrize(
    ("folder", "count", "dark"), [("kimia99", 99, True), ("kimia216", 216, True), ("tari1000", 1000, False)]
)
def test_polarity_is_right_on_all_real_silhouettes(data_dir, folder, count, dark):
    """Each collection is of one polarity, and every file is read so."""
    if not (data_dir / folder).is_dir():
        pytest.skip(f"{folder} is absent from {data_dir}")
    files = sorted(p for p in (data_dir / folder).iterdir() if p.suffix.lower() in (".png", ".gif"))
    assert len(files) == count
    polarity = "dark shape on bright" if dark else "bright shape on dark"
    assert all(polarity in read_image(path).report.method for path in files)


def test_formats_that_start_programs_are_not_decoded(tmp_path):
    """PostScript, which Pillow hands to an interpreter, is no image whatever its suffix."""
    (tmp_path / "page.png").write_bytes(b"%!PS-Adobe-3.0 EPSF-3.0\n%%BoundingBox: 0 0 9 9\nquit\n")
    with pytest.raises(ReadError, match="not an image that can be decoded"):
        read_image(tmp_path / "page.png")
