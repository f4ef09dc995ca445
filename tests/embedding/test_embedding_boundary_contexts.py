"""Boundary contexts: angles of ways, shares of bins, what changes nothing, the basis on the bins."""

from __future__ import annotations

import numpy as np
import pytest

from spem.embedding.boundary_contexts import boundary_contexts, context_basis, departure_angles, mirror_signs
from spem.embedding.boundary_response import BoundaryResponse, boundary_response
from spem.errors import ParameterError, ShapeError
from spem.fields.boundary.patches import patch_sources
from spem.fields.operator import assemble
from spem.shapes.shape import Shape
from spem.shapes.synthetic import annulus, ball, disk


def response(shape: Shape, count: int, rho: float) -> BoundaryResponse:
    """Return the fluxes between arcs of the outer contour."""
    sources = patch_sources(assemble(shape), count)
    return boundary_response(sources.select(np.flatnonzero(sources.contour == 0)), rho)


def test_angles_on_a_disk_are_those_of_its_chords() -> None:
    """A chord leaves a circle at half the angle that it spans."""
    found = response(disk(1.0, 0.01), 60, 0.06)
    angle = departure_angles(found)
    turn = (np.arange(60) - np.arange(60)[:, None]) % 60 * (2 * np.pi / 60)
    far = (turn > 1.0) & (turn < 2 * np.pi - 1.0)
    assert np.abs(angle[far] - turn[far] / 2).max() < 0.15
    assert np.abs(angle[far] - turn[far] / 2).mean() < 0.05


def test_ways_on_a_disk_are_its_chords() -> None:
    """Differences of lengths between far arcs of a disk are those of chords."""
    found = response(disk(1.0, 0.01), 40, 0.04)
    position = found.sources.position
    chord = np.linalg.norm(position[:, None] - position, axis=2)
    far = chord > 0.7
    slope, _ = np.polyfit(chord[far], found.distances[far], 1)
    assert abs(slope - 1.0) < 0.08


def test_shares_add_up_to_one_and_are_those_of_a_simple_count() -> None:
    """Each row adds up to 1, and with one bin of all else it is the count by angle alone."""
    found = response(disk(1.0, 0.05), 30, 0.2)
    shares = boundary_contexts(found, (1, 5, 1, 1))
    assert np.allclose(shares.sum(axis=1), 1.0)
    bin_of = np.minimum((departure_angles(found)[3] / np.pi * 5).astype(int), 4)
    others = np.arange(30) != 3
    expected = np.bincount(bin_of[others], found.sources.measure[others], 5)
    assert np.allclose(shares[3], expected / expected.sum())


@pytest.mark.parametrize("turns", [1, 2])
def test_quarter_turns_and_scale_change_nothing(turns: int) -> None:
    """A shape that is turned on its grid, or has another unit, has the same contexts from the same points."""
    mask = np.ones((20, 14), bool)
    mask[:9, :6] = False
    plain = boundary_contexts(response(Shape.from_mask(mask), 34, 3.0))
    turned = boundary_contexts(response(Shape.from_mask(np.rot90(mask, turns), 0.1), 34, 0.3))
    # contours begin elsewhere, where arcs are cut differently: what all arcs see together is compared
    assert np.abs(plain.mean(axis=0) - turned.mean(axis=0)).sum() < 0.35
    same = boundary_contexts(response(Shape.from_mask(mask, 0.1), 34, 0.3))
    assert np.abs(plain - same).mean() < 1e-3


def test_the_basis_is_orthonormal_and_smoothest_first() -> None:
    """The functions are orthonormal, whole with as many as bins, and begin with the constant."""
    for bins in ((4, 6, 6, 4), (2, 3, 1, 5), (1, 1, 1, 2)):
        size = int(np.prod(bins))
        basis = context_basis(size, bins)
        assert np.allclose(basis.T @ basis, np.eye(size))
        assert np.allclose(basis[:, 0], basis[0, 0])
    assert np.array_equal(context_basis(10), context_basis(60)[:, :10])


def test_signs_turn_the_basis_into_its_mirror_image() -> None:
    """Coefficients of reversed angles and places are those of the bins, times the signs."""
    bins = (3, 4, 5, 6)
    shares = np.random.default_rng(0).random(bins)
    basis, size = context_basis(360, bins), 360
    turned = shares[:, ::-1, ::-1, ::-1].reshape(size) @ basis
    assert np.allclose(turned, mirror_signs(size, bins) * (shares.reshape(size) @ basis))


def test_bad_input_is_refused() -> None:
    """Solids, several contours, no screening, too few sources and odd bins are refused."""
    with pytest.raises(ShapeError, match="3 dimensions"):
        boundary_contexts(boundary_response(patch_sources(assemble(ball(1.0, 0.25)), 10), 0.3))
    ring = patch_sources(assemble(annulus(0.5, 1.0, 0.1)), 20)
    with pytest.raises(ParameterError, match="20 sources on 2 contours"):
        boundary_contexts(boundary_response(ring, 0.3))
    with pytest.raises(ParameterError, match="finite rho"):
        departure_angles(response(disk(1.0, 0.1), 10, np.inf))
    with pytest.raises(ParameterError, match="1 sources on 1 contours"):
        boundary_contexts(response(disk(1.0, 0.1), 1, 0.3))
    with pytest.raises(ParameterError, match="four numbers of at least 1"):
        boundary_contexts(response(disk(1.0, 0.1), 10, 0.3), (4, 6, 6, 0))
    with pytest.raises(ParameterError, match="577 functions on 576 bins"):
        context_basis(577)
