"""Limbs of silhouettes: fingers in order, legs and tail."""

from __future__ import annotations

import numpy as np
import pytest

from spem.errors import ParameterError
from spem.paper.data import Data
from spem.paper.limbs import core_labels, find_limbs, fingers, legs_and_tail, main_labels
from spem.paper.silhouettes import chosen
from spem.shapes.shape import Shape
from spem.shapes.synthetic import disk


def comb(widths: tuple[int, ...]) -> Shape:
    """A block with teeth of one length on its lower side, the last apart from the others."""
    mask = np.zeros((90, 40 + 14 * len(widths)), bool)
    mask[5:45] = True
    for i, width in enumerate(widths):
        left = 5 + 14 * i + (14 if i == len(widths) - 1 else 0)
        mask[45:80, left : left + width] = True
    return Shape.from_mask(mask, name="comb")


def test_fingers_follow_the_outline_up_to_the_thumb():
    """The thumb is the end of the row that stands apart, on either side."""
    hand = comb((6, 6, 6, 6, 6))
    for mask in (hand.mask, hand.mask[:, ::-1]):
        shape = Shape.from_mask(mask)
        column = [shape.points[finger, 1].mean() for finger in fingers(shape).inside]
        steps = np.diff(column)
        assert (steps > 0).all() or (steps < 0).all()
        assert abs(steps[-1]) > 1.5 * abs(steps[0])


def test_limbs_measure_themselves():
    """Length, width, tip and window of a tooth."""
    limbs = fingers(comb((6, 6, 6, 6, 6)))
    middle = limbs.inside[2]
    assert abs(limbs.length(2) - np.ptp(limbs.shape.points[middle, 0])) < 4
    assert 5 < limbs.width(2) < 8
    assert limbs.shape.points[limbs.tip(0), 0] == limbs.shape.points[:, 0].max()
    (top, bottom), (left, right) = limbs.window(0)
    inside = limbs.shape.points[limbs.inside[0]]
    assert top < inside[:, 0].min()
    assert bottom > inside[:, 0].max()
    assert left < inside[:, 1].min() < inside[:, 1].max() < right


def test_shapes_without_limbs_are_refused():
    """A disk has none, so no fingers and no legs."""
    assert find_limbs(disk(20.0, 1.0)).inside.shape[0] == 0
    for find in (fingers, legs_and_tail):
        with pytest.raises(ParameterError, match="opening finds 0 limbs"):
            find(disk(20.0, 1.0))


def test_labels_of_limbs_and_of_the_core():
    """Most members decide."""
    limbs = fingers(comb((6, 6, 6, 6, 6)))
    labels = np.where(limbs.core, 7, limbs.inside.argmax(axis=0))
    assert main_labels(labels, limbs.inside) == [0, 1, 2, 3, 4]
    assert core_labels(labels, limbs) == [7]


@pytest.mark.parametrize("kind", ["hand", "cat"])
def test_creatures_that_stand_in_have_their_limbs(kind):
    """Five fingers, or legs and tail, in each that the figures take."""
    find = fingers if kind == "hand" else legs_and_tail
    for shape in chosen(Data(), kind).shapes:
        assert find(shape).inside.shape[0] == 5


@pytest.mark.data
def test_real_silhouettes_of_the_figures_have_their_limbs(data_dir):
    """The thumb of the hand is to the right; the cats' tails are at the foot of the picture."""
    data = Data(data_dir)
    (hand,) = chosen(data, "hand").shapes
    found = fingers(hand)
    assert found.shape.points[found.tip(4), 1] == found.shape.points[:, 1].max()
    for cat in chosen(data, "cat").shapes:
        limbs = legs_and_tail(cat)
        heights = [cat.points[limb, 0].mean() for limb in limbs.inside]
        assert np.argmax(heights) == 4
