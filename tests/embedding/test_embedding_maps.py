"""SPEM maps: the singular value decomposition of the hyperfield, its accuracy and its signs."""

from __future__ import annotations

import numpy as np
import pytest

import spem
from spem.embedding.maps import compute_maps, principal_components
from spem.errors import ParameterError
from spem.fields.operator import assemble
from spem.fields.solvers.direct import Direct
from spem.shapes.shape import Shape

RHO = np.linspace(2.0, 20.0, 48)


@pytest.fixture(scope="module")
def cross() -> Shape:
    mask = np.zeros((45, 40), bool)
    mask[18:25] = True
    mask[:, 12:22] = True
    return Shape.from_mask(mask, name="cross")


@pytest.fixture(scope="module")
def decomposition(cross):
    """Dense reference: exact fields and their singular value decomposition."""
    y = Direct().solve(assemble(cross), RHO).values
    return y, *np.linalg.svd(y, full_matrices=False)


def test_singular_values_down_to_1e_9(cross, decomposition):
    """Components of 1e-9 of the strongest are right to a thousandth."""
    _, _, size, _ = decomposition
    count = int(np.sum(size > 1e-9 * size[0]))
    maps = spem.maps(cross, rho=RHO, rtol=1e-12, n_maps=count)
    assert count >= 8
    assert size[count - 1] < 1e-8 * size[0]
    assert np.allclose(np.sqrt(maps.variance * cross.n_nodes), size[:count], rtol=1e-3)


def test_default_maps_agree_with_dense_ones(cross, decomposition):
    """The six maps of a default sweep are those of exact fields, to a thousandth of each."""
    y, _, size, right = decomposition
    maps = spem.maps(cross, rho=RHO)
    dense = y @ right[:6].T
    dense *= np.sign(np.sum(dense * maps.values, axis=0))
    assert np.all(np.linalg.norm(maps.values - dense, axis=0) < 1e-3 * size[:6])


def test_projection_is_the_field_times_the_basis(cross):
    """P = YΦ (4.4), Φ is orthonormal, and the maps are uncorrelated."""
    field = spem.sweep(cross, rho=RHO, rtol=1e-10)
    maps = compute_maps(field, 5)
    assert np.allclose(maps.values, field.fields() @ maps.basis, atol=1e-9)
    assert np.allclose(maps.basis.T @ maps.basis, np.eye(5), atol=1e-12)
    gram = maps.values.T @ maps.values / cross.n_nodes
    assert np.allclose(gram, np.diag(maps.variance), atol=1e-12 * maps.variance[0])


def test_centred_maps_have_zero_mean(cross, decomposition):
    """With the mean field removed, variances are those of the covariance matrix."""
    y = decomposition[0]
    maps = spem.maps(cross, rho=RHO, rtol=1e-10, n_maps=4, centred=True)
    eigenvalues = np.linalg.eigvalsh(np.cov(y.T, bias=True))[::-1]
    assert np.allclose(maps.values.mean(axis=0), 0, atol=1e-9)
    assert np.allclose(maps.variance, eigenvalues[:4], rtol=1e-6)


def test_explained_sums_to_one(cross):
    """All components together explain everything."""
    maps = spem.maps(cross, rho=RHO, n_maps=RHO.size)
    assert maps.explained.sum() == pytest.approx(1.0)
    assert np.all(np.diff(maps.variance) <= 1e-12)
    assert maps.values.shape == (cross.n_nodes, RHO.size)


def test_sign_does_not_flip_between_near_identical_shapes(cross):
    """Taking one voxel away moves each of six maps by little, none to its negative."""
    mask = cross.mask.copy()
    mask[tuple(np.argwhere(mask)[0])] = False
    near = Shape.from_mask(mask)
    a, b = (spem.maps(s, rho=RHO).basis for s in (cross, near))
    assert np.all(a[-1] > 0)
    assert np.all(np.sum(a * b, axis=0) > 0.99)


def test_sign_is_that_of_the_largest_rho(cross):
    """The order of the samples changes neither a map nor its sign."""
    field = spem.sweep(cross, rho=RHO)
    turned = compute_maps(field.resampled(RHO[::-1]))
    assert np.allclose(turned.values, compute_maps(field).values, atol=1e-5)


def test_nothing_explains_nothing(cross):
    """Where no variance is, no map explains any of it."""
    assert np.array_equal(spem.maps(cross, 1, rho=[np.inf], centred=True).explained, [0.0])


def test_options_of_a_sweep_are_refused_with_a_hyperfield(cross):
    """A hyperfield has its own samples; others are not silently ignored."""
    with pytest.raises(ParameterError, match="maps of a hyperfield: rho, n_rho"):
        spem.maps(spem.sweep(cross), n_rho=8)


def test_maps_do_not_depend_on_the_unit(cross):
    """With the default range, a shape in other units has the same maps."""
    scaled = Shape(cross.mask, (0.2, 0.2), (0.0, 0.0))
    assert np.allclose(spem.maps(cross).values, spem.maps(scaled).values, atol=1e-5)


def test_small_matrices_are_enough(cross):
    """Basis, variances and what maps are mixed of come without the nodes."""
    field = spem.sweep(cross, rho=RHO, rtol=1e-10)
    maps = compute_maps(field, 4)
    found = principal_components(field.gram, field.coefficients(), RHO, cross.n_nodes, 4)
    assert np.allclose(found.mix[0] + field.basis @ found.mix[1:], maps.values, atol=1e-9)
    assert np.array_equal(found.basis, maps.basis)
    assert np.array_equal(found.variance, maps.variance)
    assert found.total_variance == maps.total_variance


def test_labels(cross):
    """The labelled form counts maps from one."""
    maps = spem.maps(cross, rho=RHO, n_maps=3)
    assert maps.to_xarray().coords["map"].values.tolist() == [1, 2, 3]
    assert maps.to_xarray(grid=True).dims == ("axis_0", "axis_1", "map")


def test_too_many_maps_are_refused(cross):
    """There are no more maps than sampled ρ."""
    with pytest.raises(ParameterError, match="n_maps=9: expected 1 to 2, the number of sampled rho"):
        spem.maps(cross, rho=[2.0, 4.0], n_maps=9)


@pytest.mark.parametrize("counts", [(1,), (2,), (3,), (1, 1), (1, 1, 1, 1)])
def test_a_few_nodes_have_maps(counts):
    """Also where there are no more nodes than dimensions of the basis and the constant together."""
    shape = Shape.from_mask(np.ones(counts))
    maps = spem.maps(shape, 3)
    fields = np.stack([spem.field(shape, rho, solver=Direct()) for rho in maps.rho], axis=1)
    assert np.allclose(maps.values, fields @ maps.basis, atol=1e-5)
    assert np.isfinite(spem.maps(shape, 3, centred=True).values).all()


def test_components_that_are_not_there_are_zero():
    """On one node every field is one number: the first map has it all, the others are zero, not noise."""
    maps = spem.maps(Shape.from_mask(np.ones((1, 1))), n_maps=4)
    assert maps.values[0, 0] > 0
    assert np.array_equal(maps.values[0, 1:], np.zeros(3))
    assert np.array_equal(maps.variance[1:], np.zeros(3))
