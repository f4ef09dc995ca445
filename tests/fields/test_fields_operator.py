"""Domain and operator: the matrix of the screened Poisson equation."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from spem.errors import ParameterError
from spem.fields.domain import surface_domain, voxel_domain
from spem.fields.operator import assemble
from spem.shapes.shape import Cuts, Shape

MASKS = hnp.arrays(bool, hnp.array_shapes(min_dims=1, max_dims=4, min_side=1, max_side=5)).filter(np.any)


def _slit() -> Shape:
    """Two voxels side by side with two surfaces between them, at 0.2 from the left and 0.3 from the right."""
    mask = np.ones((1, 2), bool)
    cuts = Cuts(np.array([0, 1]), np.array([3, 2], np.uint8), np.array([0.2, 0.3]))
    return Shape.from_mask(mask, cuts=cuts)


@settings(max_examples=60, deadline=None)
@given(MASKS, st.sampled_from(["surface", "voxel"]), st.integers(0, 3))
def test_matrix_is_a_symmetric_m_matrix(mask, boundary, seed):
    """A is symmetric, has non-positive entries off the diagonal, and A·1 is the right-hand side."""
    spacing = tuple(np.random.default_rng(seed).uniform(0.5, 2, mask.ndim))
    system = assemble(Shape.from_mask(mask, spacing), boundary)
    matrix = system.matrix().toarray()
    assert np.array_equal(matrix, matrix.T)
    assert np.all(matrix[~np.eye(len(matrix), dtype=bool)] <= 0)
    assert np.allclose(matrix.sum(axis=1), system.rhs)
    assert np.all(system.rhs >= 0)
    assert system.rhs.sum() > 0


@settings(max_examples=60, deadline=None)
@given(MASKS, st.sampled_from(["surface", "voxel"]), st.integers(0, 99))
def test_the_system_is_the_sum_over_its_boundary_edges(mask, boundary, seed):
    """Neighbours, fractions, b and both diagonals are those of sums over edges in NumPy, bit by bit."""
    rng = np.random.default_rng(seed)
    shape = _randomly_cut(Shape.from_mask(mask, tuple(rng.uniform(0.5, 2, mask.ndim))), rng)
    system, domain = assemble(shape, boundary), assemble(shape, boundary).domain
    neighbours, fraction = _by_edges(shape, boundary)
    assert np.array_equal(domain.neighbours, neighbours)
    assert np.array_equal(domain.fraction, fraction)
    node, direction = domain.boundary_edges
    cut, n = system.weights[direction // 2], shape.n_nodes
    rhs = np.bincount(node, cut / fraction, n)
    assert np.array_equal(system.rhs, rhs)
    assert np.array_equal(system.diagonal, 2 * system.weights.sum() - np.bincount(node, cut, n) + rhs)
    assert np.array_equal(system.mass, 1 - np.bincount(node, 1 - fraction, n) / (2 * shape.ndim))


def _randomly_cut(shape: Shape, rng) -> Shape:
    """About half of the edges of a shape cut somewhere, inner ones from both sides."""
    table, d = voxel_domain(shape).neighbours, shape.ndim
    found = {}
    for i in range(shape.n_nodes):
        for k in range(2 * d):
            if rng.random() < 0.5 and (i, k) not in found:
                found[i, k] = rng.uniform(0.01, 1.0)
                if table[i, k] < shape.n_nodes:
                    found[int(table[i, k]), k ^ 1] = rng.uniform(0.01, 1.0)
    if not found:
        return shape
    node, direction = np.array(list(found)).T
    cuts = Cuts(shape.voxels[node], direction.astype(np.uint8), np.array(list(found.values())))
    return Shape(shape.mask, shape.spacing, shape.origin, "cut", cuts)


def _by_edges(shape: Shape, boundary: str):
    """Neighbours and boundary fractions, edge by edge on the grid."""
    cuts, n, strides = shape.cuts, shape.n_nodes, np.array(shape.mask.strides)
    number = {int(voxel): i for i, voxel in enumerate(shape.voxels)}
    listed = dict(
        zip(zip(cuts.voxel.tolist(), cuts.direction.tolist(), strict=True), cuts.fraction, strict=True)
    )
    neighbours, fraction = np.full((n, 2 * shape.ndim), n, np.int32), []
    for i, voxel in enumerate(shape.voxels.tolist()):
        for k in range(2 * shape.ndim):
            theta = listed.get((voxel, k)) if boundary == "surface" else None
            end = number.get(voxel + int(strides[k // 2]) * (1 if k % 2 else -1))
            if theta is None and end is not None:
                neighbours[i, k] = end
            else:
                usual = 0.5 if boundary == "surface" else 1.0
                fraction.append(usual if theta is None else theta)
    return neighbours, np.array(fraction)


def test_cut_fraction_divides_the_weight():
    """A boundary edge cut at θ adds 1/(θ h²) to the diagonal and to the right-hand side."""
    cuts = Cuts(np.array([0]), np.array([1], np.uint8), np.array([0.25]))
    system = assemble(Shape.from_mask(np.ones(1), 0.5, cuts=cuts))
    assert system.matrix().toarray().item() == pytest.approx(4 / 0.25 + 4 / 0.5)
    assert system.rhs.item() == pytest.approx(24.0)


def test_edge_between_two_inside_voxels_can_be_cut():
    """Two surfaces between neighbours separate them for `surface` and not for `voxel`."""
    shape = _slit()
    assert surface_domain(shape).fraction[np.array([3, 6])].tolist() == [0.2, 0.3]
    assert assemble(shape).matrix().nnz == 2
    assert np.count_nonzero(voxel_domain(shape).neighbours < 2) == 2


def test_voxel_boundary_lies_at_the_neighbouring_centre():
    """The paper's boundary is one whole edge away, whatever the cuts."""
    assert np.all(voxel_domain(_slit()).fraction == 1.0)


def test_neighbours_are_mutual():
    """The node above the node below a node is the node itself."""
    shape = Shape.from_mask(np.random.default_rng(0).random((6, 5, 4)) < 0.6)
    table = surface_domain(shape).neighbours
    node, direction = np.nonzero(table < shape.n_nodes)
    assert np.array_equal(table[table[node, direction], direction ^ 1], node)


def test_unknown_boundary_is_refused():
    """A boundary model that does not exist is named, with those that do."""
    with pytest.raises(ParameterError, match="boundary='wall': expected one of 'surface', 'voxel'"):
        assemble(Shape.from_mask(np.ones(3)), "wall")  # type: ignore[arg-type]
