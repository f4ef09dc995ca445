"""Maps of several shapes compared: distributions, bases, scales, kinds, poses."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

import spem
from spem.paper.class_distances import ClassDistances
from spem.paper.consistency import (
    PAPER_RHO,
    basis_cosines,
    distribution_distances,
    judge_poses,
    largest_subspace_angle,
    paper_rho,
)
from spem.paper.pose_regions import clear_values, pose_maps, regions, shadow
from spem.paper.regions import region_sizes, roughness, separation, separation_at_depth
from spem.paper.scaling import scaled, signal_to_noise, values_at


def test_the_papers_rho_grows_with_the_shape():
    """2 to 30 for an inner radius of 20, twice that for one of 40."""
    for radius in (20.0, 40.0):
        rho = paper_rho(spem.synthetic.disk(radius=radius, spacing=1.0))
        assert np.allclose(rho, PAPER_RHO * radius / 20, rtol=0.02)


def test_distributions_do_not_depend_on_the_order_of_the_nodes():
    """A rotated shape is no farther than rounding from itself."""
    shape = spem.synthetic.star_polygon(9, radius=20.0, spacing=1.0)
    turned = spem.Shape.from_mask(np.rot90(shape.mask))
    plain = spem.Shape.from_mask(shape.mask)
    found = distribution_distances([spem.maps(s, 3, rho=PAPER_RHO) for s in (plain, turned)])
    assert found.max() < 1e-4


def test_angles_between_turned_bases_are_known():
    """Two vectors turned by 30 degrees in their plane span the same plane."""
    c, s = np.cos(np.pi / 6), np.sin(np.pi / 6)
    plain, turned = np.eye(3)[:, :2], np.array([[c, -s], [s, c], [0, 0]])
    several = [SimpleNamespace(basis=plain), SimpleNamespace(basis=turned)]
    assert np.allclose(basis_cosines(several)[0, 1], c)
    assert largest_subspace_angle(several) == pytest.approx(0, abs=1e-5)


def test_a_map_that_differs_between_poses_is_named():
    """The verdict follows from the distances."""
    distances = np.zeros((3, 3, 2))
    distances[0, 1] = distances[1, 0] = 1, 3
    distances[:2, 2] = distances[2, :2] = 2
    claim = judge_poses("Poses are alike.", distances, 2, "hands")
    assert claim.verdict == "differs"
    assert claim.note.startswith("P₂ differs")


def test_maps_of_a_scaled_shape_on_scaled_rho_are_the_same_at_the_same_places():
    """To the accuracy of the grid: 40 dB are a hundredth of the range."""
    disk = spem.synthetic.disk(radius=20.0, spacing=1.0)
    plain = spem.maps(disk, 3, rho=PAPER_RHO)
    large = spem.maps(scaled(disk, 2.0), 3, rho=2 * PAPER_RHO)
    assert signal_to_noise(plain.values, values_at(large, 2 * disk.points)).min() > 35
    fixed = spem.maps(scaled(disk, 2.0), 3, rho=PAPER_RHO)
    assert signal_to_noise(plain.values, values_at(fixed, 2 * disk.points)).max() < 30


def test_separation_is_the_area_under_the_curve():
    """Ties count half, and what depends on depth alone separates nothing at equal depth."""
    assert separation([1, 2, 2, 3], [False, True, False, True]) == 0.875
    rng = np.random.default_rng(0)
    depth, marked = rng.uniform(2, 9, 4000), rng.random(4000) < 0.3
    assert separation_at_depth(np.floor(depth), marked, depth) == 0.5


def test_a_steeper_map_is_rougher_only_relative_to_its_spread():
    """Roughness has no unit of its own."""
    disk = spem.synthetic.disk(radius=9.0, spacing=1.0)
    x = disk.points[:, :1]
    assert roughness(disk, np.hstack([x, 5 * x, np.cos(2 * x)])).round(6).tolist()[:2] == pytest.approx(
        [roughness(disk, x)[0]] * 2, abs=1e-5
    )
    assert roughness(disk, np.cos(2 * x))[0] > 3 * roughness(disk, x)[0]


def test_pieces_below_a_share_are_left_out():
    """Pieces that touch at a corner are one."""
    square = spem.Shape.from_mask(np.ones((10, 10)))
    inside = np.zeros((10, 10), bool)
    inside[:2, :2] = inside[2:4, 2:4] = inside[9, 9] = True
    assert region_sizes(square, inside.ravel()) == [0.08, 0.01]
    assert region_sizes(square, inside.ravel(), least=0.02) == [0.08]


def test_kin_that_mix_are_not_apart():
    """One shape nearer to another kind than to its own."""
    points = np.array([0.0, 1.0, 2.9, 4.0, 9.0, 9.5])
    found = ClassDistances.of(np.abs(points[:, None] - points), ["a", "a", "b", "b", "c", "c"])
    assert found.nearest == 1.0
    points[2] = 1.6
    mixed = ClassDistances.of(np.abs(points[:, None] - points), ["a", "a", "b", "b", "c", "c"])
    assert mixed.pair("a", "b")[2] is False
    assert mixed.pair("a", "b")[1] == 1


def test_regions_have_one_threshold_for_all_poses():
    """The shares of balls of two sizes are nearly equal: ρ is in inner radii."""
    balls = [spem.synthetic.ball(radius=r, spacing=1.0) for r in (10.0, 12.0)]
    several = pose_maps(balls, 3)
    for region in regions(several, [1, 2]):
        assert region.variation < 0.1
        assert (region.pieces == region.pieces[0]).all()
    flat = clear_values(several[0], 1, (-0.1, 0.1))
    shell = np.linalg.norm(balls[0].points, axis=1) > 9.5
    assert np.abs(flat[shell]).max() <= 0.1 + 1e-6


def test_the_shadow_of_a_ball_is_a_disk():
    """Its area is that of the disk, and its largest piece is kept."""
    disk = shadow(spem.synthetic.ball(radius=10.0, spacing=1.0))
    assert disk.ndim == 2
    assert disk.volume == pytest.approx(np.pi * 100, rel=0.03)
