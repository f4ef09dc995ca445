"""Skeletons and poses."""

from __future__ import annotations

import numpy as np
import pytest

from spem.errors import ParameterError
from spem.shapes.skeletons import random_pose, skeleton, skeleton_kinds

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


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("ndim", [2, 3])
def test_every_bone_starts_inside_its_parent(kind, ndim):
    """In any pose a bone's first ball meets its parent, so that a body is in one piece."""
    bones = skeleton(kind)
    rng = np.random.default_rng(0)
    for _ in range(3):
        pose = random_pose(kind, ndim, rng)
        for child, parent in enumerate(bones.parent[1:], 1):
            part = type(pose)(pose.start[[parent]], pose.end[[parent]], pose.radius[[parent]])
            depth = part.level(pose.start[[child]], 9.0)[0]
            assert depth + pose.radius[child, 0] > 0.25 * pose.radius[child, 0]


def test_mirror_images_are_mirrored_at_rest():
    """Left and right differ in the sign of one coordinate and in the sense of their turns."""
    bones = skeleton("human")
    pairs = [np.flatnonzero(bones.part == part) for part in np.unique(bones.part)]
    for left, right in (pair for pair in pairs if pair.size == 2):
        np.testing.assert_allclose(bones.heading[left] * [-1, 1, 1], bones.heading[right], atol=1e-15)
        np.testing.assert_allclose(bones.offset[left] * [-1, 1, 1], bones.offset[right])
        np.testing.assert_allclose(bones.bend[left], -bones.bend[right][::-1])


def test_one_seed_gives_one_pose_and_another_gives_another():
    """Poses depend on the generator alone."""
    one, same, other = (random_pose("crab", 3, np.random.default_rng(seed)) for seed in (1, 1, 2))
    np.testing.assert_array_equal(one.end, same.end)
    assert np.abs(one.end - other.end).max() > 0.05


def test_build_varies_little_and_alike_on_both_sides():
    """Lengths of bones in space vary by some per cent about those of the class."""
    rng = np.random.default_rng(0)
    bones = skeleton("spider")
    ratios = []
    for _ in range(40):
        pose = random_pose("spider", 3, rng)
        ratio = np.linalg.norm(pose.end - pose.start, axis=1) / bones.length
        ratios.append(ratio)
        for part in np.unique(bones.part):
            np.testing.assert_allclose(np.ptp(ratio[bones.part == part]), 0, atol=1e-12)
    spread = np.std(ratios, axis=0)
    assert 0.03 < spread.mean() < 0.07
    assert np.abs(np.array(ratios) - 1).max() < 0.12


def test_unknown_kinds_and_dimensions_are_refused():
    """The message lists the kinds there are."""
    with pytest.raises(ParameterError, match=r"kind must be one of human, dog, .* not 'unicorn'"):
        random_pose("unicorn", 2, np.random.default_rng(0))
    with pytest.raises(ParameterError, match="2 or 3 dimensions, not 4"):
        random_pose("ant", 4, np.random.default_rng(0))
