"""Size as a control."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from spem.errors import LabelError, ParameterError
from spem.retrieval.evaluation import evaluate
from spem.retrieval.sizes import of_one_size, size_distance

VOLUMES = st.lists(st.floats(1e-9, 1e9), min_size=1, max_size=8)


@settings(max_examples=30, deadline=None)
@given(VOLUMES, st.floats(1e-3, 1e3))
def test_the_unit_of_volumes_does_not_matter(volumes, unit):
    """Distances by size are a metric of quotients, so any unit gives the same."""
    distances = size_distance(volumes)
    np.testing.assert_allclose(size_distance(np.multiply(volumes, unit)), distances, atol=1e-9)
    np.testing.assert_array_equal(distances, distances.T)


@settings(max_examples=30, deadline=None)
@given(VOLUMES, st.floats(1.0, 10.0))
def test_of_one_size_is_what_quotients_say(volumes, factor):
    """Shapes are of one size where neither volume is more than the factor times the other."""
    v = np.asarray(volumes)
    quotient = np.maximum(v[:, None] / v, v / v[:, None])
    same = of_one_size(v, factor)
    assert same[quotient <= factor * (1 - 1e-9)].all()
    assert not same[quotient > factor * (1 + 1e-9)].any()


@pytest.mark.parametrize("volumes", [[1.0, 0.0], [1.0, np.nan], [-1.0], [np.inf], [[1.0]]])
def test_volumes_that_are_none_are_refused(volumes):
    """A volume has to be known and positive."""
    with pytest.raises(ParameterError, match="volumes"):
        size_distance(volumes)


@pytest.mark.parametrize("factor", [0.5, np.nan, np.inf])
def test_factors_that_are_none_are_refused(factor):
    """A factor has to be finite and at least 1."""
    with pytest.raises(ParameterError, match="factor"):
        of_one_size([1.0], factor)


def test_only_candidates_are_ranked_and_to_be_found():
    """Scores among shapes of one size are those of the collection without all others."""
    rng = np.random.default_rng(0)
    distances = rng.random((8, 8))
    labels = [0, 0, 1, 1, 0, 0, 1, 1]
    small = np.arange(8) < 4
    scores = evaluate(distances, labels, candidates=small[:, None] == small)
    for half in (np.flatnonzero(small), np.flatnonzero(~small)):
        alone = evaluate(distances[np.ix_(half, half)], [labels[i] for i in half])
        for name in ("NN", "FT", "DCG"):
            np.testing.assert_allclose(scores.per_query[name][half], alone.per_query[name])


def test_candidates_that_do_not_fit_are_refused():
    """Candidates are one row and column a shape, and leave something to find."""
    with pytest.raises(ParameterError, match="candidates of shape"):
        evaluate(np.zeros((2, 2)), [0, 0], candidates=np.ones((3, 3)))
    with pytest.raises(LabelError, match="among the candidates"):
        evaluate(np.zeros((2, 2)), [0, 0], candidates=np.eye(2))
