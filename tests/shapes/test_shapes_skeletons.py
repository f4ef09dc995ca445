"""Skeletons and poses."""

from __future__ import annotations

import numpy as np
import pytest

from spem.shapes.skeletons import mirror_axis, skeleton, skeleton_kinds

KINDS = skeleton_kinds()


@pytest.mark.parametrize("kind", KINDS)
def test_skeletons_are_trees_of_proper_bones(kind):
    """A parent stands before its child, and no bone has one end inside the ball of the other."""
    bones = skeleton(kind)
    assert bones.parent[0] == -1
    assert (bones.parent[1:] >= 0).all()
    assert (bones.parent < np.arange(bones.parent.size)).all()
    np.testing.assert_allclose(np.linalg.norm(bones.heading, axis=1), 1)
    assert (bones.bend[:, 0] <= bones.bend[:, 1]).all()
    assert (bones.radius > 0).all()
    assert (np.abs(np.diff(bones.radius, axis=1)[:, 0]) < bones.length).all()


def test_mirror_images_are_mirrored_at_rest():
    """Left and right differ in the sign of one coordinate and in the sense of their turns."""
    bones = skeleton("human")
    pairs = [np.flatnonzero(bones.part == part) for part in np.unique(bones.part)]
    for left, right in (pair for pair in pairs if pair.size == 2):
        np.testing.assert_allclose(bones.heading[left] * [-1, 1, 1], bones.heading[right], atol=1e-15)
        np.testing.assert_allclose(bones.offset[left] * [-1, 1, 1], bones.offset[right])
        np.testing.assert_allclose(bones.bend[left], -bones.bend[right][::-1])


def test_kinds_without_left_and_right_have_no_mirror():
    """Fingers of a hand all differ; a dog has its legs in pairs."""
    assert mirror_axis("hand") is None
    assert mirror_axis("dog") == 2
