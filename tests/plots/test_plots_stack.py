"""Stacks of slices."""

from __future__ import annotations

import numpy as np
import pytest

from spem.errors import ParameterError, ShapeError
from spem.plots.stack import draw_stack
from spem.plots.style import new_figure
from spem.shapes.shape import Shape
from spem.shapes.synthetic import ball, disk


def test_slices_lie_above_each_other_within_the_limits():
    """The first at the bottom, each with its word, none cut off."""
    shape = disk(8.0, 1.0)
    ax = new_figure(3, 4).add_subplot()
    draw_stack(shape, np.ones((shape.n_nodes, 3)), ax, ["a", "b", "c"], title="three")
    assert [text.get_text() for text in ax.texts] == ["a", "b", "c"]
    heights = [text.get_position()[1] for text in ax.texts]
    assert heights[0] > heights[1] > heights[2]
    low, high = sorted(ax.get_ylim())
    assert low < heights[2] < heights[0] < high
    assert ax.get_title() == "three"


def test_what_cannot_be_stacked_is_refused():
    """A solid; words that do not match."""
    ax = new_figure(2, 2).add_subplot()
    with pytest.raises(ShapeError, match="2 dimensions"):
        draw_stack(ball(3.0, 1.0), np.ones(ball(3.0, 1.0).n_nodes), ax, ["a"])
    with pytest.raises(ParameterError, match="2 slices need as many words, not 1"):
        draw_stack(Shape.from_mask(np.ones((3, 3))), np.ones((9, 2)), ax, ["a"])
