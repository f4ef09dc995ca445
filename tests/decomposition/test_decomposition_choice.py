"""The curve of errors against the number of parts, and its elbow."""

from __future__ import annotations

import numpy as np
import pytest

from spem.decomposition.choice import ErrorCurve, error_curve
from spem.errors import ParameterError
from spem.fields.boundary.sources import point_sources
from spem.fields.operator import assemble
from spem.fields.superposition.fields import SourceFields, solve_sources
from spem.shapes.shape import Shape


def _star(arms: int) -> SourceFields:
    """Fields of a star of thin arms about the origin."""
    y, x = np.mgrid[-20:21, -20:21]
    mask = np.hypot(x, y) < 3.5
    for angle in 2 * np.pi * (np.arange(arms) + 0.3) / arms:
        along, across = x * np.cos(angle) + y * np.sin(angle), y * np.cos(angle) - x * np.sin(angle)
        mask |= (along > 0) & (along < 19) & (abs(across) < 1.8)
    return solve_sources(point_sources(assemble(Shape.from_mask(mask, name="star"), "voxel")), np.inf)


@pytest.mark.parametrize("arms", [3, 6])
def test_elbow_of_a_star_is_its_number_of_arms(arms):
    """As many parts as arms are suggested, or one more for the middle."""
    curve = error_curve(_star(arms), 9)
    assert curve.suggested in (arms, arms + 1)
    assert (np.diff(curve.errors) <= 0).all()
    assert 0 < curve.errors[-1] < curve.errors[0] < 1


@pytest.mark.parametrize("over", ["region", "boundary"])
def test_curve_ends_at_the_number_of_nodes(over):
    """No more components are tried than there are nodes or sources; progress counts them."""
    fields = solve_sources(point_sources(assemble(Shape.from_mask(np.ones((1, 4))), "voxel")), np.inf)
    seen = []
    curve = error_curve(fields, 10, over=over, sparsity=0.0, progress=lambda k, most: seen.append((k, most)))
    assert seen == [(1, 4), (2, 4), (3, 4), (4, 4)]
    np.testing.assert_array_equal(curve.counts, [1, 2, 3, 4])
    assert curve.errors[-1] < 1e-3


def test_suggestion_of_short_and_flat_curves():
    """Where there is no bend, two parts are suggested, or the one that is possible."""
    assert ErrorCurve(np.array([1]), np.array([0.5])).suggested == 1
    assert ErrorCurve(np.arange(1, 4), np.array([0.5, 0.2, 0.1])).suggested == 2
    assert ErrorCurve(np.arange(1, 6), np.array([0.5, 0.2, 0.2, 0.2, 0.2])).suggested == 2
    bent = ErrorCurve(np.arange(1, 8), np.array([1.0, 0.8, 0.5, 0.2, 0.19, 0.18, 0.17]))
    assert bent.suggested == 4
    assert repr(bent) == "ErrorCurve(k 1 to 7, error 1 to 0.17, suggested 4)"


def test_bad_numbers_are_refused():
    """A curve needs at least one part, and a sparsity in range."""
    fields = solve_sources(point_sources(assemble(Shape.from_mask(np.ones((2, 4))), "voxel")), np.inf)
    with pytest.raises(ParameterError, match="most=0: expected a whole number of parts, at least 1"):
        error_curve(fields, 0)
    with pytest.raises(ParameterError, match=r"most=2\.5: expected a whole number"):
        error_curve(fields, 2.5)
    with pytest.raises(ParameterError, match="sparsity=2: expected 0 to less than 1"):
        error_curve(fields, sparsity=2)
