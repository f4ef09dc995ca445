"""Joint histograms, their distances, and thresholds at jumps."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from spem.embedding.histograms import first_jumps, hellinger_distances, joint_histogram, map_limits
from spem.errors import ParameterError

UNIT = ((0.0, 1.0), (0.0, 1.0))


@settings(max_examples=15, deadline=None)
@given(st.integers(0, 1000), st.integers(1, 9))
def test_joint_histograms_add_up_to_one_wherever_the_values_are(seed, bins):
    """Values beyond the limits are counted in the outermost bins."""
    x, y = np.random.default_rng(seed).normal(0.5, 1.0, (2, 200))
    assert joint_histogram(x, y, UNIT, bins).sum() == pytest.approx(1.0)


def test_x_of_a_joint_histogram_is_along_axis_0():
    """One node at large x and small y stands in the last row and the first column."""
    assert joint_histogram([0.9], [0.1], UNIT, bins=2).tolist() == [[0.0, 0.0], [1.0, 0.0]]


@pytest.mark.parametrize(
    ("x", "y", "limits", "match"),
    [
        ([0.0, 1.0], [0.0], UNIT, "two columns of one length"),
        ([], [], UNIT, "two columns of one length"),
        ([0.0], [0.0], ((1.0, 1.0), (0.0, 1.0)), "limits must rise"),
    ],
)
def test_joint_histograms_refuse_what_cannot_be_counted(x, y, limits, match):
    """Columns of two lengths, none at all, and limits that do not rise."""
    with pytest.raises(ParameterError, match=match):
        joint_histogram(x, y, limits)


def test_hellinger_distance_has_its_closed_form():
    """Of two histograms (p, 1 - p) it is the root of 1 - sqrt(pq) - sqrt((1-p)(1-q))."""
    p, q = 0.2, 0.7
    wanted = np.sqrt(1 - np.sqrt(p * q) - np.sqrt((1 - p) * (1 - q)))
    found = hellinger_distances([[p, 1 - p], [q, 1 - q]])
    assert found[0, 1] == pytest.approx(wanted)
    assert np.allclose(np.diag(found), 0, atol=1e-7)


@settings(max_examples=15, deadline=None)
@given(st.integers(0, 1000))
def test_hellinger_distances_keep_the_triangle_inequality(seed):
    """They are a metric, so class means of them can be compared."""
    a, b, c = hellinger_distances(np.random.default_rng(seed).dirichlet(np.ones(5), 3))
    assert a[2] <= a[1] + b[2] + 1e-12
    assert c[0] == pytest.approx(a[2])


def test_jumps_are_where_a_histogram_steps():
    """Long tails of low counts end in steps at -3 and 5."""
    rng = np.random.default_rng(0)
    values = np.concatenate([rng.uniform(-10, 10, 2_000), rng.uniform(-3, 5, 20_000)])
    assert first_jumps(values) == pytest.approx((-3, 5), abs=0.4)


def test_a_flat_histogram_is_divided_at_zero():
    """Neither its even counts nor its ends are jumps."""
    assert first_jumps(np.linspace(-1, 2, 10_000)) == (0.0, 0.0)


def test_jumps_turn_with_the_sign_of_the_values():
    """A map of opposite sign has the opposite thresholds, exchanged."""
    rng = np.random.default_rng(1)
    values = np.concatenate([rng.uniform(-10, 10, 3_000), rng.uniform(-4, 2, 20_000)])
    low, high = first_jumps(values)
    assert first_jumps(-values) == pytest.approx((-high, -low))


def test_jumps_need_different_values():
    """One value has no histogram."""
    with pytest.raises(ParameterError, match="at least two different values"):
        first_jumps([1.0, 1.0])


def test_limits_are_those_of_all_shapes_together():
    """But for the share that is left out at each end."""
    assert map_limits([np.zeros((50, 1)), np.ones((50, 1))], 0) == (0.0, 1.0)


@pytest.mark.parametrize("wrong", [np.nan, np.inf])
def test_values_that_are_not_finite_are_refused(wrong):
    """Shares would not add up to 1, and quantiles would be no numbers."""
    with pytest.raises(ParameterError, match="must be finite"):
        joint_histogram([0.5, wrong], [0.5, 0.5], ((0, 1), (0, 1)))
    with pytest.raises(ParameterError, match="all finite"):
        first_jumps([0.0, wrong, 1.0])
