"""The value object: what a mask, a spacing and cuts may be."""

from __future__ import annotations

import numpy as np
import pytest

from spem.errors import ParameterError
from spem.shapes.shape import Cuts, Shape

BAR = np.pad(np.ones((1, 4), bool), 1)  # inside at 7, 8, 9, 10


def cuts(*listed):
    """Make cuts of (voxel, direction) pairs."""
    voxel, direction = zip(*listed, strict=True)
    return Cuts(np.array(voxel), np.array(direction), np.full(len(listed), 0.4))


@pytest.mark.parametrize(
    ("listed", "match"),
    [
        ([(10**6, 0)], "bar: a cut leaves voxel 1000000, expected 0 to 17"),
        ([(7, 0), (-1, 0)], "bar: a cut leaves voxel -1, expected 0 to 17"),
        ([(7, 0), (1, 1)], "bar: a cut leaves voxel 1, which is outside"),
        ([(7, 0), (7, 9)], "bar: a cut has direction 9, expected 0 to 3 in 2-D"),
        ([(8, 3), (7, 0)], "bar: the edge between inside voxels 8 and 9 is cut from the first alone"),
    ],
)
def test_cuts_that_do_not_fit_the_mask_are_refused(listed, match):
    """A voxel or direction that is not there, an outside voxel, an edge cut from one end: each is named."""
    with pytest.raises(ParameterError, match=match):
        Shape(BAR, (1, 1), (0, 0), "bar", cuts(*listed))
    with pytest.raises(ParameterError, match=match.partition(" between")[0]):
        Shape.from_mask(BAR, name="bar", cuts=cuts(*listed))


def test_cuts_that_fit_are_taken():
    """Edges to the outside, and edges between inside voxels that are cut from both ends."""
    assert len(Shape(BAR, (1, 1), (0, 0), cuts=cuts((8, 3), (9, 2), (7, 0), (10, 3))).cuts) == 4


@pytest.mark.parametrize(
    ("voxel", "direction", "match"),
    [
        ([7, 8, 7], [0, 1, 0], "voxel 7, direction 0 is listed twice"),
        ([7, 8], [0], r"of one length, got \(2,\), \(1,\) and \(2,\)"),
        ([7.5], [0], "voxel must hold whole numbers, got float64"),
    ],
)
def test_lists_of_cuts_are_checked_by_themselves(voxel, direction, match):
    """Repeated edges, arrays of different length and fractions of a voxel are refused."""
    with pytest.raises(ParameterError, match=match):
        Cuts(np.array(voxel), np.array(direction), np.full(len(voxel), 0.5))


@pytest.mark.parametrize("direction", [256, -1])
def test_directions_do_not_wrap_around(direction):
    """A direction that eight bits cannot hold is not taken for another."""
    with pytest.raises(ParameterError, match=f"direction {direction}, expected 0 to 255"):
        Cuts(np.array([7]), np.array([direction]), np.array([0.5]))


@pytest.mark.parametrize("spacing", [0, np.nan, (1, 2, 3), "wide", None])
def test_spacings_of_masks_are_checked(spacing):
    """One positive number for each axis, or for all."""
    with pytest.raises(ParameterError, match="expected one positive number, or 2 of them, one per axis"):
        Shape.from_mask(BAR, spacing)
