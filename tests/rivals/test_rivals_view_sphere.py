"""Directions of views and the symmetries that permute them."""

from __future__ import annotations

import numpy as np

from spem.rivals.view_sphere import axis_symmetries, geodesic_sphere, view_permutations


def test_views_lie_on_the_sphere_apart() -> None:
    """There are 66 unit vectors, none within 20 degrees of another, summing to zero."""
    views = geodesic_sphere()
    assert views.shape == (66, 3)
    assert np.allclose(np.linalg.norm(views, axis=1), 1)
    assert np.allclose(views.sum(axis=0), 0)
    assert np.sort(views @ views.T, axis=1)[:, -2].max() < np.cos(np.deg2rad(20))


def test_symmetries_are_orthogonal() -> None:
    """All are signed permutation matrices; the first half are rotations, led by the identity."""
    matrices = axis_symmetries()
    assert np.allclose(matrices @ matrices.transpose(0, 2, 1), np.eye(3))
    assert np.array_equal(matrices[0], np.eye(3))
    assert np.allclose(np.linalg.det(matrices), np.repeat([1, -1], 24))


def test_permutations_form_a_group_of_48() -> None:
    """The permutations are distinct and closed under composition; 24 of them are the rotations' own group."""
    every = view_permutations()
    known = {tuple(row) for row in every}
    assert len(known) == 48
    assert all(sorted(row) == list(range(66)) for row in known)
    assert {tuple(a[b]) for a in every for b in every} == known
    rotations = {tuple(row) for row in every[:24]}
    assert {tuple(a[b]) for a in every[:24] for b in every[:24]} == rotations


def test_permutations_move_views_exactly() -> None:
    """A view lands on the view that its permutation says, so none is between two."""
    views = geodesic_sphere()
    moved = np.einsum("gij,kj->gki", axis_symmetries(), views)
    assert np.allclose(moved, views[view_permutations()])


def test_views_fall_into_four_kinds() -> None:
    """Symmetries mix 6, 12, 24 and 24 views among themselves."""
    kinds = {tuple(sorted(set(column))) for column in view_permutations().T}
    assert sorted(map(len, kinds)) == [6, 12, 24, 24]
