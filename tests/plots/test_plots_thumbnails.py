"""Small pictures show the shape as it is coded."""

from __future__ import annotations

from dataclasses import replace
from io import BytesIO

import numpy as np
import pytest
from PIL import Image

from spem.plots import thumbnails
from spem.plots.thumbnails import thumbnail
from spem.shapes.shape import Report, Shape
from spem.shapes.surface import Surface


def cover(shape: Shape) -> float:
    """Return the share of the picture that a shape covers."""
    return float(np.asarray(Image.open(BytesIO(thumbnail(shape))))[..., 3].mean() / 255)


@pytest.mark.parametrize("ndim", [2, 3])
def test_fine_grids_are_pictured_as_coarse_ones(monkeypatch: pytest.MonkeyPatch, ndim: int) -> None:
    """The quick way to the outline of a fine grid covers what the exact one does, to two percent."""
    grid = np.stack(np.meshgrid(*[np.arange(-20, 21)] * ndim, indexing="ij"))
    shape = Shape.from_mask((grid**2).sum(axis=0) < 18.3**2)
    monkeypatch.setattr(thumbnails, "_COARSE", 10**9)
    exact = cover(shape)
    monkeypatch.setattr(thumbnails, "_COARSE", 0)
    assert cover(shape) == pytest.approx(exact, rel=0.02)


def test_parts_that_were_dropped_are_not_pictured() -> None:
    """The surface of the file is the picture only where the shape kept what it encloses."""
    block = Shape.from_mask(np.ones((6, 6, 6)))
    flat = Surface(
        np.array([[0.0, 0, 0], [60, 0, 0], [0, 60, 1], [1, 1, 60]]), np.array([[0, 1, 2], [0, 2, 3]])
    )
    whole = replace(block, surface=flat)
    part = replace(whole, report=Report(volume_kept=0.9))
    assert thumbnail(part) == thumbnail(block)
    assert thumbnail(whole) != thumbnail(block)
