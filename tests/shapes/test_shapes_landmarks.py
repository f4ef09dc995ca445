"""One creature in several poses, with corresponding points."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial import KDTree

from spem.errors import ParameterError
from spem.shapes.landmarks import creature_poses


@pytest.mark.parametrize(("kind", "ndim"), [("human", 2), ("crab", 3), ("hand", 2)])
def test_points_lie_in_their_shapes_in_every_pose(kind, ndim):
    """Each has a node within the diagonal of a voxel."""
    poses = creature_poses(kind, 3, ndim=ndim, voxels=4000, n_points=200, rng=np.random.default_rng(0))
    for shape, points in zip(poses.shapes, poses.points, strict=True):
        distance = KDTree(shape.points).query(points)[0]
        assert distance.max() < np.sqrt(ndim) * shape.spacing[0]


def test_mirror_is_its_own_inverse_and_changes_sides():
    """A point on the left arm of a human has its image on the right one, as far from the middle."""
    poses = creature_poses("human", 1, ndim=3, voxels=2000, n_points=300, rng=np.random.default_rng(0))
    mirror = poses.mirror
    np.testing.assert_array_equal(mirror[mirror], np.arange(300))
    assert (mirror != np.arange(300)).all()


def test_without_left_and_right_points_are_their_own_mirror_images():
    """A dog seen from the side shows one of each pair of legs."""
    poses = creature_poses("dog", 1, voxels=900, n_points=20, rng=np.random.default_rng(0))
    np.testing.assert_array_equal(poses.mirror, np.arange(20))


def test_poses_share_one_build():
    """Areas agree to a few per cent, though limbs overlap differently."""
    poses = creature_poses("starfish", 4, voxels=3000, n_points=2, rng=np.random.default_rng(2))
    areas = [shape.volume for shape in poses.shapes]
    assert np.ptp(areas) < 0.05 * np.mean(areas)


@pytest.mark.parametrize(("n_poses", "n_points"), [(0, 10), (1, 0), (1, 7)])
def test_counts_without_sense_are_refused(n_poses, n_points):
    """There is at least a pose and a pair of points."""
    with pytest.raises(ParameterError, match="expected a pose or more, and an even number of points"):
        creature_poses("fish", n_poses, n_points=n_points, rng=np.random.default_rng(0))


def test_poses_say_what_they_are():
    """In one line, without the points."""
    poses = creature_poses("fish", 2, voxels=300, n_points=4, rng=np.random.default_rng(0))
    assert repr(poses) == "CreaturePoses('fish', 2-D, 2 poses, 4 points)"


def test_a_seed_in_place_of_a_generator_is_refused():
    """With what to do."""
    with pytest.raises(ParameterError, match="expected Generator, got int; make one"):
        creature_poses("fish", 1, rng=0)
