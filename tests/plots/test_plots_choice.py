"""The error curve: its points, and the mark on the suggested number of parts."""

from __future__ import annotations

import numpy as np

from spem.decomposition.choice import ErrorCurve
from spem.plots.choice import figure_error_curve


def test_suggested_number_is_marked() -> None:
    """The curve starts at k = 1 and the elbow is ringed and named."""
    curve = ErrorCurve(np.arange(1, 8), np.array([1.0, 0.8, 0.6, 0.2, 0.18, 0.16, 0.14]))
    (ax,) = figure_error_curve(curve).axes
    line, ring = ax.lines
    np.testing.assert_array_equal(line.get_ydata(), curve.errors)
    assert (ring.get_xdata()[0], ring.get_ydata()[0]) == (4, 0.2)
    assert [text.get_text() for text in ax.texts] == ["k = 4"]
    assert ax.get_ylim()[0] == 0
