"""Canonical forms: distances along surfaces, scaling, bent strips."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.distance import cdist

from spem.rivals.canonical_form import (
    canonical_form,
    classical_scaling,
    least_squares_scaling,
    surface_distances,
)
from spem.shapes.surface import Surface


def strip(bend: float, n_long: int = 25, n_wide: int = 5) -> Surface:
    """A strip 6 long and 1 wide, as an arc of angle `bend`."""
    along, across = np.linspace(-3, 3, n_long), np.linspace(-0.5, 0.5, n_wide)
    s, y = (grid.ravel() for grid in np.meshgrid(along, across, indexing="ij"))
    radius = 6 / bend if bend else np.inf
    x, z = (radius * np.sin(s / radius), radius * np.cos(s / radius)) if bend else (s, np.zeros_like(s))
    number = np.arange(n_long * n_wide).reshape(n_long, n_wide)
    a, b, c, d = (
        part.ravel() for part in (number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:])
    )
    faces = np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])
    return Surface(np.stack([x, y, z], axis=1), faces)


def test_distances_on_a_plane_are_nearly_straight() -> None:
    """Fast marching on a flat strip has the Euclidean distances."""
    surface = strip(0.0)
    found, wanted = surface_distances(surface), cdist(surface.vertices, surface.vertices)
    assert (found == found.T).all()
    assert np.abs(found - wanted).max() < 0.03


def test_distances_between_components_are_the_largest() -> None:
    """Vertices that no path joins get the largest distance of any that one does."""
    one = strip(0.0, 4, 2)
    n = len(one.vertices)
    both = Surface(
        np.concatenate([one.vertices, one.vertices + 50]), np.concatenate([one.faces, one.faces + n])
    )
    found = surface_distances(both)
    assert np.allclose(found[:n, n:], found[:n, :n].max())


def test_classical_scaling_finds_points_again() -> None:
    """Euclidean distances come back exactly, and a line in three axes stays a line."""
    points = np.random.default_rng(0).normal(size=(20, 3))
    distances = cdist(points, points)
    assert np.allclose(cdist(*[classical_scaling(distances)] * 2), distances)
    line = cdist(points[:, :1], points[:, :1])
    assert np.allclose(classical_scaling(line)[:, 1:], 0, atol=1e-6)


@pytest.mark.parametrize("n", [2, 3, 30])
def test_classical_scaling_of_few_points(n: int) -> None:
    """Fewer points than axes leave axes flat."""
    points = np.arange(float(n))[:, None]
    assert classical_scaling(cdist(points, points)).shape == (n, 3)


def test_stress_never_rises() -> None:
    """Each iteration lowers the stress, whatever the distances and the start."""
    rng = np.random.default_rng(1)
    distances = rng.uniform(1, 2, (30, 30))
    distances = np.triu(distances, 1) + np.triu(distances, 1).T
    found = least_squares_scaling(distances, rng.normal(size=(30, 3)), tolerance=0, max_iterations=60)
    assert (np.diff(found.stress) <= 1e-9 * found.stress[0]).all()
    assert found.stress[-1] < found.stress[0] / 2
    assert not found.converged


def test_scaling_is_exact_where_it_can_be() -> None:
    """From points moved a little, Euclidean distances are met again, with the mean at the origin."""
    rng = np.random.default_rng(2)
    points = rng.normal(size=(15, 3))
    distances = cdist(points, points)
    start = points + rng.normal(scale=0.05, size=points.shape)
    found = least_squares_scaling(distances, start, tolerance=1e-14)
    assert np.allclose(cdist(found.points, found.points), distances, atol=1e-4)
    assert np.allclose(found.points.mean(axis=0), 0)


def test_points_that_fall_together_are_no_trouble() -> None:
    """A start with two points at one place does not divide by zero."""
    found = least_squares_scaling(1.0 - np.eye(3), np.array([[0.0, 0], [0, 0], [1, 0]]))
    assert np.isfinite(found.points).all()


def test_a_bent_strip_flattens() -> None:
    """A strip bent to half a circle has the canonical form of the flat one: flat, and as long."""
    flat, bent = canonical_form(strip(0.0)).vertices, canonical_form(strip(np.pi)).vertices
    spread = np.linalg.svd(bent - bent.mean(axis=0), compute_uv=False)
    before = np.linalg.svd(strip(np.pi).vertices - strip(np.pi).vertices.mean(axis=0), compute_uv=False)
    assert spread[2] < 0.02 * spread[0]
    assert before[1] > 0.3 * before[0]
    assert np.abs(cdist(flat, flat) - cdist(bent, bent)).max() < 0.15
