"""Geodesic distances on triangle surfaces."""

from __future__ import annotations

import numpy as np
import trimesh
from scipy.spatial import Delaunay

from spem.rivals.fast_marching import Fans, geodesic_disk


def test_plane_is_exact() -> None:
    """On a triangulated plane distances are Euclidean but for obtuse faces, and never shorter."""
    rng = np.random.default_rng(1)
    points = np.concatenate([rng.random((300, 2)), [[0, 0], [0, 1], [1, 0], [1, 1]]])
    faces = Delaunay(points).simplices.astype(np.int64)
    vertices = np.column_stack([points, np.zeros(len(points))])
    source = int(np.argmin(np.linalg.norm(points - 0.5, axis=1)))
    near, distances = geodesic_disk(vertices, Fans.of(faces, len(vertices)), source, 0.3)
    exact = np.linalg.norm(points[near] - points[source], axis=1)
    assert (distances >= exact - 1e-12).all()
    np.testing.assert_allclose(distances, exact, rtol=0.02)


def test_sphere_gives_arcs() -> None:
    """On a sphere distances are the arcs of great circles, to a hundredth."""
    ball = trimesh.creation.icosphere(subdivisions=4)
    near, distances = geodesic_disk(ball.vertices, Fans.of(ball.faces, len(ball.vertices)), 0, 2.0)
    arcs = np.arccos(np.clip(ball.vertices[near] @ ball.vertices[0], -1, 1))
    np.testing.assert_allclose(distances, arcs, atol=0.02)
    assert (np.diff(distances) >= 0).all()
    assert distances.max() <= 2.0


def test_disk_stops_at_the_radius() -> None:
    """A radius below the shortest edge leaves the source alone."""
    ball = trimesh.creation.icosphere(subdivisions=1)
    near, distances = geodesic_disk(ball.vertices, Fans.of(ball.faces, len(ball.vertices)), 5, 0.01)
    assert near.tolist() == [5]
    assert distances.tolist() == [0.0]
