"""Silhouettes out of images: grey level, threshold, polarity, and edges finer than a pixel."""

from __future__ import annotations

import math
import struct
import threading
import zlib
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from PIL import ExifTags, Image, ImageOps, UnidentifiedImageError

from spem.errors import ReadError, ShapeError, SpemError
from spem.shapes.coverage import coverage_cuts, is_coverage
from spem.shapes.grey import Grey, grey_levels
from spem.shapes.levels import border_repairs, level_shape, otsu_level, refuse_masked
from spem.shapes.limits import check_file, check_size, printable
from spem.shapes.shape import Cuts, Report, Shape

# Decoded colour, grey level as float32 and as level function, masks: the most held for one pixel.
_BYTES_PER_PIXEL = 24
# What is decoded, whatever the suffix; of the others that Pillow knows some start programs.
_FORMATS = ("PNG", "GIF", "JPEG", "BMP", "DIB", "TIFF", "WEBP", "PPM")
# What decoders raise on damaged files.
_DAMAGED = (
    OSError,
    SyntaxError,
    ValueError,
    EOFError,
    IndexError,
    KeyError,
    TypeError,
    struct.error,
    zlib.error,
)
# The limit of the decoder is a global; ours stands in for it while a file is opened and, since TIFF and
# others ask for it again there, while it is decoded.
_DECODER = threading.Lock()


def read_image(
    path: str | Path,
    *,
    spacing: float | tuple[float, ...] = 1.0,
    threshold: float | None = None,
    dark: bool | None = None,
    memory_limit: int | None = None,
    name: str | None = None,
) -> Shape:
    """Read a silhouette from an image file: PNG, GIF, JPEG, TIFF, BMP, WebP, PNM.

    It is turned as its EXIF orientation says. Opacity is the shape where it parts one from its
    ground; else what is not solid is put on white.

    Parameters
    ----------
    path
        The file.
    spacing
        Distance between pixel centres.
    threshold
        Grey level of the edge; by default midway between the two values of a two-valued image,
        and by Otsu's method for others.
    dark
        Whether the shape is darker than the background; by default told from the border.
    memory_limit
        Bytes; None for SPEM_MEMORY_LIMIT or 2 GiB.
    name
        Name of the shape; the file's by default.

    Raises
    ------
    ReadError
        When the file is missing, empty, damaged or no image.
    SizeError
        When decoding would pass the memory limit; told from the file's header.
    ShapeError
        When the image has a single grey level or no pixel lies inside.

    Examples
    --------
    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     file = Path(folder, "bar.png")
    ...     Image.fromarray(np.pad(np.full((3, 8), 255, np.uint8), 2)).save(file)
    ...     read_image(file)
    Shape('bar', 2-D, 24 nodes, grid 5 x 10, spacing 1 x 1)
    """
    path = Path(path)
    check_file(path)
    pixels, repairs = _decode(path, memory_limit)
    name = name or path.stem
    report = Report(str(path), repairs=repairs)
    return _silhouette(grey_levels(pixels, name), spacing, threshold, dark, name, report)


def image_shape(
    array: ArrayLike,
    *,
    spacing: float | tuple[float, ...] = 1.0,
    threshold: float | None = None,
    dark: bool | None = None,
    memory_limit: int | None = None,
    name: str = "image",
) -> Shape:
    """Make a silhouette of the pixels of an image.

    Opacity is the shape where it parts one from its ground; else what is not solid is put on white.

    Parameters
    ----------
    array
        ``(n_0, n_1)`` grey or boolean, or ``(n_0, n_1, c)`` with c = 1 to 4: grey, grey and alpha,
        colour, colour and alpha.
    spacing
        Distance between pixel centres.
    threshold
        Grey level of the edge; midway for two values, by Otsu's method for more.
    dark
        Whether the shape is darker than the background; by default told from the border.
    memory_limit
        Bytes; None for SPEM_MEMORY_LIMIT or 2 GiB.
    name
        Short name.

    Raises
    ------
    ShapeError
        When the array is no image, has a single grey level, NaN, masked entries or no pixel inside.

    Examples
    --------
    >>> image_shape(np.pad(np.zeros((3, 8)), 2, constant_values=1.0)).report.method
    'two grey levels, 0 and 1; dark shape on bright'
    """
    refuse_masked(array, name)
    pixels = np.asarray(array)
    if pixels.ndim == 2:
        pixels = pixels[:, :, None]
    if pixels.ndim != 3 or not 1 <= pixels.shape[2] <= 4 or pixels.size == 0:
        msg = f"{name}: an image is (rows, columns) or (rows, columns, 1 to 4), got {np.shape(array)}"
        raise ShapeError(msg)
    check_size(pixels.shape[:2], _BYTES_PER_PIXEL, memory_limit, name)
    return _silhouette(grey_levels(pixels, name), spacing, threshold, dark, name, Report("array"))


def _decode(path: Path, memory_limit: int | None) -> tuple[NDArray[Any], tuple[str, ...]]:
    """Return ``(rows, columns, channels)`` pixels of the first frame, and what was done to get them."""
    with _DECODER:
        before, Image.MAX_IMAGE_PIXELS = Image.MAX_IMAGE_PIXELS, None
        try:
            with Image.open(path, formats=_FORMATS) as image:
                check_size((image.height, image.width), _BYTES_PER_PIXEL, memory_limit, str(path))
                frames = getattr(image, "n_frames", 1)
                if frames > 1 and image.format == "TIFF":
                    msg = f"{path}: a TIFF of {frames} pages is a volume; read it with read_volume"
                    raise ReadError(msg)
                upright, turned = _upright(image)
                pixels = _channels(upright)
        except SpemError:
            raise
        except UnidentifiedImageError as error:
            msg = f"{path}: not an image that can be decoded; the content does not fit any known format"
            raise ReadError(msg) from error
        except _DAMAGED as error:
            msg = f"{path}: the image is damaged or truncated ({printable(error)}); export it again"
            raise ReadError(msg) from error
        finally:
            Image.MAX_IMAGE_PIXELS = before
    return pixels, ((f"took the first of {frames} frames",) if frames > 1 else ()) + turned


def _upright(image: Image.Image) -> tuple[Image.Image, tuple[str, ...]]:
    """Return an image turned as its EXIF orientation says, and the phrase of the report about it."""
    try:
        # asked before the image is loaded, since a TIFF is turned by that
        orientation = image.getexif().get(ExifTags.Base.Orientation, 1)
    except _DAMAGED:
        return image, ()
    if orientation not in range(2, 9):
        return image, ()
    image.load()
    return ImageOps.exif_transpose(image), (f"turned as its EXIF orientation {orientation} says",)


def _channels(image: Image.Image) -> NDArray[Any]:
    """Return the pixels of a decoded image: grey, grey and alpha, colour, or colour and alpha."""
    if "transparency" in image.info or image.mode in ("PA", "La", "RGBa"):
        image = image.convert("RGBA")
    elif image.mode not in ("1", "L", "LA", "RGB", "RGBA", "I", "F") and not image.mode.startswith("I;16"):
        image = image.convert("RGB")
    pixels = np.asarray(image)
    return pixels[:, :, None] if pixels.ndim == 2 else pixels


def _silhouette(
    grey: Grey,
    spacing: float | tuple[float, ...],
    threshold: float | None,
    dark: bool | None,
    name: str,
    report: Report,
) -> Shape:
    """Tell inside from outside, and place the edges as finely as the grey levels allow."""
    level, report = grey.level, report.with_repair(*grey.repairs)
    low, high = float(level.min()), float(level.max())
    if low == high:
        only = f"{grey.noun} {grey.of_image(low):g}"
        msg = f"{name}: the image has the single {only}, so there is no shape in it"
        raise ShapeError(msg)
    two_valued = bool(((level == low) | (level == high)).all())
    edge = _threshold(grey, low, high, two_valued, threshold, name)
    bright = level == high if two_valued else level > edge
    dark = _shape_is_dark(bright, grey.opacity) if dark is None else dark
    polarity = _polarity(grey, dark)
    if two_valued:
        found = f"two {grey.plural}, {grey.of_image(low):g} and {grey.of_image(high):g}"
        return _crisp(bright ^ dark, Cuts.none(), spacing, name, _with_method(report, found, polarity))
    if threshold is None:
        coverage, middle = _coverage(level, bright, dark)
        inside = coverage > 0.5
        if inside.any() and is_coverage(coverage, inside):
            found = f"{grey.noun} over {grey.of_image(middle):.4g} (midway)"
            cuts = coverage_cuts(coverage, inside)
            report = _with_method(report, found, polarity, "edges by area coverage")
            return _crisp(inside, cuts, spacing, name, report)
    how = "Otsu" if threshold is None else "given"
    found = f"{grey.noun} over {grey.of_image(edge):.4g} ({how})"
    signed = level.astype(np.result_type(np.float32, level.dtype)) - edge
    report = _with_method(report, found, polarity, "edges by interpolation")
    return level_shape(-signed if dark else signed, spacing, name=name, report=report)


def _threshold(
    grey: Grey, low: float, high: float, two_valued: bool, given: float | None, name: str
) -> float:
    """Return the grey level of the edge, so that some pixels lie on either side."""
    if given is None:
        return (low + high) / 2 if two_valued else otsu_level(grey.level)
    least, most = grey.of_image(low), grey.of_image(high)
    if not least <= given < most:
        msg = f"{name}: threshold={given:g} has all pixels on one side; grey levels run {least:g} to {most:g}"
        raise ShapeError(msg)
    return math.ldexp(given, -grey.exponent)


def _shape_is_dark(bright: NDArray[np.bool_], opacity: bool) -> bool:
    """Take what most of the border is for background; most of the image where the border is even."""
    if opacity:
        return False
    border = np.concatenate([bright[0], bright[-1], bright[1:-1, 0], bright[1:-1, -1]])
    share = border.mean()
    return bool(share > 0.5 or (share == 0.5 and bright.mean() > 0.5))


def _polarity(grey: Grey, dark: bool) -> str:
    """Say which side is the shape, and why it was told by these levels."""
    if grey.opacity:
        return "transparent shape" if dark else "opaque shape"
    side = "dark shape on bright" if dark else "bright shape on dark"
    return f"{grey.note}; {side}" if grey.note else side


def _coverage(
    level: NDArray[Any], bright: NDArray[np.bool_], dark: bool
) -> tuple[NDArray[np.floating], float]:
    """Scale grey levels to 0 on the background and 1 on the shape; return them and the middle level."""
    # medians, since ringing and noise spread the levels about the two that are meant
    lower, upper = (float(np.median(level[side])) for side in (~bright, bright))
    share = (level.astype(np.result_type(np.float32, level.dtype)) - lower) / (upper - lower)
    return (1 - share if dark else share), (lower + upper) / 2


def _crisp(
    inside: NDArray[np.bool_], cuts: Cuts, spacing: float | tuple[float, ...], name: str, report: Report
) -> Shape:
    """Make the shape, with the padding in its report."""
    return Shape.from_mask(
        inside, spacing, name=name, cuts=cuts, report=report.with_repair(*border_repairs(inside))
    )


def _with_method(report: Report, *phrases: str) -> Report:
    """Return the report with the method filled in."""
    return replace(report, method="; ".join(phrases))
