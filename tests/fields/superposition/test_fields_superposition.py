"""Fields of all sources at one ρ: they sum to v, keep to their component and to the memory limit."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

import spem
from spem.errors import ConvergenceError, ParameterError, SizeError
from spem.fields.boundary.sources import point_sources
from spem.fields.operator import assemble
from spem.fields.solvers.cg import ConjugateGradient
from spem.fields.solvers.direct import Direct
from spem.fields.solvers.explicit import ExplicitIteration
from spem.fields.solvers.sweep import Sweep
from spem.fields.superposition.fields import solve_sources, source_values
from spem.shapes.shape import Cuts, Shape

MASKS = hnp.arrays(
    bool, hnp.array_shapes(min_dims=1, max_dims=4, min_side=1, max_side=6), elements=st.booleans()
)
BOUNDARIES = ("surface", "voxel")


def two_parts(boundary):
    """Two bars apart, and the sources of both."""
    mask = np.zeros((20, 7), bool)
    mask[:8], mask[12:, 1:6] = True, True
    return point_sources(assemble(Shape.from_mask(mask, name="bars"), boundary))


@given(
    MASKS.filter(np.any), st.sampled_from(BOUNDARIES), st.sampled_from([0.3, 2.0, 40.0, np.inf]), st.randoms()
)
@settings(max_examples=30, deadline=None)
def test_fields_sum_to_the_field(mask, boundary, rho, random):
    """Σ v^{p_i} = v to rounding (2.3) on any mask of one to four dimensions, with any cuts and spacing."""
    spacing = tuple(random.choice([0.1, 1.0, 7.0]) for _ in range(mask.ndim))
    shape = Shape.from_mask(mask, spacing)
    system = assemble(shape, "surface")
    node, direction = np.nonzero(system.domain.neighbours == shape.n_nodes)
    fraction = np.array([random.choice([1e-6, 0.2, 0.7, 1.0]) for _ in node])
    cuts = Cuts(shape.voxels[node], direction.astype(np.uint8), fraction)
    system = assemble(Shape(shape.mask, spacing, shape.origin, cuts=cuts), boundary)
    fields = solve_sources(point_sources(system), rho)
    whole = Direct().solve(system, np.array([rho])).values[:, 0]
    assert np.allclose(fields.values.sum(axis=0), whole, rtol=1e-12, atol=0)
    assert fields.log.max() < 1e-12


@pytest.mark.parametrize("boundary", BOUNDARIES)
@pytest.mark.parametrize("rho", [3.0, np.inf])
def test_interval_has_its_closed_form(boundary, rho):
    """In one dimension the two fields are sinh of the distance to the other end (linear for ρ = inf)."""
    n = 400
    log = solve_sources(point_sources(assemble(Shape.from_mask(np.ones(n)), boundary)), rho).log
    offset = 0.5 if boundary == "surface" else 1.0
    length, x = n - 1 + 2 * offset, np.arange(n) + offset
    if np.isinf(rho):
        exact = np.log1p(-x / length)
    else:  # decay of the discrete equation, 2 cosh a = 2 + 1/ρ²
        a = np.arccosh(1 + 0.5 / rho**2)
        exact = np.log(np.sinh(a * (length - x)) / np.sinh(a * length))
    if boundary == "voxel" or np.isinf(rho):
        assert np.allclose(log, [exact, exact[::-1]], rtol=1e-12, atol=1e-12)
    else:
        assert np.allclose(log, [exact, exact[::-1]], rtol=0.01, atol=0.02)


@pytest.mark.parametrize("boundary", BOUNDARIES)
def test_other_components_are_not_reached(boundary):
    """The log is -inf in components that a source does not touch and finite in its own, never NaN."""
    sources = two_parts(boundary)
    fields = solve_sources(sources, np.inf)
    upper = np.arange(sources.system.n_nodes) < 56
    touches = sources.position[:, 0] < 10
    assert np.array_equal(np.isfinite(fields.log), touches[:, None] == upper)
    assert not np.isnan(fields.log).any()
    assert np.array_equal(fields.values > 0, np.isfinite(fields.log))
    assert np.allclose(fields.values.sum(axis=0), 1.0, rtol=1e-14)


def test_other_components_are_not_reached_below_the_range_of_floats():
    """What is too small for float64 is told from what is zero."""
    mask = np.zeros((700, 6), bool)
    mask[:, :2], mask[:, 4:] = True, True
    sources = point_sources(assemble(Shape.from_mask(mask), "voxel"))
    ends = [int(np.abs(sources.position - end).sum(axis=1).argmin()) for end in ([-1, 0], [700, 5])]
    log = solve_sources(sources.select(ends), 1.0).log.reshape(2, 700, 4)
    assert log[0, :, :2].min() < -900
    assert np.isfinite(log[0, :, :2]).all()
    assert np.isneginf(log[0, :, 2:]).all()
    assert np.allclose(log[0, :, :2], log[1, ::-1, :1:-1], rtol=1e-13)


def test_a_voxel_between_two_components_reaches_both():
    """In the voxel model an outside voxel may be next to two components."""
    sources = point_sources(assemble(Shape.from_mask(np.array([[1, 0, 1]])), "voxel"))
    between = int(np.abs(sources.position - [0, 1]).sum(axis=1).argmin())
    assert np.allclose(solve_sources(sources, np.inf).values[between], [0.25, 0.25])


def test_points_without_a_source_stay_zero():
    """Sources that were left out add nothing, and numbers of sources follow the selection."""
    sources = point_sources(assemble(Shape.from_mask(np.ones((5, 6))), "voxel"))
    all_fields = solve_sources(sources, 4.0).log
    assert np.allclose(solve_sources(sources.select([7, 2]), 4.0).log, all_fields[[7, 2]], rtol=1e-14)


def test_one_node():
    """A shape of one node has a field for each of its boundary points."""
    fields = solve_sources(point_sources(assemble(Shape.from_mask(np.ones((1, 1))), "voxel")), np.inf)
    assert np.allclose(fields.values, 0.25)


def test_memory_limit_says_how_many_fit():
    """Too many fields for the limit are refused before anything is solved, with the number that fits."""
    sources = point_sources(assemble(Shape.from_mask(np.ones((40, 50)), name="slab"), "voxel"))
    message = (
        "slab: 180 fields of 2000 nodes need 2.81 MiB, the limit is 1.9.* MiB and 121 would fit; .* SPEM_MEM"
    )
    with pytest.raises(SizeError, match=message):
        solve_sources(sources, np.inf, memory_limit=2_000_000)
    fit = solve_sources(sources.select(np.arange(121)), np.inf, memory_limit=2_000_000).log
    assert np.array_equal(np.isfinite(fit), np.ones((121, 2000), bool))


def test_blocks_do_not_show():
    """Fields solved a few at a time are those solved together, and progress counts them."""
    sources = point_sources(assemble(Shape.from_mask(np.ones((20, 30))), "voxel"))
    calls = []
    few = solve_sources(
        sources, 5.0, memory_limit=8 * 600 * (100 + 4 * 7), progress=lambda *call: calls.append(call)
    )
    assert calls == [("sources", min(k, 100), 100) for k in range(7, 106, 7)]
    assert np.allclose(few.log, solve_sources(sources, 5.0).log, rtol=1e-14, atol=1e-14)


def test_conjugate_gradients_give_values_and_no_logs():
    """An iterative solver is right relative to each maximum; its logarithms are refused by name."""
    sources = point_sources(assemble(Shape.from_mask(np.ones((12, 60))), "surface"))
    values = source_values(sources, 9.0, solver=ConjugateGradient())
    exact = source_values(sources, 9.0)
    assert np.abs(values - exact).max() < 1e-9
    assert np.abs(values / exact - 1).max() > 1e-3
    with pytest.raises(ParameterError, match=r"solver=ConjugateGradient: right only relative .* use Direct"):
        solve_sources(sources, 9.0, solver=ConjugateGradient())


def test_conjugate_gradients_that_stop_early_say_so():
    """A field that misses the tolerance is an error that carries the best iterate."""
    sources = point_sources(assemble(Shape.from_mask(np.ones((30, 30)), name="slab")))
    with pytest.raises(ConvergenceError, match=r"slab: residual .* or solve with Direct") as caught:
        source_values(sources, np.inf, solver=ConjugateGradient(max_iterations=3))
    assert caught.value.solution.values.shape[0] == 900


def test_prepared_gradients_keep_the_form_of_what_they_solve():
    """One right-hand side comes back as one, several as columns; zero gives zero."""
    system = assemble(Shape.from_mask(np.ones((8, 9))))
    prepared = ConjugateGradient(rtol=1e-12).prepare(system, 0.1)
    one = prepared.solve(system.rhs)
    several = prepared.solve(np.stack([system.rhs, 0 * system.rhs], axis=1))
    assert one.shape == (72,)
    assert np.array_equal(several, np.stack([one, 0 * one], axis=1))
    assert np.allclose(one, Direct().prepare(system, 0.1).solve(system.rhs), rtol=1e-9)


@pytest.mark.parametrize("solver", [Sweep(), ExplicitIteration()])
def test_solvers_of_the_whole_boundary_are_refused(solver):
    """A solver that takes no other right-hand side is named, and those that do."""
    sources = point_sources(assemble(Shape.from_mask(np.ones(5))))
    message = f"solver={type(solver).__name__}: solves for the whole boundary only; .* Direct"
    for call in (solve_sources, source_values):
        with pytest.raises(ParameterError, match=message):
            call(sources, np.inf, solver=solver)


@pytest.mark.parametrize("rho", [0.0, -1.0, np.nan, [1.0, 2.0], 1e-9, "x"])
def test_bad_rho_is_refused(rho):
    """One positive length that is not nothing beside the spacing, or inf."""
    with pytest.raises(ParameterError, match="rho="):
        solve_sources(point_sources(assemble(Shape.from_mask(np.ones(5)))), rho)


@pytest.mark.data
@pytest.mark.parametrize("boundary", BOUNDARIES)
def test_real_hand(data_dir, boundary):
    """All sources of a real silhouette sum to one for ρ = inf, and none reaches its far end as zero."""
    shape = spem.read(data_dir / "tari1000" / "obj11_3.png", inner_radius=20)
    fields = solve_sources(point_sources(assemble(shape, boundary)), np.inf)
    assert np.allclose(fields.values.sum(axis=0), 1.0, rtol=1e-12)
    assert np.isfinite(fields.log).all()
