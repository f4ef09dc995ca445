"""Curvatures at the vertices of triangle surfaces."""

from __future__ import annotations

import numpy as np
import trimesh

from spem.rivals.surface_curvature import surface_curvature, tangent_frames


def test_sphere_has_constant_curvature() -> None:
    """On a sphere of radius R both curvatures are 1/R and the shape index is 1."""
    ball = trimesh.creation.icosphere(subdivisions=4, radius=2.0)
    curvature = surface_curvature(ball.vertices, ball.faces)
    np.testing.assert_allclose(curvature.principal, 0.5, rtol=0.02)
    np.testing.assert_allclose(curvature.shape_index, 1, atol=0.01)
    np.testing.assert_allclose(curvature.curvedness, 0.5, rtol=0.02)
    assert np.isclose(curvature.areas.sum(), ball.area)


def test_inside_out_sphere_is_a_bowl() -> None:
    """Seen from inside, curvatures change sign and the shape index is −1."""
    ball = trimesh.creation.icosphere(subdivisions=3)
    curvature = surface_curvature(ball.vertices, ball.faces[:, ::-1])
    np.testing.assert_allclose(curvature.shape_index, -1, atol=0.03)
    assert curvature.mean.max() < 0


def test_torus_converges() -> None:
    """The mean curvature of a torus converges at second order."""
    errors = []
    for sections in (24, 48):
        torus = trimesh.creation.torus(1.0, 0.4, major_sections=2 * sections, minor_sections=sections)
        out = np.hypot(torus.vertices[:, 0], torus.vertices[:, 1]) - 1
        exact = (1 / 0.4 + out / 0.4 / (1 + out)) / 2
        errors.append(np.abs(surface_curvature(torus.vertices, torus.faces).mean - exact).max())
    assert errors[1] < 0.3 * errors[0]


def test_frames_are_orthonormal() -> None:
    """Tangent frames are right-handed and orthonormal for every normal."""
    normals = np.random.default_rng(0).normal(size=(50, 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    frames = np.concatenate([tangent_frames(normals), normals[:, None]], axis=1)
    np.testing.assert_allclose(frames @ frames.transpose(0, 2, 1) - np.eye(3), 0, atol=1e-12)
    np.testing.assert_allclose(np.linalg.det(frames), 1)
