"""Finer and coarser surfaces, and points spread over them."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh

from spem.errors import ParameterError, ShapeError
from spem.shapes.remeshing import decimate, subdivide
from spem.shapes.surface import Surface
from spem.shapes.surface_points import spread_points


@pytest.fixture(scope="module")
def sphere() -> Surface:
    """Return an icosphere of 642 vertices."""
    mesh = trimesh.creation.icosphere(3)
    return Surface(np.array(mesh.vertices, np.float64), np.array(mesh.faces, np.int64))


def test_subdivision_moves_nothing(sphere: Surface) -> None:
    """Each face becomes four of the same area together; enough vertices stay as they are."""
    fine = subdivide(sphere, 700)
    assert (len(fine.faces), fine.closed) == (4 * len(sphere.faces), True)
    assert np.isclose(fine.area, sphere.area)
    assert subdivide(sphere, 642) is sphere


def test_decimation_keeps_a_sphere(sphere: Surface) -> None:
    """A decimated sphere is closed, within the budget, and said to be decimated."""
    coarse = decimate(sphere, 200)
    assert len(coarse.vertices) <= 200
    assert coarse.closed
    assert coarse.area == pytest.approx(4 * np.pi, rel=0.08)
    assert coarse.repairs[-1].startswith("decimated from 642 vertices to")
    assert decimate(sphere, 642) is sphere


def test_surface_without_faces_is_not_cut() -> None:
    """Points alone never become more."""
    with pytest.raises(ShapeError, match="3 vertices has no faces to cut"):
        subdivide(Surface(np.eye(3), np.empty((0, 3), np.int64)), 10)


def test_too_few_vertices_are_refused(sphere: Surface) -> None:
    """No closed surface has three vertices."""
    with pytest.raises(ParameterError, match="n_vertices=3: expected at least 4"):
        decimate(sphere, 3)


def test_points_are_even(sphere: Surface) -> None:
    """Half of a surface has half of the points, however it is meshed."""
    squeezed = Surface(sphere.vertices * [1, 1, 0.2], sphere.faces)
    points = spread_points(squeezed, 4000).interpolate(squeezed.vertices)
    assert np.mean(points[:, 0] > 0) == pytest.approx(0.5, abs=0.01)
    assert np.abs(points.mean(axis=0)).max() < 0.02


def test_surface_without_area_has_no_points(sphere: Surface) -> None:
    """Points need an area, and a number."""
    with pytest.raises(ShapeError, match="no area"):
        spread_points(Surface(0 * sphere.vertices, sphere.faces), 5)
    with pytest.raises(ParameterError, match="count=0: expected at least 1"):
        spread_points(sphere, 0)


def test_order_of_faces_and_corners_moves_no_point():
    """A file of the same mesh, its faces shuffled and their corners rolled, gives the same points."""
    rng = np.random.default_rng(0)
    mesh = trimesh.creation.icosphere(2)
    vertices = np.asarray(mesh.vertices) * [1.0, 1.3, 1.7] + 0.05 * rng.random(mesh.vertices.shape)
    faces = np.asarray(mesh.faces, np.int64)
    shuffled = np.stack([np.roll(face, rng.integers(3)) for face in rng.permutation(faces)])
    one, two = (
        spread_points(Surface(vertices, each), 500).interpolate(vertices) for each in (faces, shuffled)
    )
    np.testing.assert_allclose(one, two, atol=1e-12)
