"""One number for each pixel of an image: its opacity, its luminance or a channel."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spem.shapes.levels import refuse_non_finite

_LUMINANCE = (0.299, 0.587, 0.114)
# Opacity within this part of the scale of either end is meant to be clear or solid.
_END = 0.02
# What spans less than this part of the scale is noise of compression, and tells nothing.
_NOISE = 0.1
# Grey levels beyond these overflow or vanish in single precision.
_SMALLEST, _LARGEST = 1e-30, 1e30


@dataclass(frozen=True, eq=False)
class Grey:
    """A scalar image and how it came about.

    Parameters
    ----------
    level
        ``(rows, columns)`` numbers, none of them boolean; times 2 ** `exponent` they are those of
        the image.
    noun, plural
        What the numbers are called.
    note
        Why they were taken rather than others, or nothing.
    opacity
        Whether they are opacity, whose polarity is known.
    exponent
        Other than 0 where the numbers of the image are out of the range of single precision.
    repairs
        What was changed, one phrase each.
    """

    level: NDArray[Any]
    noun: str = "grey level"
    plural: str = "grey levels"
    note: str = ""
    opacity: bool = False
    exponent: int = 0
    repairs: tuple[str, ...] = ()

    def of_image(self, level: float) -> float:
        """Return a level as the image has it."""
        return math.ldexp(level, self.exponent)


def grey_levels(pixels: NDArray[Any], name: str) -> Grey:
    """Make one number of each pixel: opacity where it tells a shape, else luminance or the widest channel.

    Opacity tells a shape where most pixels are clear or solid, and either most of the border is
    clear or the solid pixels are of one colour. Else what is not solid is put on white.

    Parameters
    ----------
    pixels
        ``(rows, columns, c)`` with c = 1 to 4: grey, grey and alpha, colour, colour and alpha.
    name
        Name of the image, for the message.

    Raises
    ------
    ShapeError
        When a value is NaN or infinite.

    Examples
    --------
    >>> drawing = np.zeros((4, 4, 2), np.uint8)
    >>> drawing[1:3, 1:3, 1] = 255
    >>> grey_levels(drawing, "drawing").noun
    'opacity'
    """
    refuse_non_finite(pixels, name)
    pixels, exponent = _in_range(pixels.astype(np.uint8) if pixels.dtype == bool else pixels)
    if pixels.shape[2] in (1, 3):
        return _of_colours(pixels, exponent)
    colours, alpha = pixels[:, :, :-1], pixels[:, :, -1]
    if alpha.min() == alpha.max():
        return _of_colours(colours, exponent)
    white = _full_scale(pixels)
    opacity = Grey(alpha, "opacity", "opacities", opacity=True, exponent=exponent)
    if _separates(colours, alpha, white):
        return opacity
    grey = _of_colours(_on_white(colours, alpha, white), exponent, ("put on white by its opacity",))
    # something white on nothing
    return opacity if not np.ptp(grey.level) and np.ptp(alpha) > _NOISE * white else grey


def _on_white(colours: NDArray[Any], alpha: NDArray[Any], white: float) -> NDArray[np.floating]:
    """Return colours as they are seen on white; in place, since images may be large."""
    real = np.result_type(np.float32, colours.dtype)
    seen, share = colours.astype(real), alpha.astype(real)
    share /= white
    seen -= white
    seen *= share[:, :, None]
    seen += white
    return seen


def _of_colours(colours: NDArray[Any], exponent: int, repairs: tuple[str, ...] = ()) -> Grey:
    """Take the grey level, the luminance or the widest channel."""
    if colours.shape[2] == 1:
        return Grey(colours[:, :, 0], exponent=exponent, repairs=repairs)
    real = np.result_type(np.float32, colours.dtype)
    channels = [colours[:, :, c].astype(real, copy=False) for c in range(3)]
    luminance = sum((w * c for w, c in zip(_LUMINANCE, channels, strict=True)), real.type(0))
    spans = [float(np.ptp(c)) for c in channels]
    # colours that differ in hue alone leave no edge in the luminance
    if np.ptp(luminance) < 0.2 * max(spans):
        widest = int(np.argmax(spans))
        where = f"of the {('red', 'green', 'blue')[widest]} channel"
        note = "luminance is flat"
        return Grey(channels[widest], f"level {where}", f"levels {where}", note, False, exponent, repairs)
    return Grey(np.asarray(luminance), "luminance", "luminances", exponent=exponent, repairs=repairs)


def _separates(colours: NDArray[Any], alpha: NDArray[Any], white: float) -> bool:
    """Tell whether opacity parts a shape from its ground."""
    clear, solid = alpha <= _END * white, alpha >= (1 - _END) * white
    if not clear.any() or not solid.any() or clear.mean() + solid.mean() < 0.5:
        return False
    border = np.concatenate([clear[0], clear[-1], clear[1:-1, 0], clear[1:-1, -1]])
    if border.mean() > 0.5:
        return True
    drawn = colours[solid]
    return bool((drawn.max(axis=0).astype(float) - drawn.min(axis=0) <= _NOISE * white).all())


def _full_scale(pixels: NDArray[Any]) -> float:
    """Return the number that stands for white, and for solid."""
    if pixels.dtype in (np.uint8, np.uint16):
        return float(np.iinfo(pixels.dtype).max)
    top = float(pixels.max())
    return next((scale for scale in (1.0, 255.0, 65535.0) if top <= scale), top)


def _in_range(pixels: NDArray[Any]) -> tuple[NDArray[Any], int]:
    """Return numbers that single precision holds well, and the power of two that they were divided by."""
    if pixels.dtype.kind != "f":
        return pixels, 0
    top = float(max(abs(pixels.min()), abs(pixels.max())))
    if top == 0 or _SMALLEST < top < _LARGEST:
        return pixels, 0
    exponent = math.frexp(top)[1]
    return np.ldexp(pixels, -exponent), exponent
