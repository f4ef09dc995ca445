"""Times of maps."""

from __future__ import annotations

from pathlib import Path

import pytest

from spem.errors import ParameterError
from spem.paper.timing import time_collection, time_maps
from spem.shapes.synthetic import disk


def test_times_are_counted():
    """One for each shape, and the total is no less than their sum in a single process."""
    assert time_maps(disk(5.0, 1.0)).wall > 0
    total, each = time_collection([disk(5.0, 1.0), disk(6.0, 1.0)], 1)
    assert len(each) == 2
    assert total >= sum(each)


def test_a_file_that_cannot_be_read_is_named():
    """No time is told of what was not done."""
    with pytest.raises(ParameterError, match=r"nowhere\.png"):
        time_collection([Path("nowhere.png")], 1)
