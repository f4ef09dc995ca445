"""Mean value coordinates against what they must reproduce."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st

from spem.errors import ParameterError
from spem.rivals.mean_value import carry_inside, mean_value_coordinates
from spem.shapes.surface import Surface


def _torus() -> Surface:
    """Return a surface that is not convex."""
    mesh = trimesh.creation.torus(2.0, 0.7, 24, 12)
    return Surface(np.asarray(mesh.vertices), np.asarray(mesh.faces, np.int64))


@settings(max_examples=20, deadline=None)
@given(place=st.tuples(*[st.floats(-3, 3)] * 3))
def test_linear_functions_are_reproduced(place: tuple[float, float, float]) -> None:
    """At any point, inside or outside, coordinates sum to one and give the point back."""
    torus = _torus()
    weights = mean_value_coordinates(torus, [place])
    assert weights.sum() == pytest.approx(1)
    # far outside a non-convex surface weights of both signs cancel
    assert weights @ torus.vertices == pytest.approx(np.array([place]), abs=1e-6)


def test_inside_is_right_to_rounding() -> None:
    """Inside a surface the linear function is reproduced to rounding."""
    torus = _torus()
    angle = np.linspace(0, 6, 30)
    inside = np.stack([2 * np.cos(angle), 2 * np.sin(angle), 0.3 * np.sin(5 * angle)], axis=1)
    assert carry_inside(torus, torus.vertices, inside) == pytest.approx(inside, abs=1e-12)


def test_on_the_surface_they_are_those_of_the_face() -> None:
    """On a vertex, an edge or a face nothing but its corners counts."""
    torus = _torus()
    corners = torus.vertices[torus.faces[7]]
    barycentric = np.array([[1.0, 0, 0], [0.5, 0.5, 0], [0.2, 0.3, 0.5]])
    weights = mean_value_coordinates(torus, barycentric @ corners)
    expected = np.zeros_like(weights)
    expected[:, torus.faces[7]] = barycentric
    assert weights == pytest.approx(expected, abs=1e-7)


def test_a_moved_turned_and_scaled_surface_has_the_same_coordinates() -> None:
    """Coordinates are invariant to similarity."""
    torus = _torus()
    rng = np.random.default_rng(0)
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    points = np.array([[2.0, 0.1, 0.2], [-1.5, -0.9, -0.1]])
    moved = Surface(5 * torus.vertices @ turn + 3, torus.faces)
    found = mean_value_coordinates(moved, 5 * points @ turn + 3)
    assert found == pytest.approx(mean_value_coordinates(torus, points), abs=1e-10)


def test_the_boundary_value_is_reached_continuously() -> None:
    """Close to a vertex the interpolant tends to its value."""
    torus = _torus()
    values = np.random.default_rng(1).normal(size=(len(torus.vertices), 1))
    near = 1e-7 * np.array([2.0, 0, 0]) + (1 - 1e-7) * torus.vertices[:1]
    assert carry_inside(torus, values, near) == pytest.approx(values[:1], abs=1e-4)


def test_no_point_gives_no_value() -> None:
    """An empty set of points is no error."""
    torus = _torus()
    assert carry_inside(torus, torus.vertices, np.empty((0, 3))).shape == (0, 3)


def test_points_of_the_plane_are_refused() -> None:
    """Points need three coordinates."""
    with pytest.raises(ParameterError, match=r"points of shape \(1, 2\): expected \(n_points, 3\)"):
        mean_value_coordinates(_torus(), [[0.0, 1.0]])
