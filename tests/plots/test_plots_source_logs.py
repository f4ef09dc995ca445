"""Figures of log v: one panel a field, one scale, what is never reached at its end."""

from __future__ import annotations

import numpy as np
import pytest
from matplotlib.colors import Normalize

from spem.errors import ParameterError, ShapeError
from spem.plots.source_logs import figure_logs
from spem.shapes.shape import Shape


@pytest.fixture
def square() -> Shape:
    """Return a square of 4 x 4 nodes."""
    return Shape.from_mask(np.ones((4, 4)), name="square")


def test_panels_share_a_scale_from_the_least_log_to_zero(square: Shape) -> None:
    """All panels have the limits of the least finite log and 0; -inf has the colour of the least."""
    log = -np.arange(32.0).reshape(16, 2)
    log[-1, 1] = -np.inf
    figure = figure_logs(square, log, ["a", "b"])
    images = [ax.images[0] for ax in figure.axes[:2]]
    assert [image.get_clim() for image in images] == [(-30, 0)] * 2
    assert all(np.isfinite(image.get_array()).all() for image in images)
    bar = figure.axes[-1]
    assert (bar.get_title(), bar.get_xlabel()) == ("log v\n0", "−30")
    assert isinstance(images[0].norm, Normalize)


def test_sources_are_marked_where_they_are(square: Shape) -> None:
    """Row and column of a source are its place in the picture."""
    figure = figure_logs(square, -np.ones(16), ["a"], sources=[[1.0, 3.5]])
    (mark,) = figure.axes[0].lines
    assert (mark.get_xdata()[0], mark.get_ydata()[0]) == (3.5, 1.0)


@pytest.mark.parametrize("size", [(6,), (3, 3, 4)])
def test_lines_and_solids(size: tuple[int, ...]) -> None:
    """Fields on an interval are curves, on a solid pictures of its surface."""
    shape = Shape.from_mask(np.ones(size))
    axes = figure_logs(shape, -np.arange(shape.n_nodes), ["a"]).axes
    assert bool(axes[0].lines) == (len(size) == 1)
    assert bool(axes[0].images) == (len(size) == 3)


def test_what_does_not_fit_is_refused(square: Shape) -> None:
    """Titles and sources in another number than the fields, and four dimensions, are refused."""
    with pytest.raises(ParameterError, match="2 fields need as many titles, not 1"):
        figure_logs(square, -np.ones((16, 2)), ["a"])
    with pytest.raises(ParameterError, match="1 fields need as many sources, not 2"):
        figure_logs(square, -np.ones(16), ["a"], sources=np.zeros((2, 2)))
    with pytest.raises(ShapeError, match="this one has 4"):
        figure_logs(Shape.from_mask(np.ones((2,) * 4)), -np.ones(16), ["a"])
