"""The silhouettes of the figures."""

from __future__ import annotations

import pytest

from spem.paper.data import Data
from spem.paper.silhouettes import MADE, REAL, chosen
from spem.shapes.distance import signed_distance


def test_creatures_stand_in_by_number():
    """As many as the figures take, or those asked for, with the inner radius asked for."""
    assert [shape.name for shape in chosen(Data(), "cat").shapes] == [f"dog {i}" for i in MADE["cat"]]
    (third,) = chosen(Data(), "hand", (3,), inner_radius=8.0).shapes
    assert third.name == "hand 3"
    assert abs(signed_distance(third).max() - 8) < 0.3


@pytest.mark.data
def test_real_ones_are_taken_where_they_are(data_dir):
    """By their number in the collection."""
    names = [shape.name for shape in chosen(Data(data_dir), "cat").shapes]
    assert names == [f"obj9_{i}" for i in REAL["cat"]]
