"""Eigenpairs of the Laplacian: closed forms, orders, components, refusals."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from scipy.special import jn_zeros, jnp_zeros

import spem
from spem.errors import ConvergenceError, ParameterError, SizeError
from spem.fields.operator import assemble
from spem.fields.solvers import lanczos
from spem.fields.solvers.lanczos import BlockLanczos
from spem.fields.spectrum import Spectrum, solve_spectrum
from spem.shapes.shape import Cuts, Shape


def _box(counts: tuple[int, ...], spacing: float | tuple[float, ...] = 1.0) -> Shape:
    return Shape.from_mask(np.ones(counts), spacing)


def _exact(counts: tuple[int, ...], spacing: tuple[float, ...], boundary: str, count: int) -> np.ndarray:
    """Lowest eigenvalues of the discrete Laplacian of a box: 2 (1 - cos) / h² along each axis, summed."""
    axes = []
    for n, h in zip(counts, spacing, strict=True):
        angle = np.pi * np.arange(n) / n if boundary == "free" else np.pi * np.arange(1, n + 1) / (n + 1)
        axes.append(2 * (1 - np.cos(angle)) / h**2)
    return np.sort([sum(values) for values in itertools.product(*axes)])[:count]


@pytest.mark.parametrize("boundary", ["free", "absorbing"])
@pytest.mark.parametrize(
    ("counts", "spacing"),
    [((700,), (0.5,)), ((31, 17), (1.0, 2.0)), ((11, 11, 11), (1.0, 1.0, 1.0)), ((6, 6, 6, 6), (1.0,) * 4)],
)
def test_values_of_a_box_are_exact(counts, spacing, boundary):
    """In one to four dimensions, with all copies of multiple values."""
    found = solve_spectrum(_box(counts, spacing), 60, boundary=boundary, model="voxel")
    exact = _exact(counts, spacing, boundary, 60)
    assert np.allclose(found.values, exact, rtol=1e-9, atol=1e-9 * exact[-1])


def test_free_rod_has_the_cosines():
    """Its eigenvectors are √(2/L) cos(kπ(i + 1/2)/n), of unit L2 norm, and the first is constant."""
    found = solve_spectrum(_box((600,), 0.01), 3)
    position = (np.arange(600) + 0.5) / 600
    assert found.values[0] == 0.0
    assert np.allclose(found.vectors[:, 0], 1 / np.sqrt(6.0))
    assert np.allclose(np.abs(found.vectors[:, 1]), np.abs(np.sqrt(2 / 6) * np.cos(np.pi * position)))


@pytest.mark.parametrize("boundary", ["free", "absorbing"])
def test_vectors_are_orthonormal_in_the_shape(boundary):
    """ΣφφM h^d is the identity and AΦ = MΦΛ, also where the iteration is used on a curved shape."""
    shape = spem.synthetic.disk(radius=1.0, spacing=0.04)
    found = solve_spectrum(shape, 40, boundary=boundary)
    system = assemble(shape)
    mass = system.mass if boundary == "absorbing" else np.ones(shape.n_nodes)
    assert shape.n_nodes > 4 * 40
    assert np.allclose(found.vectors.T @ (mass[:, None] * found.vectors) * 0.04**2, np.eye(40), atol=1e-9)
    if boundary == "absorbing":
        defect = system.matrix() @ found.vectors - mass[:, None] * found.vectors * found.values
        assert np.abs(defect).max() < 1e-5 * found.values[-1]


def test_absorbing_disk_has_the_zeros_of_bessel_functions_to_second_order():
    """The cuts put φ = 0 on the circle."""
    exact = np.sort([zero**2 for order in range(6) for zero in [*jn_zeros(order, 3)] * (1 + (order > 0))])[:8]
    spacings = np.array([0.1, 0.05, 0.025])
    errors = [
        np.abs(
            solve_spectrum(
                spem.synthetic.disk(radius=1.0, spacing=h, offset=(0.3, 0.1)), 8, boundary="absorbing"
            ).values
            / exact
            - 1
        ).mean()
        for h in spacings
    ]
    assert errors[-1] < 2e-3
    assert np.polyfit(np.log(spacings), np.log(errors), 1)[0] > 1.7


def test_free_disk_tends_to_the_zeros_of_derivatives():
    """To first order, since its boundary is made of faces of voxels."""
    exact = np.sort(
        [0.0] + [zero**2 for order in range(5) for zero in [*jnp_zeros(order, 2)] * (1 + (order > 0))]
    )[:7]
    shape = spem.synthetic.disk(radius=1.0, spacing=0.02)
    found = solve_spectrum(shape, 7)
    assert np.allclose(found.values[1:], exact[1:], rtol=0.03)


def test_values_scale_with_the_square_of_length():
    """Twice the size has a quarter of the values, and 2^(-d/2) times the vectors."""
    small, large = (spem.synthetic.disk(radius=r, spacing=r / 15) for r in (1.0, 2.0))
    ours, theirs = solve_spectrum(small, 20), solve_spectrum(large, 20)
    assert np.allclose(ours.values, 4 * theirs.values)
    assert np.allclose(np.abs(ours.vectors[:, :2]), 2 * np.abs(theirs.vectors[:, :2]), atol=1e-6)


def test_components_are_solved_apart():
    """Twenty equal squares have each value twenty times; a cut between voxels parts a shape too."""
    mask = np.zeros((5, 60), bool)
    for k in range(20):
        mask[:4, 3 * k : 3 * k + 2] = True
    found = solve_spectrum(Shape.from_mask(mask), 45)
    assert np.count_nonzero(found.values == 0.0) == 20
    assert np.allclose(found.values[20:40], 2 - np.sqrt(2))
    cuts = Cuts(np.array([0, 1]), np.array([3, 2], np.uint8), np.array([0.2, 0.3]))
    slit = Shape.from_mask(np.ones((1, 2)), cuts=cuts)
    assert solve_spectrum(slit, 2).values.tolist() == [0.0, 0.0]
    assert solve_spectrum(slit, 2, model="voxel").values[1] == pytest.approx(2.0)


def test_large_components_beside_small_ones_keep_their_cuts():
    """Each component has the pairs that it has alone."""
    disk = spem.synthetic.disk(radius=1.0, spacing=0.07)
    width = disk.mask.shape[1]
    mask = np.zeros((disk.mask.shape[0], width + 6), bool)
    mask[:, :width] = disk.mask
    index = np.stack(np.unravel_index(disk.cuts.voxel, disk.mask.shape))
    cuts = Cuts(np.ravel_multi_index(tuple(index), mask.shape), disk.cuts.direction, disk.cuts.fraction)
    mask[5:7, width + 2 : width + 4] = True
    both = solve_spectrum(Shape.from_mask(mask, 0.07, cuts=cuts), 12, boundary="absorbing")
    alone = solve_spectrum(disk, 12, boundary="absorbing")
    assert np.allclose(both.values, alone.values)


def test_outcome_is_the_same_each_time_and_signed_by_rule():
    """The start is fixed, and third moments are positive."""
    shape = spem.creatures.creature("dog", rng=np.random.default_rng(0), voxels=1200)
    one, two = solve_spectrum(shape, 30), solve_spectrum(shape, 30)
    assert np.array_equal(one.vectors, two.vectors)
    assert (np.sum(one.vectors**3, axis=0) > 0).all()


def test_all_pairs_of_a_small_shape():
    """As many pairs as nodes; the vectors then resolve the identity."""
    found = solve_spectrum(_box((3, 4)), 12)
    assert np.allclose(found.vectors @ found.vectors.T, np.eye(12))
    assert repr(found).startswith("Spectrum('shape', 12 pairs on 12 nodes, free boundary, λ from 0 to 6.4")


def test_truncated_keeps_the_lowest():
    """And refuses more than there are."""
    found = solve_spectrum(_box((5, 5)), 10)
    assert np.array_equal(found.truncated(3).values, found.values[:3])
    assert isinstance(found.truncated(3), Spectrum)
    with pytest.raises(ParameterError, match="n_pairs=11: expected 1 to 10; solve for more"):
        found.truncated(11)
    with pytest.raises(ParameterError, match=r"n_pairs=2\.0: expected 1 to 10"):
        found.truncated(2.0)


@pytest.mark.parametrize("n_pairs", [0, 13, 2.5, True])
def test_impossible_numbers_of_pairs_are_refused(n_pairs):
    """The message says how many there are."""
    with pytest.raises(ParameterError, match="expected 1 to 12, the number of nodes"):
        solve_spectrum(_box((3, 4)), n_pairs)


def test_other_words_are_refused():
    """Both for the condition and for where the boundary lies."""
    with pytest.raises(ParameterError, match="expected 'free' or 'absorbing'"):
        solve_spectrum(_box((3, 4)), 2, boundary="neumann")
    with pytest.raises(ParameterError, match="expected one of 'surface', 'voxel'"):
        solve_spectrum(_box((3, 4)), 2, model="mesh")


def test_memory_limit_is_kept():
    """A basis over the limit is refused before it is made."""
    with pytest.raises(SizeError, match="use fewer voxels or pairs"):
        solve_spectrum(_box((40, 40)), 100, solver=BlockLanczos(memory_limit=10**6))


def test_a_missed_tolerance_is_an_error(monkeypatch):
    """Where the basis may grow no further; a tolerance below rounding is refused at once."""
    monkeypatch.setattr(lanczos, "_GROWTH", 1)
    with pytest.raises(ConvergenceError, match="from a basis of 36 vectors, expected 1e-10; raise rtol"):
        solve_spectrum(_box((30, 30)), 20, solver=BlockLanczos(rtol=1e-10))
    with pytest.raises(ParameterError, match="rtol=1e-20: expected 1e-12 to 1"):
        BlockLanczos(rtol=1e-20)
