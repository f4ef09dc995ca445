"""Sizes of figures and places of their panels."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from spem.errors import ParameterError
from spem.plots.figures import figure_fields
from spem.plots.layout import GAP, MARGIN, TITLE, colour_bar, curve_panels, panels
from spem.shapes.shape import Shape


@settings(max_examples=30, deadline=None)
@given(st.integers(1, 12), st.floats(0.2, 3.0), st.booleans())
def test_panels_have_the_aspect_of_their_pictures(n_panels: int, aspect: float, bar: bool) -> None:
    """Panels are as high over wide as pictures, down to where a title needs width, and fill the figure."""
    figure, axes = panels(n_panels, aspect=aspect, bar=bar)
    width, height = figure.get_size_inches()
    boxes = [ax.get_position() for ax in axes]
    ratio = boxes[0].height * height / (boxes[0].width * width)
    assert ratio == pytest.approx(aspect, rel=1e-6) or (aspect > 1.6 and ratio < aspect)
    assert boxes[-1].y0 * height == pytest.approx(MARGIN)
    assert (1 - boxes[0].y1) * height == pytest.approx(MARGIN + TITLE)
    assert boxes[0].x0 * width == pytest.approx(MARGIN)
    for left, right in pairwise(boxes):
        if left.y0 == right.y0:
            assert (right.x0 - left.x1) * width == pytest.approx(GAP)


def test_few_panels_are_large() -> None:
    """One panel is larger than each of two, and those than each of five."""
    sizes = [np.ptp(panels(n)[1][0].get_window_extent().get_points()[:, 0]) for n in (1, 2, 5)]
    assert sizes[0] > sizes[1] > sizes[2]
    assert sizes[0] > 500


def test_scale_stands_clear_of_panels() -> None:
    """The colour bar lies right of the last panel and inside the figure, words and all."""
    figure, axes = panels(3, bar=True)
    colour_bar(figure, axes[0], "viridis", (-1, 1), ["−", "0", "+"])
    figure.canvas.draw()
    box = figure.axes[-1].get_tightbbox()
    assert box.x0 > axes[-1].get_window_extent().x1
    assert box.x1 < figure.bbox.width


def test_no_band_stays_blank() -> None:
    """The ink of a picture reaches to within a tenth of an inch of the lower edge."""
    figure = figure_fields(Shape.from_mask(np.ones((30, 60))), np.ones((1800, 3)), list("abc"))
    figure.canvas.draw()
    drawn = (np.asarray(figure.canvas.buffer_rgba())[..., :3] < 250).any(axis=(1, 2))
    assert len(drawn) - np.flatnonzero(drawn).max() < 0.1 * figure.dpi


def test_curves_keep_room_for_ticks() -> None:
    """Axes of curves are laid out by what stands around them."""
    figure, axes = curve_panels(4, columns=2)
    assert len(axes) == 4
    assert figure.get_layout_engine() is not None
    with pytest.raises(ParameterError, match="nothing to draw"):
        curve_panels(0)
