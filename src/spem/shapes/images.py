"""Silhouettes out of images: grey level, threshold, polarity, and edges finer than a pixel."""

from __future__ import annotations

import struct
import threading
import zlib
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from PIL import Image, UnidentifiedImageError

from spem.errors import ReadError, ShapeError, SpemError
from spem.shapes.coverage import coverage_cuts, is_coverage
from spem.shapes.levels import border_repairs, level_shape, otsu_level, refuse_non_finite
from spem.shapes.limits import check_file, check_size
from spem.shapes.shape import Cuts, Report, Shape

# Decoded colour, grey level as float32 and as level function, masks: the most held for one pixel.
_BYTES_PER_PIXEL = 24
_LUMINANCE = (0.299, 0.587, 0.114)
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


@dataclass(frozen=True, eq=False)
class _Grey:
    """A scalar image, how it came about, and whether it is opacity, whose polarity is known."""

    level: NDArray[Any]
    method: str
    opacity: bool = False


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
    grey = _scalar(pixels, name)
    return _silhouette(grey, spacing, threshold, dark, name, Report(str(path), repairs=repairs))


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
        When the array is no image, has a single grey level, NaN or no pixel inside.

    Examples
    --------
    >>> image_shape(np.pad(np.zeros((3, 8)), 2, constant_values=1.0)).report.method
    'two grey levels, 0 and 1; dark shape on bright'
    """
    pixels = np.asarray(array)
    if pixels.ndim == 2:
        pixels = pixels[:, :, None]
    if pixels.ndim != 3 or not 1 <= pixels.shape[2] <= 4 or pixels.size == 0:
        msg = f"{name}: an image is (rows, columns) or (rows, columns, 1 to 4), got {np.shape(array)}"
        raise ShapeError(msg)
    check_size(pixels.shape[:2], _BYTES_PER_PIXEL, memory_limit, name)
    return _silhouette(_scalar(pixels, name), spacing, threshold, dark, name, Report("array"))


def _decode(path: Path, memory_limit: int | None) -> tuple[NDArray[Any], tuple[str, ...]]:
    """Return ``(rows, columns, channels)`` pixels of the first frame, and what was done to get them."""
    with _DECODER:
        before, Image.MAX_IMAGE_PIXELS = Image.MAX_IMAGE_PIXELS, None
        try:
            with Image.open(path) as image:
                check_size((image.height, image.width), _BYTES_PER_PIXEL, memory_limit, str(path))
                frames = getattr(image, "n_frames", 1)
                if frames > 1 and image.format == "TIFF":
                    msg = f"{path}: a TIFF of {frames} pages is a volume; read it with read_volume"
                    raise ReadError(msg)
                pixels = _channels(image)
        except SpemError:
            raise
        except UnidentifiedImageError as error:
            msg = f"{path}: not an image that can be decoded; the content does not fit any known format"
            raise ReadError(msg) from error
        except _DAMAGED as error:
            reason = " ".join(str(error).split()) or type(error).__name__
            msg = f"{path}: the image is damaged or truncated ({reason}); export it again"
            raise ReadError(msg) from error
        finally:
            Image.MAX_IMAGE_PIXELS = before
    return pixels, (f"took the first of {frames} frames",) if frames > 1 else ()


def _channels(image: Image.Image) -> NDArray[Any]:
    """Return the pixels of a decoded image: grey, grey and alpha, colour, or colour and alpha."""
    if "transparency" in image.info or image.mode in ("PA", "La", "RGBa"):
        image = image.convert("RGBA")
    elif image.mode not in ("1", "L", "LA", "RGB", "RGBA", "I", "F") and not image.mode.startswith("I;16"):
        image = image.convert("RGB")
    pixels = np.asarray(image)
    return pixels[:, :, None] if pixels.ndim == 2 else pixels


def _scalar(pixels: NDArray[Any], name: str) -> _Grey:
    """Make one number of each pixel: opacity where it varies, else luminance, else the widest channel."""
    refuse_non_finite(pixels, name)
    channels = pixels.shape[2]
    if channels in (2, 4):
        alpha = pixels[:, :, -1]
        if alpha.min() != alpha.max():
            return _Grey(alpha, "opacity", opacity=True)
    if channels < 3:
        return _Grey(pixels[:, :, 0], "grey level")
    colours = [pixels[:, :, c].astype(np.float32) for c in range(3)]
    luminance = sum((w * c for w, c in zip(_LUMINANCE, colours, strict=True)), np.float32(0))
    spans = [float(np.ptp(c)) for c in colours]
    # colours that differ in hue alone leave no edge in the luminance
    if np.ptp(luminance) < 0.2 * max(spans):
        widest = int(np.argmax(spans))
        return _Grey(colours[widest], f"{('red', 'green', 'blue')[widest]} channel, the luminance being flat")
    return _Grey(np.asarray(luminance), "luminance")


def _silhouette(
    grey: _Grey,
    spacing: float | tuple[float, ...],
    threshold: float | None,
    dark: bool | None,
    name: str,
    report: Report,
) -> Shape:
    """Tell inside from outside, and place the edges as finely as the grey levels allow."""
    level = grey.level.astype(np.uint8) if grey.level.dtype == bool else grey.level
    low, high = level.min(), level.max()
    if low == high:
        msg = f"{name}: the image has the single {grey.method} {low:g}, so there is no shape in it"
        raise ShapeError(msg)
    two_valued = bool(((level == low) | (level == high)).all())
    edge = _threshold(level, float(low), float(high), two_valued, threshold, name)
    bright = level > edge
    dark = _shape_is_dark(bright, grey.opacity) if dark is None else dark
    polarity = _polarity(grey, dark)
    if two_valued:
        report = _with_method(report, f"two {grey.method}s, {low:g} and {high:g}; {polarity}")
        return _crisp(bright ^ dark, Cuts.none(), spacing, name, report)
    if threshold is None:
        coverage, middle = _coverage(level, bright, dark)
        inside = coverage > 0.5
        if inside.any() and is_coverage(coverage, inside):
            method = f"{grey.method} over {middle:.4g} (midway); {polarity}; edges by area coverage"
            cuts = coverage_cuts(coverage, inside)
            return _crisp(inside, cuts, spacing, name, _with_method(report, method))
    how = "Otsu" if threshold is None else "given"
    method = f"{grey.method} over {edge:.4g} ({how}); {polarity}; edges by interpolation"
    signed = level.astype(np.float32) - np.float32(edge)
    return level_shape(-signed if dark else signed, spacing, name=name, report=_with_method(report, method))


def _threshold(
    level: NDArray[Any], low: float, high: float, two_valued: bool, given: float | None, name: str
) -> float:
    """Return the grey level of the edge, so that some pixels lie on either side."""
    if given is not None:
        if not low <= given < high:
            msg = (
                f"{name}: threshold={given:g} has all pixels on one side; grey levels run {low:g} to {high:g}"
            )
            raise ShapeError(msg)
        return float(given)
    return (low + high) / 2 if two_valued else otsu_level(level)


def _shape_is_dark(bright: NDArray[np.bool_], opacity: bool) -> bool:
    """Take what most of the border is for background; most of the image where the border is even."""
    if opacity:
        return False
    border = np.concatenate([bright[0], bright[-1], bright[1:-1, 0], bright[1:-1, -1]])
    share = border.mean()
    return bool(share > 0.5 or (share == 0.5 and bright.mean() > 0.5))


def _polarity(grey: _Grey, dark: bool) -> str:
    """Say which side is the shape."""
    if grey.opacity:
        return "transparent shape" if dark else "opaque shape"
    return "dark shape on bright" if dark else "bright shape on dark"


def _coverage(
    level: NDArray[Any], bright: NDArray[np.bool_], dark: bool
) -> tuple[NDArray[np.float32], float]:
    """Scale grey levels to 0 on the background and 1 on the shape; return them and the middle level."""
    # medians, since ringing and noise spread the levels about the two that are meant
    lower, upper = (float(np.median(level[side])) for side in (~bright, bright))
    share = (level.astype(np.float32) - np.float32(lower)) / np.float32(upper - lower)
    return (1 - share if dark else share), (lower + upper) / 2


def _crisp(
    inside: NDArray[np.bool_], cuts: Cuts, spacing: float | tuple[float, ...], name: str, report: Report
) -> Shape:
    """Make the shape, with the padding in its report."""
    return Shape.from_mask(
        inside, spacing, name=name, cuts=cuts, report=report.with_repair(*border_repairs(inside))
    )


def _with_method(report: Report, method: str) -> Report:
    """Return the report with the method filled in."""
    return Report(report.source, method, repairs=report.repairs)
