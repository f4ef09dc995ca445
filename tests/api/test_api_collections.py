"""The facade of collections on arrays: distances are scored and vectors classified without codes."""

from __future__ import annotations

import numpy as np
import pytest

import spem
from spem.errors import LabelError, ParameterError

DISTANCES = [[0, 1, 5], [1, 0, 4], [5, 4, 0]]


def test_distances_of_any_kind_are_scored():
    """Such as those that several methods share."""
    scores = spem.evaluate(spem.fuse(DISTANCES, DISTANCES), ["cat", "cat", "dog"])
    assert (scores.mean()["NN"], scores.skipped) == (100.0, (2,))


def test_arrays_have_no_names():
    """So there is nothing to look up in a file of labels."""
    with pytest.raises(LabelError, match="distances have no names to look labels up by"):
        spem.evaluate(DISTANCES, "labels.csv")
    with pytest.raises(LabelError, match="vectors have no names to look labels up by"):
        spem.classify(np.eye(3), {"a": "cat"})


def test_codes_in_place_of_their_model_are_refused():
    """With what to give."""
    with pytest.raises(ParameterError, match="expected Model, got str; give the model of codes"):
        spem.encode(spem.synthetic.disk(radius=5.0, spacing=1.0), model="shapes.spem")
