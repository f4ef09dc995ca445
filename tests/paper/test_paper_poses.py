"""Poses with points that correspond."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from scipy.special import i0

import spem
from spem.paper.data import Data
from spem.paper.poses import COLLECTIONS, Poses, carried, depth_at, fields_at, load_poses


def test_a_rigid_motion_carries_every_point_with_it():
    """Moving least squares give a rotation and translation back exactly."""
    rng = np.random.default_rng(0)
    vertices, points = rng.normal(size=(60, 3)), rng.normal(size=(9, 3))
    turn = Rotation.from_rotvec([0.3, -1.0, 0.4])
    shift = np.array([1.0, 2.0, 3.0])
    found = carried(points, vertices, turn.apply(vertices) + shift, rng.uniform(1, 2, 60))
    np.testing.assert_allclose(found, turn.apply(points) + shift, atol=1e-9)


def test_fields_are_read_up_to_the_surface():
    """Off the nodes of a disk the error against the closed form falls with the spacing."""
    errors = []
    for spacing in (1.0, 0.5):
        disk = spem.synthetic.disk(radius=12.0, spacing=spacing)
        angle = np.linspace(0, 6, 40)
        radius = np.linspace(0, 11.99, 40)
        points = radius[:, None] * np.stack([np.cos(angle), np.sin(angle)], axis=1)
        found = fields_at(spem.sweep(disk, rho=[4.0, 8.0], rtol=1e-9), points)
        truth = i0(radius[:, None] / [4.0, 8.0]) / i0(12.0 / np.array([4.0, 8.0]))
        errors.append(np.abs(found - truth).max())
        np.testing.assert_allclose(depth_at(disk, points), 12.0 - radius, atol=0.2 * spacing)
    assert errors[0] < 0.01
    assert errors[1] < errors[0] / 2


@pytest.fixture(scope="module")
def real(data_dir) -> dict[str, Poses]:
    """Return the real sets of poses, in a reduced size."""
    return {poses.collection: poses for poses in load_poses(Data(data_dir, quick=True), n_inside=150)}


@pytest.mark.data
@pytest.mark.parametrize("name", COLLECTIONS)
def test_points_of_real_poses_stay_inside_at_their_depth(real, name):
    """Carried points keep their distance to the surface, and a mirror is its own inverse."""
    poses = real[name]
    depths = np.stack([depth_at(s, x) for s, x in zip(poses.shapes, poses.inside, strict=True)])
    assert (depths > 0).mean() > 0.97
    assert np.median(np.abs(depths[1:] - depths[0])) < 0.15 * poses.shapes[0].spacing[0]
    np.testing.assert_array_equal(poses.mirror[poses.mirror], np.arange(poses.mirror.size))


@pytest.mark.data
def test_mirror_images_of_a_cat_at_rest_differ_in_one_coordinate(real):
    """The cat at rest is symmetric about the plane across its first axis."""
    poses = real["tosca_cats"]
    marks = poses.marks[0]
    np.testing.assert_allclose(marks[poses.mirror], marks * [-1, 1, 1], atol=poses.shapes[0].spacing[0])
