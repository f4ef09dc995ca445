"""Every solver on the same table: what a screened Poisson field must be, whoever computes it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from backends import DEVICES, use_backend
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp
from mpmath import mp, mpf

import spem
from spem.errors import ConvergenceError, ParameterError
from spem.fields.operator import assemble
from spem.fields.solvers.cg import ConjugateGradient
from spem.fields.solvers.direct import Direct
from spem.fields.solvers.explicit import ExplicitIteration
from spem.fields.solvers.gradients import MultigridGradients
from spem.fields.solvers.sweep import Sweep
from spem.shapes.shape import Cuts, Shape

SOLVERS = {
    "direct": Direct(),
    "cg": ConjugateGradient(rtol=1e-12),
    "explicit": ExplicitIteration(rtol=1e-11),
    "multigrid": MultigridGradients(rtol=1e-12),
    "sweep": Sweep(rtol=1e-10),
}
EXACT = 1e-8  # what all of them reach on the small shapes below


def hand(fingers: int = 4) -> Shape:
    """A palm with thin fingers: bulky and thin at once."""
    mask = np.zeros((44, 30), bool)
    mask[20:, 4:] = True
    for k in range(fingers):
        mask[2:20, 4 + 7 * k : 8 + 7 * k] = True
    return Shape.from_mask(mask, name="hand")


def blob(seed: int = 0) -> Shape:
    """A 3-D shape with random cuts on its boundary edges."""
    rng = np.random.default_rng(seed)
    x = np.stack(np.meshgrid(*[np.linspace(-1, 1, 11)] * 3, indexing="ij"))
    shape = Shape.from_mask(np.sum(x**2, axis=0) + 0.3 * x[0] * x[1] < 0.8, (1.0, 1.5, 0.8), name="blob")
    table = assemble(shape).domain.neighbours
    node, direction = np.nonzero(table == shape.n_nodes)
    cuts = Cuts(shape.voxels[node], direction.astype(np.uint8), rng.uniform(0.01, 1.0, node.size))
    return Shape(shape.mask, shape.spacing, shape.origin, "blob", cuts)


# Those that run on devices too, in the simulator of one and on one.
ON_DEVICES = [
    pytest.param((solver, device.values[0]), marks=device.marks, id=f"{solver} {device.values[0]}")
    for solver in ("multigrid", "sweep")
    for device in DEVICES
]


@pytest.fixture(params=[*(pytest.param((name, "host"), id=name) for name in SOLVERS), *ON_DEVICES])
def solver(request):
    name, device = request.param
    found = SOLVERS[name]
    return found if device == "host" else replace(found, device=use_backend(device))


@pytest.mark.parametrize("make", [hand, blob])
@pytest.mark.parametrize("boundary", ["surface", "voxel"])
def test_solves_the_equations(solver, make, boundary):
    """The field satisfies the linear system, computed independently in dense algebra."""
    system = assemble(make(), boundary)
    rho = np.array([0.7, 3.0, 40.0, np.inf])
    dense = system.matrix().toarray()
    exact = [np.linalg.solve(dense + np.diag(system.mass) / r**2, system.rhs) for r in rho]
    solution = solver.solve(system, rho)
    assert solution.converged
    assert np.abs(solution.values - np.stack(exact, axis=1)).max() < EXACT


def test_field_lies_in_zero_one_and_grows_with_rho(solver):
    """0 < v <= 1; v grows with ρ at every node and is one for ρ = inf."""
    v = solver.solve(assemble(hand()), np.array([1.0, 2.0, 5.0, 20.0, np.inf])).values
    assert np.all(v > -EXACT)
    assert np.all(v <= 1 + EXACT)
    assert np.all(np.diff(v, axis=1) > -EXACT)
    assert np.allclose(v[:, -1], 1.0, atol=EXACT)


def test_rotation_permutes_the_field(solver):
    """A rotation by 90 degrees permutes the field."""
    shape = hand()
    turned = Shape.from_mask(np.rot90(shape.mask))
    v, w = (s.to_grid(solver.solve(assemble(s), np.array([3.0])).values[:, 0]) for s in (shape, turned))
    assert np.allclose(np.rot90(v), w, atol=EXACT, equal_nan=True)


def test_unit_of_length_does_not_matter(solver):
    """Scaling spacing and ρ together leaves the field as it is."""
    shape = hand()
    scaled = Shape(shape.mask, (1e-3, 1e-3), (0.0, 0.0))
    v = solver.solve(assemble(shape), np.array([2.5])).values
    assert np.allclose(solver.solve(assemble(scaled), np.array([2.5e-3])).values, v, atol=EXACT)


@pytest.mark.parametrize(
    "cheap",
    [
        ConjugateGradient(max_iterations=2),
        ExplicitIteration(max_iterations=3),
        MultigridGradients(max_iterations=2),
        Sweep(max_blocks=0),
    ],
)
def test_failure_is_a_value_and_then_an_error(cheap):
    """A solve that misses its tolerance says so, and the error carries its best iterate."""
    system = assemble(hand())
    solution = cheap.solve(system, np.array([5.0]))
    assert not solution.converged
    with pytest.raises(
        ConvergenceError, match=r"hand: residual .* after \d+ iterations; raise rtol"
    ) as caught:
        solution.checked("hand")
    assert caught.value.solution.values.shape == (system.n_nodes, 1)


def test_failed_sweep_never_returns_a_hyperfield():
    """The hyperfield of a sweep that misses its tolerance is an error, not a field."""
    with pytest.raises(ConvergenceError, match="hand: residual"):
        Sweep(max_blocks=0).hyperfield(assemble(hand()), np.linspace(2, 9, 20))


@settings(max_examples=40, deadline=None)
@given(
    hnp.arrays(bool, hnp.array_shapes(min_dims=1, max_dims=3, min_side=1, max_side=9)).filter(np.any),
    st.lists(st.floats(0.2, 1e4), min_size=1, max_size=12),
    st.sampled_from(["surface", "voxel"]),
)
def test_sweep_agrees_with_the_direct_solver(mask, rho, boundary):
    """On any mask and any ρ the sweep keeps its tolerance, in few dimensions or many, few ρ or many."""
    system = assemble(Shape.from_mask(mask), boundary)
    wanted = np.array(rho)
    error = np.abs(Sweep().solve(system, wanted).values - Direct().solve(system, wanted).values)
    assert error.max() <= 1e-6


@pytest.mark.parametrize(
    ("counts", "spacing", "low", "high"),
    [((120, 120), (1, 100), 50, 3000), ((12, 30, 10), (1, 1, 30), 1, 300), ((60, 60), (1, 1), 0.3, 5000)],
)
def test_sweep_keeps_its_tolerance_on_hard_grids(counts, spacing, low, high):
    """Flat voxels and wide ranges of ρ make a cycle find less of an error; the sweep allows for it."""
    system = assemble(Shape.from_mask(np.ones(counts), spacing))
    rho = np.geomspace(low, high, 20)
    solution = Sweep().solve(system, rho)
    assert np.abs(solution.values - Direct().solve(system, rho).values).max() < 1e-6


@pytest.mark.parametrize("rtol", [1e-6, 1e-10])
def test_sweep_over_twelve_decades(rtol):
    """Shifts far below and far above all eigenvalues take no poles from those between."""
    shape = Shape.from_mask(np.ones((1, 90, 1)))
    rho = np.r_[1e-3, np.geomspace(0.1, 1e9, 12), 1e100]
    field = spem.sweep(shape, rho, boundary="voxel", rtol=rtol)
    exact = Direct().solve(assemble(shape, "voxel"), rho).values
    assert np.abs(field.fields() - exact).max() < rtol


def test_sweep_far_below_the_spacing_keeps_its_tolerance_beside_cut_edges():
    """Edges cut to all lengths down to a millionth have fields that vary at every ρ, however small."""
    rng = np.random.default_rng(0)
    whole = Shape.from_mask(rng.random((6, 6, 6)) < 0.6)
    node, direction = np.nonzero(assemble(whole).domain.neighbours == whole.n_nodes)
    cuts = Cuts(whole.voxels[node], direction.astype(np.uint8), 10.0 ** rng.uniform(-6, 0, node.size))
    system = assemble(Shape(whole.mask, whole.spacing, whole.origin, "grains", cuts))
    rho = np.geomspace(1e-3, 100, 200)
    exact = Direct().solve(system, rho).values
    assert np.abs(Sweep().hyperfield(system, rho).fields() - exact).max() < 1e-6


def test_a_tolerance_that_single_precision_cannot_hold_is_kept_in_double():
    """Columns are stored in single precision only where their rounding fits into the tolerance."""
    system, rho = assemble(Shape.from_mask(np.ones(770)), "voxel"), np.linspace(0.5, 40, 64)
    field = Sweep(rtol=3.1e-7).hyperfield(system, rho)
    assert field.error <= 3.1e-7
    assert np.abs(field.fields() - Direct().solve(system, rho).values).max() < 3.1e-7


@pytest.mark.parametrize("seed", range(4))
def test_sweep_keeps_a_tight_tolerance_below_the_spacing(seed):
    """What single precision left of the first solves is found, also where no other field is like theirs."""
    rng = np.random.default_rng(seed)
    system = assemble(Shape.from_mask(rng.random(1500) < 0.98))
    rho = np.geomspace(0.1, 50.0, 38)
    solution = Sweep(rtol=1e-9).solve(system, rho)
    assert solution.converged
    assert np.abs(solution.values - Direct().solve(system, rho).values).max() < 1e-9


@pytest.mark.parametrize("fraction", [1e-6, 1e-3, 1.0])
def test_edges_cut_short_cost_no_digits(fraction):
    """A surface a millionth of an edge from the nodes leaves a field that is right to 1e-10."""
    whole = Shape.from_mask(np.ones((20, 20)))
    node, direction = np.nonzero(assemble(whole).domain.neighbours == whole.n_nodes)
    cuts = Cuts(whole.voxels[node], direction.astype(np.uint8), np.full(node.size, fraction))
    shape = Shape(whole.mask, whole.spacing, whole.origin, "square", cuts)
    exact = Direct().solve(assemble(shape), np.array([5.0])).values[:, 0]
    assert np.abs(spem.field(shape, 5.0) - exact).max() < 1e-10


def test_a_useless_rho_or_tolerance_is_refused():
    """A ρ of a billionth of a voxel, or a tolerance of nothing, is named before any work."""
    with pytest.raises(ParameterError, match="hand: rho=1e-09 is below 1e-06 of the spacing 1"):
        spem.field(hand(), 1e-9)
    with pytest.raises(ParameterError, match="rtol=0: expected a tolerance between 0 and 1"):
        Sweep(rtol=0.0)
    with pytest.raises(ParameterError, match="threads=0: expected at least one thread"):
        Sweep(threads=0)


def test_threads_and_slabs_change_nothing():
    """A shape of many slabs has the same field, bit by bit, on any number of threads; and the right one."""
    mask = np.hypot(*np.indices((400, 360)) - 180) % 60 < 50
    system = assemble(Shape.from_mask(mask))
    assert system.n_nodes > 100_000
    rho = np.array([3.0, 20.0])
    one, two, many = (Sweep(threads=count).solve(system, rho).values for count in (1, 2, 5))
    assert np.array_equal(one, two)
    assert np.array_equal(one, many)
    assert np.abs(one - Direct().solve(system, rho).values).max() < 1e-6


def test_direct_solution_is_right_in_every_entry():
    """A value of 1e-60 deep inside is right to 1e-10 of itself, against 80-digit arithmetic."""
    length, rho = 121, mpf("0.4")
    mp.dps = 80
    a = mp.acosh(1 + 1 / (2 * rho**2))
    half = (length + 1) // 2
    exact = [mp.cosh(a * (i + 1 - half)) / mp.cosh(a * half) for i in range(length)]
    v = Direct().solve(assemble(Shape.from_mask(np.ones(length)), "voxel"), np.array([0.4])).values[:, 0]
    assert min(exact) < 1e-50
    assert max(abs(mpf(x) / y - 1) for x, y in zip(v.tolist(), exact, strict=True)) < 1e-10


@pytest.mark.parametrize(
    ("rho", "message"),
    [
        (0.0, "rho=0: expected a positive length"),
        (-2.0, "rho=-2: expected a positive length"),
        (float("nan"), "rho=nan: expected a positive length"),
        ([], "expected at least one positive number"),
        ("wide", "rho='wide': expected positive numbers"),
    ],
)
def test_bad_rho_is_refused(rho, message):
    """A ρ that is not a positive length is named."""
    with pytest.raises(ParameterError, match=message):
        spem.field(hand(), rho)


def test_a_shape_of_one_node_has_a_field():
    """The smallest shape there is has the closed form of one equation."""
    v = spem.field(Shape.from_mask(np.ones((1, 1))), 1.0, boundary="voxel")
    assert v == pytest.approx([4 / 5], abs=1e-9)
