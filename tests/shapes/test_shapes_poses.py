"""Random poses."""

from __future__ import annotations

import numpy as np
import pytest

from spem.errors import ParameterError
from spem.shapes.poses import random_pose, random_poses
from spem.shapes.skeletons import skeleton, skeleton_kinds

KINDS = skeleton_kinds()


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


def test_first_of_several_poses_is_the_single_one():
    """One state of the generator, one creature, however many poses of it are wanted."""
    single = random_pose("lizard", 3, np.random.default_rng(3))
    _, first, _ = random_poses("lizard", 3, 2, np.random.default_rng(3))
    np.testing.assert_array_equal(single.end, first.body.end)


@pytest.mark.parametrize("kind", ["hand", "crab", "elephant"])
@pytest.mark.parametrize("ndim", [2, 3])
def test_carried_points_keep_their_place_on_their_bone(kind, ndim):
    """Distances to both ends of the bone stay, so that no point leaves the body."""
    rng = np.random.default_rng(1)
    rest, pose, _ = random_poses(kind, ndim, 2, rng)
    low, high = rest.body.bounds()
    points = rng.uniform(low, high, (400, ndim))
    bone, carried = rest.body.deepest(points), rest.carry(points, pose)
    for end in ("start", "end"):
        before = np.linalg.norm(points - getattr(rest.body, end)[bone], axis=1)
        after = np.linalg.norm(carried - getattr(pose.body, end)[bone], axis=1)
        np.testing.assert_allclose(after, before, atol=1e-12)
    least = pose.body.level(carried, 9.0) - rest.body.level(points, 9.0)
    assert least.min() > -1e-12
