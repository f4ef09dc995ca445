"""Division of shapes into parts of their region and of their boundary."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from sklearn.metrics import adjusted_rand_score

import spem
from spem.decomposition.division import boundary_parts, parts_of_factors, region_parts
from spem.decomposition.measurements import measurements
from spem.errors import ParameterError
from spem.fields.boundary.patches import patch_sources
from spem.fields.boundary.sources import point_sources
from spem.fields.operator import assemble
from spem.fields.superposition.fields import SourceFields, solve_sources
from spem.shapes.shape import Shape

BOTH = pytest.mark.parametrize("divide", [region_parts, boundary_parts])


def _fields(mask, boundary="voxel", rho=np.inf) -> SourceFields:
    """Solve for every boundary point of a mask."""
    return solve_sources(point_sources(assemble(Shape.from_mask(mask), boundary)), rho)


def _cross(arm: int = 10, width: int = 5) -> np.ndarray:
    """Return a cross of four equal arms."""
    mask = np.zeros((2 * arm + width,) * 2, bool)
    mask[arm : arm + width] = mask[:, arm : arm + width] = True
    return mask


def _two_squares() -> np.ndarray:
    """Return two squares apart, of 16 and 25 nodes."""
    mask = np.zeros((5, 12), bool)
    mask[:4, :4] = mask[:, 7:] = True
    return mask


@BOTH
@pytest.mark.parametrize("boundary", ["voxel", "surface"])
def test_arms_of_a_cross_are_its_parts(divide, boundary):
    """Four components are the four arms; each is a quarter, and its own boundary belongs to it."""
    parts = divide(_fields(_cross(), boundary), 4)
    centre = parts.shape.points - parts.shape.points.mean(axis=0)
    side = np.abs(centre).argmax(axis=1) * 2 + (centre.max(axis=1) > -centre.min(axis=1))
    arm = np.abs(centre).max(axis=1) > 3
    assert adjusted_rand_score(side[arm], parts.node_labels[arm]) == 1
    np.testing.assert_allclose(parts.sizes, 0.25, atol=0.06)
    ends = parts.sources.position - parts.shape.points.mean(axis=0)
    for source in np.flatnonzero(np.abs(ends).max(axis=1) > 6):
        near = np.argmin(np.linalg.norm(parts.shape.points - parts.sources.position[source], axis=1))
        assert parts.source_labels[source] == parts.node_labels[near]


@BOTH
def test_components_apart_are_parts(divide):
    """Sources reach nodes of their own square alone, and so do parts, numbered by size."""
    parts = divide(_fields(_two_squares()), 2)
    right = parts.shape.points[:, 1] > 5
    np.testing.assert_array_equal(parts.node_labels, np.where(right, 0, 1))
    np.testing.assert_array_equal(parts.source_labels, np.where(parts.sources.position[:, 1] > 5, 0, 1))
    assert repr(parts).endswith("sizes 61, 39 %)")


@BOTH
def test_sources_of_one_component_leave_the_other_without_part(divide):
    """What no source reaches has label -1."""
    whole = point_sources(assemble(Shape.from_mask(_two_squares()), "voxel"))
    right = whole.select(np.flatnonzero(whole.position[:, 1] > 5))
    parts = divide(solve_sources(right, np.inf), 2)
    np.testing.assert_array_equal(parts.node_labels < 0, parts.shape.points[:, 1] < 5)
    assert "39 % of the nodes in none" in repr(parts)
    assert parts.unexplained == pytest.approx(16 / 41)


@BOTH
def test_parts_turn_with_the_shape(divide):
    """Turned by 90 degrees, a shape has the same parts."""
    hand = spem.creatures.creature("hand", voxels=700, rng=np.random.default_rng(3)).mask
    upright, turned = divide(_fields(hand), 6), divide(_fields(np.rot90(hand)), 6)
    there = np.rot90(upright.shape.to_grid(upright.node_labels, -2))[turned.shape.mask]
    assert adjusted_rand_score(there, turned.node_labels) > 0.97


@BOTH
def test_parts_do_not_depend_on_the_seed(divide):
    """Parts and their numbers are the same for another seed."""
    fields = solve_sources(
        patch_sources(
            assemble(spem.creatures.creature("hand", voxels=700, rng=np.random.default_rng(1))), 80
        ),
        np.inf,
    )
    first, second = (divide(fields, 6, rng=np.random.default_rng(seed)) for seed in (1, 2))
    assert np.mean(first.node_labels == second.node_labels) > 0.98


@settings(max_examples=12, deadline=None)
@given(
    mask=arrays(bool, (5, 6)).filter(lambda m: m.sum() > 4),
    n_parts=st.integers(1, 4),
    sparsity=st.floats(0, 0.5),
    over=st.sampled_from(["region", "boundary"]),
    rho=st.sampled_from([1.0, np.inf]),
)
def test_shares_of_any_mask_add_up(mask, n_parts, sparsity, over, rho):
    """Labels, sizes and intensities of any mask are in their ranges and add up; larger parts come first."""
    fields = _fields(mask, rho=rho)
    if measurements(fields, over=over).max() == 0:
        return
    divide = region_parts if over == "region" else boundary_parts
    parts = divide(fields, n_parts, sparsity=sparsity)
    assert parts.n_parts == n_parts
    assert -1 <= parts.node_labels.min() <= parts.node_labels.max() < n_parts
    assert -1 <= parts.source_labels.min() <= parts.source_labels.max() < n_parts
    assert (np.diff(parts.sizes) <= 0).all()
    assert parts.sizes.sum() + parts.unexplained == pytest.approx(1)
    assert parts.intensity.sum() == pytest.approx(1)
    assert (parts.components >= 0).all()
    assert (np.linalg.norm(parts.basis, axis=1) <= 1 + 1e-9).all()


def test_scale_of_a_component_is_in_its_codes():
    """Factors A c and S / c have the parts of A and S; what neither explains has label -1."""
    fields = _fields(np.ones((2, 6)))
    components = np.zeros((2, 12))
    components[0, :5] = components[1, 5:11] = 1.0
    basis = np.ones((2, fields.sources.n_sources))
    measured = basis.T @ components
    measured[:, 11] = 1.0
    plain = parts_of_factors(fields, "region", measured, components, basis)
    scale = np.array([[1e-3], [1e3]])
    scaled = parts_of_factors(fields, "region", measured, components * scale, basis / scale)
    np.testing.assert_array_equal(plain.node_labels, [0] * 5 + [1] * 6 + [-1])
    np.testing.assert_array_equal(scaled.node_labels, plain.node_labels)
    np.testing.assert_allclose(scaled.intensity, [5 / 11, 6 / 11])
    np.testing.assert_allclose(np.linalg.norm(scaled.basis, axis=1), 1)


@pytest.mark.parametrize("rho", [0.02, np.inf])
def test_node_belongs_to_the_boundary_in_which_its_walk_ends(rho):
    """On an interval each half belongs to its own end, even where the fields vanish at tiny rho."""
    parts = boundary_parts(_fields(np.ones(40), rho=rho), 2)
    assert parts.source_labels.tolist() == [0, 1]
    np.testing.assert_array_equal(parts.node_labels, np.repeat([0, 1], 20))


def test_bad_numbers_are_refused():
    """Too many parts, and a sparsity at which nothing is left, are named with what is possible."""
    fields = _fields(np.ones((2, 3)))
    with pytest.raises(ParameterError, match="n_parts=7: expected 1 to 6, for it has 10 sources and 6 nodes"):
        region_parts(fields, 7)
    with pytest.raises(ParameterError, match="n_parts=0: expected 1 to 6"):
        boundary_parts(fields, 0)
    with pytest.raises(ParameterError, match=r"n_parts=2\.5: expected 1 to 6"):
        region_parts(fields, 2.5)
    with pytest.raises(ParameterError, match="n_parts=2: expected 1 to 6"):
        region_parts(fields, "2")
    for sparsity in (1.0, -0.1, np.nan, None, "0.1"):
        with pytest.raises(ParameterError, match="expected 0 to less than 1, where all codes vanish"):
            region_parts(fields, 2, sparsity=sparsity)


@BOTH
def test_one_node_has_nothing_to_divide(divide):
    """All sources of a single node are alike."""
    with pytest.raises(ParameterError, match="its 4 sources do not differ; there is nothing to divide"):
        divide(_fields(np.ones((1, 1))), 1)


@pytest.mark.data
@BOTH
@pytest.mark.parametrize(
    ("file", "tips"),
    [
        ("obj11_3.png", [(0.13, 0.03), (0.01, 0.35), (0.01, 0.62), (0.2, 0.98), (0.55, 0.95), (0.9, 0.4)]),
        ("obj9_1.png", [(0.06, 0.02), (0.35, 0.03), (0.62, 0.07), (0.84, 0.06), (0.99, 0.55), (0.05, 0.85)]),
    ],
)
def test_limbs_of_real_silhouettes_are_told_apart(data_dir, divide, file, tips):
    """Fingers and wrist of a hand, legs, tail and head of a cat lie in different parts."""
    shape = spem.read(data_dir / "tari1000" / file, inner_radius=12)
    parts = divide(solve_sources(patch_sources(assemble(shape), 150), np.inf), 8)
    low, high = shape.points.min(axis=0), shape.points.max(axis=0)
    places = low + np.array(tips) * (high - low)
    nearest = [int(np.argmin(np.linalg.norm(shape.points - place, axis=1))) for place in places]
    found = parts.node_labels[nearest]
    assert found.min() >= 0
    assert np.unique(found).size == len(tips)
