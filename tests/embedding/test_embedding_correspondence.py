"""Corresponding nodes of two shapes."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import spem
from spem.embedding.correspondence import correspond, match_nodes, standardised, surroundings
from spem.errors import ParameterError
from spem.shapes.shape import Shape


@pytest.fixture(scope="module")
def hand() -> Shape:
    """Return a shape without symmetry."""
    return spem.creatures.creature("hand", voxels=1200, rng=np.random.default_rng(3))


def test_every_node_of_a_shape_without_symmetry_corresponds_to_itself(hand):
    """The nearest row to a row of the same table is that row."""
    maps = spem.maps(hand, 8, rtol=1e-9)
    np.testing.assert_array_equal(correspond(maps, maps), np.arange(hand.n_nodes))


def test_a_turned_shape_corresponds_node_by_node(hand):
    """A quarter turn permutes nodes, and nothing else."""
    mask = hand.mask
    turned = Shape.from_mask(np.rot90(mask), hand.spacing[0])
    plain = Shape.from_mask(mask, hand.spacing[0])
    number = np.full(mask.shape, -1)
    number[plain.mask] = np.arange(plain.n_nodes)
    truth = np.empty(plain.n_nodes, int)
    truth[np.rot90(number)[turned.mask]] = np.arange(turned.n_nodes)
    pair = [spem.maps(shape, 5, rtol=1e-9) for shape in (plain, turned)]
    assert (correspond(*pair) == truth).mean() > 0.99


def test_surroundings_raise_the_share_of_true_matches():
    """A node alone is taken for others of its depth; what surrounds it tells the part it is in."""
    poses = spem.creature_poses("hand", 2, voxels=1500, n_points=300, rng=np.random.default_rng(0))
    nodes = [
        np.argmin(((shape.points[:, None] - points) ** 2).sum(axis=2), axis=0)
        for shape, points in zip(poses.shapes, poses.points, strict=True)
    ]
    source, target = (spem.maps(shape, 8, rtol=1e-9) for shape in poses.shapes)
    around = correspond(source, target, nodes[0])
    alone = match_nodes(standardised(source.values)[nodes[0]], standardised(target.values))
    far = [np.linalg.norm(target.shape.points[m] - poses.points[1], axis=1).mean() for m in (around, alone)]
    assert far[0] < far[1] / 2


def test_surroundings_solve_the_reflected_equation():
    """On a rod f = cos(πx/l) is an eigenfunction: its average is f over 1 + (πρ/l)², to half a step."""
    n, rho = 200, 0.3
    x = (np.arange(n) + 0.5) / n
    rod = Shape.from_mask(np.ones(n), spacing=1 / n)
    wave = np.cos(np.pi * x)
    # The sum of two, or standardisation would hide the factor.
    mixed = surroundings(rod, wave + np.cos(3 * np.pi * x), [rho / rod.size])[:, 0]
    expected = wave / (1 + (np.pi * rho) ** 2) + np.cos(3 * np.pi * x) / (1 + (3 * np.pi * rho) ** 2)
    np.testing.assert_allclose(mixed, expected / expected.std(), atol=1 / (2 * n))


def test_surroundings_do_not_cross_cut_edges_or_components():
    """Values of one component say nothing about another."""
    two = Shape.from_mask([1, 1, 1, 0, 1, 1, 1])
    base = surroundings(two, [1, 2, 3, 0, 0, 0], [5.0])[:, 0]
    np.testing.assert_allclose(np.ptp(base[3:]), 0, atol=1e-12)


def test_anisotropic_shapes_and_four_dimensions():
    """Any dimension and spacing will do."""
    for shape in (
        Shape.from_mask(np.ones((4, 5)), (1.0, 2.5)),
        Shape.from_mask(np.ones((3, 3, 2, 2))),
    ):
        values = np.arange(2 * shape.n_nodes, dtype=float).reshape(-1, 2)
        found = surroundings(shape, values, [0.2, 1.0])
        assert found.shape == (shape.n_nodes, 4)
        assert np.isfinite(found).all()


@given(st.integers(0, 2**31), st.floats(0.1, 1e6), st.floats(-1e3, 1e3))
@settings(max_examples=20, deadline=None)
def test_standardised_columns_forget_scale_and_offset(seed, scale, offset):
    """An affine change of a column leaves its standardised values."""
    column = np.random.default_rng(seed).normal(size=(30, 1))
    np.testing.assert_allclose(standardised(scale * column + offset), standardised(column), atol=1e-6)


def test_constant_columns_become_zero():
    """They say nothing, and divide by nothing."""
    assert not standardised(np.full((5, 2), 0.1)).any()


def test_what_does_not_fit_is_refused(hand):
    """Each message says what came and what was expected."""
    maps, fewer = spem.maps(hand, 4), spem.maps(hand, 3)
    with pytest.raises(ParameterError, match=r"expected \(n, k\) and \(m, k\) of one k"):
        correspond(maps, fewer)
    with pytest.raises(ParameterError, match="expected Maps, got Shape; make maps of both shapes"):
        correspond(hand, maps)
    with pytest.raises(ParameterError, match="there is no node 999999"):
        correspond(maps, maps, [999999])
    with pytest.raises(ParameterError, match=r"expected \(n,\) numbers of nodes"):
        correspond(maps, maps, [0.5])
    with pytest.raises(ParameterError, match="expected positive lengths"):
        correspond(maps, maps, lengths=[0.1, 0.0])
    with pytest.raises(ParameterError, match="one row a node"):
        surroundings(hand, np.ones(3))
    with pytest.raises(ParameterError, match="expected finite numbers at all nodes"):
        surroundings(Shape.from_mask(np.ones(4)), [0.0, np.nan, 0.0, 1.0])
    assert surroundings(Shape.from_mask(np.ones(4)), [0.0, 0.0, 0.0, 1.0], np.array([0.1, 0.3])).shape == (
        4,
        2,
    )
    with pytest.raises(ParameterError, match=r"\(3, 0\) and \(2, 0\): expected"):
        match_nodes(np.zeros((3, 0)), np.zeros((2, 0)))
    with pytest.raises(ParameterError, match="hold NaN or inf"):
        match_nodes([[np.nan]], [[1.0]])
