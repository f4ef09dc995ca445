"""Scale space of mean curvature."""

from __future__ import annotations

import numpy as np
import trimesh

from spem.rivals.curvature_scale_space import curvature_scale_space


def test_keypoint_at_a_bump() -> None:
    """A bump on a sphere is the strongest change of curvature, and a keypoint lies on it."""
    ball = trimesh.creation.icosphere(subdivisions=4)
    pole = np.array([0.0, 0, 1])
    height = 0.15 * np.exp(-np.square(np.linalg.norm(ball.vertices - pole, axis=1)) / (2 * 0.12**2))
    vertices = ball.vertices * (1 + height[:, None])
    space = curvature_scale_space(vertices, ball.faces, first_steps=3)
    keypoints = space.keypoints()
    strength = np.abs(space.differences[keypoints[:, 0], keypoints[:, 1]])
    strongest = ball.vertices[keypoints[np.argmax(strength), 1]]
    assert np.linalg.norm(strongest - pole) < 0.1


def test_smoothing_widens() -> None:
    """Scales grow by the square root of the steps, and noise fades from each to the next."""
    rng = np.random.default_rng(3)
    ball = trimesh.creation.icosphere(subdivisions=3)
    vertices = ball.vertices * (1 + 0.02 * rng.normal(size=(len(ball.vertices), 1)))
    space = curvature_scale_space(vertices, ball.faces, first_steps=4, n_scales=5)
    np.testing.assert_allclose(space.sigma[2:] / space.sigma[:-2], np.sqrt(2), rtol=0.1)
    clean = curvature_scale_space(ball.vertices, ball.faces, first_steps=4, n_scales=5)
    pairs = zip(space.curvature, clean.curvature, strict=True)
    spread = [(noisy.mean - smooth.mean).std() for noisy, smooth in pairs]
    assert (np.diff(spread) < 0).all()


def test_keypoints_are_inner_scales_only() -> None:
    """The first and the last difference have no neighbour on one side and carry no keypoint."""
    rng = np.random.default_rng(4)
    ball = trimesh.creation.icosphere(subdivisions=3)
    vertices = ball.vertices + 0.05 * rng.normal(size=ball.vertices.shape)
    space = curvature_scale_space(vertices, ball.faces, n_scales=4)
    assert set(space.keypoints()[:, 0]) == {1}
