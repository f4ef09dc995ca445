"""Conjugate gradients for many sources: accuracy, batches, memory, and where they are refused."""

from __future__ import annotations

import numpy as np
import pytest
from backends import DEVICES, needs_simulator, use_backend
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp
from simulator import Simulated

import spem
from spem.errors import ConvergenceError, ParameterError, SizeError
from spem.fields.boundary.patches import patch_sources
from spem.fields.boundary.sources import point_sources
from spem.fields.operator import assemble
from spem.fields.solvers.cg import ConjugateGradient
from spem.fields.solvers.direct import Direct
from spem.fields.solvers.gradients import MultigridGradients
from spem.fields.solvers.host import Host
from spem.fields.superposition.fields import solve_sources, source_values
from spem.fields.superposition.hyperfield import SourceHyperfield
from spem.fields.superposition.slices import prepare_slice
from spem.shapes.shape import Cuts, Shape


class _Small:
    """A device that holds so many copies of a system and no more; it remembers what was asked of it."""

    def __init__(self, room):
        self.room, self.asked, self.closed = room, [], 0

    def open(self, systems, dtype):
        self.asked.append(len(systems))
        if len(systems) > self.room:
            msg = f"{len(systems)} shapes of {systems[0].n_nodes} nodes do not fit"
            raise SizeError(msg)
        engine = Host().open(systems, dtype)
        close = engine.close

        def counted():
            self.closed += 1
            close()

        engine.close = counted
        return engine


def hook() -> Shape:
    """A solid that is bulky here and thin there."""
    mask = np.zeros((14, 12, 9), bool)
    mask[:7] = True
    mask[7:, 2:5, 3:5] = True
    return Shape.from_mask(mask, (1.0, 0.8, 1.2), name="hook")


@pytest.fixture(scope="module")
def sources():
    return point_sources(assemble(hook()))


@pytest.fixture(scope="module")
def rhs(sources):
    return sources.rhs[:, :44].toarray()


@pytest.mark.parametrize("rho", [0.5, 4.0, np.inf])
def test_single_sources_agree_with_the_direct_solver(sources, rho):
    """At any ρ, Laplace too, fields of single sources are right to about the tolerance."""
    direct = source_values(sources, rho)
    found = source_values(sources, rho, solver=MultigridGradients(rtol=1e-9))
    assert np.all(np.abs(found - direct).max(axis=1) <= 1e-8 * direct.max(axis=1))


@settings(max_examples=15, deadline=None)
@given(
    hnp.arrays(bool, hnp.array_shapes(min_dims=1, max_dims=4, min_side=1, max_side=7)).filter(np.any),
    st.one_of(st.floats(0.1, 1e4), st.just(np.inf)),
    st.integers(0, 9),
)
def test_any_shape_converges(mask, rho, seed):
    """On any mask with voxels of any form the default settings keep the tolerance."""
    spacing = tuple(10 ** np.random.default_rng(seed).uniform(-1, 0, mask.ndim))
    sources = point_sources(assemble(Shape.from_mask(mask, spacing)))
    direct = source_values(sources, rho)
    found = source_values(sources, rho, solver=MultigridGradients())
    assert np.all(np.abs(found - direct).max(axis=1) <= 1e-7 * direct.max(axis=1))


@pytest.mark.parametrize("spread", [0.0, 6.0])
def test_edges_cut_short_cost_no_digits(spread):
    """Cuts a millionth of an edge from the nodes, or anywhere from there up, leave fields right to 1e-8."""
    whole, rng = hook(), np.random.default_rng(1)
    node, direction = assemble(whole).domain.boundary_edges
    cuts = Cuts(
        whole.voxels[node], direction.astype(np.uint8), 10 ** (spread * rng.uniform(size=node.size) - 6)
    )
    shape = Shape(whole.mask, whole.spacing, whole.origin, "hook", cuts)
    for sources in (patch_sources(assemble(shape), 12, rng), point_sources(assemble(shape)).select(range(9))):
        direct = source_values(sources, np.inf)
        found = source_values(sources, np.inf, solver=MultigridGradients(rtol=1e-9))
        assert np.all(np.abs(found - direct).max(axis=1) <= 1e-8 * direct.max(axis=1))


def test_a_single_node_needs_no_iteration():
    """Where no node has a neighbour, b/diagonal is the solution."""
    system = assemble(Shape.from_mask([1, 0, 1]))
    found = MultigridGradients(max_iterations=1).prepare(system, 0.5).solve(np.eye(2))
    assert np.array_equal(found, np.diag(1 / (system.diagonal + 0.5 * system.mass)))


def test_together_sources_are_the_whole_boundary(sources):
    """The fields of all sources sum to v (2.3)."""
    solver = MultigridGradients(rtol=1e-11)
    total = source_values(sources, 3.0, solver=solver).sum(axis=0)
    assert np.abs(total - spem.field(hook(), 3.0, solver=solver)).max() < 1e-8


def test_one_right_hand_side_keeps_its_form(sources, rhs):
    """A vector comes back as a vector, columns as columns, none as none."""
    part = MultigridGradients().prepare(sources.system, 0.1)
    assert part.solve(rhs[:, 0]).shape == (sources.system.n_nodes,)
    assert np.array_equal(part.solve(rhs[:, 0]), part.solve(rhs)[:, 0])
    assert part.solve(rhs[:, :0]).shape == (sources.system.n_nodes, 0)


@pytest.mark.parametrize(
    ("room", "asked", "closed"), [(6, [6], 1), (5, [6, 3], 1), (2, [6, 3, 1], 1), (1, [6, 3, 1], 1)]
)
def test_a_device_takes_as_many_groups_as_fit(sources, rhs, room, asked, closed):
    """Out of memory halves the batch, down to one group; the answers are the same bits."""
    device = _Small(room)
    found = MultigridGradients(device=device).prepare(sources.system, 0.1).solve(rhs)
    assert np.array_equal(found, MultigridGradients().prepare(sources.system, 0.1).solve(rhs))
    assert (device.asked, device.closed) == (asked, closed)


def test_memory_that_runs_out_later_halves_the_batch_too(sources, rhs):
    """A device that fails while it solves is closed, and asked for half."""
    device = _Small(8)
    open_whole = device.open

    def open_failing(systems, dtype):
        engine = open_whole(systems, dtype)
        if len(systems) > 2:

            def fail(groups):
                msg = "out of memory"
                raise SizeError(msg)

            engine.load = fail
        return engine

    device.open = open_failing
    found = MultigridGradients(device=device).prepare(sources.system, 0.1).solve(rhs)
    assert np.array_equal(found, MultigridGradients().prepare(sources.system, 0.1).solve(rhs))
    assert (device.asked, device.closed) == ([6, 3, 1], 3)


@pytest.mark.parametrize("name", DEVICES)
def test_kernels_agree_with_the_direct_solver(sources, rhs, name):
    """On devices, too: right in double precision, and the same bits in any group, lane and company."""
    solver = MultigridGradients(rtol=1e-11, device=use_backend(name))
    for shift in (0.0, 0.1):
        part = solver.prepare(sources.system, shift)
        found, direct = part.solve(rhs[:, :20]), Direct().prepare(sources.system, shift).solve(rhs[:, :20])
        assert np.all(np.abs(found - direct).max(axis=0) <= 1e-9 * direct.max(axis=0))
        assert np.array_equal(part.solve(rhs[:, 5:12]), found[:, 5:12])


@pytest.mark.parametrize("name", DEVICES)
def test_kernels_take_a_shift_a_lane(name):
    """On devices, too, several ρ of the whole boundary share lanes."""
    system, rho = assemble(hook()), np.array([0.3, 2.0, 50.0, np.inf])
    solution = MultigridGradients(rtol=1e-10, device=use_backend(name)).solve(system, rho)
    assert solution.converged
    assert np.abs(solution.values - Direct().solve(system, rho).values).max() < 1e-8


@needs_simulator
def test_the_memory_of_the_simulator_sets_the_batch(sources, rhs):
    """A device that opens three groups and cannot load them takes fewer at a time, to the same bits."""
    system, memory = sources.system, 1 << 19
    while not _fits(system, 3, memory):
        memory = memory * 9 // 8
    found = MultigridGradients(device=Simulated(memory=memory)).prepare(system, 0.1).solve(rhs)
    assert np.array_equal(found, MultigridGradients(device=Simulated()).prepare(system, 0.1).solve(rhs))
    with pytest.raises(SizeError, match=r"1 shape of 798 nodes .*take about"):
        MultigridGradients(device=Simulated(memory=memory // 8)).prepare(system, 0.1).solve(rhs)


def _fits(system, copies, memory):
    try:
        Simulated(memory=memory).open([system] * copies, np.float32).close()
    except SizeError:
        return False
    return True


def test_a_device_without_room_for_one_group_is_an_error(sources, rhs):
    """When not even one group fits, the device's own message comes through."""
    with pytest.raises(SizeError, match="1 shapes of 798 nodes do not fit"):
        MultigridGradients(device=_Small(0)).prepare(sources.system, 0.1).solve(rhs)


def test_several_rho_of_the_whole_boundary_share_lanes():
    """Eleven ρ, each in its own lane, come to the same bits as one by one, infinity to one."""
    system, rho = assemble(hook()), np.append(np.geomspace(0.3, 1e6, 10), np.inf)
    solver = MultigridGradients(rtol=1e-11)
    solution = solver.solve(system, rho)
    assert solution.converged
    assert np.all(solution.values[:, -1] == 1)
    assert np.array_equal(solution.values[:, 4:5], solver.solve(system, rho[4:5]).values)
    exact = Direct().solve(system, rho).values
    assert np.abs(solution.values - exact).max() < 1e-9


def test_a_long_strip_converges():
    """Ten thousand nodes in a row, the worst condition there is, take few iterations of any lane."""
    system = assemble(Shape.from_mask(np.ones((1, 10_000))))
    rhs = np.zeros((system.n_nodes, 2))
    rhs[0, 0] = rhs[5000, 1] = 1.0
    found = MultigridGradients(rtol=1e-8, max_iterations=60).prepare(system, 0.0).solve(rhs)
    exact = Direct().prepare(system, 0.0).solve(rhs)
    assert np.abs(found - exact).max() < 1e-6 * exact.max()


def test_a_missed_tolerance_carries_the_best_iterate(sources, rhs):
    """Too few iterations are an error with the residual, the iterations, advice and the values so far."""
    part = MultigridGradients(rtol=1e-9, max_iterations=2).prepare(sources.system, 0.0)
    with pytest.raises(
        ConvergenceError, match=r"hook: residual .* of a source's field after 2 iterations; raise"
    ) as caught:
        part.solve(rhs)
    solution = caught.value.solution
    system = sources.system
    guess, values = rhs / system.diagonal[:, None], solution.values
    first, residual = (np.linalg.norm(rhs - system.matrix() @ v, axis=0) for v in (guess, values))
    assert np.allclose(solution.residual, residual / first, rtol=1e-5)
    assert np.all(first < np.linalg.norm(rhs, axis=0))
    assert solution.residual.max() < 1
    assert solution.iterations == 2 * rhs.shape[1]


def test_logarithms_are_refused(sources):
    """Logs need every entry; the refusal names the solver and the way out, wherever they are asked for."""
    solver = MultigridGradients()
    message = "solver=MultigridGradients: right only relative to each field's maximum.* use Direct"
    with pytest.raises(ParameterError, match=message):
        solve_sources(sources, 2.0, solver=solver)
    with pytest.raises(ParameterError, match=message):
        prepare_slice(sources, 2.0, solver).log(0, 1)
    with pytest.raises(
        ParameterError, match=r"hook: .* logarithms would be wrong deep inside; solve with Direct"
    ):
        SourceHyperfield(sources, [2.0], solver).log()


def test_a_hyperfield_of_sources_takes_the_solver_and_its_device(sources):
    """Plain values of several ρ come from the device that the solver names."""
    device = _Small(100)
    found = SourceHyperfield(sources, [2.0, np.inf], MultigridGradients(device=device)).values()
    plain = SourceHyperfield(sources, [2.0, np.inf], ConjugateGradient()).values()
    assert np.abs(found - plain).max() < 1e-7
    assert device.asked
    assert device.closed == len(device.asked)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"rtol": 0.0}, "rtol=0: expected a tolerance between 0 and 1"),
        ({"max_iterations": 0}, "max_iterations=0: expected at least one"),
        ({"threads": 0}, "threads=0: expected at least one thread"),
    ],
)
def test_a_useless_setting_is_refused(options, message):
    """Settings that cannot work are named when the solver is made."""
    with pytest.raises(ParameterError, match=message):
        MultigridGradients(**options)


def test_a_useless_rho_is_refused():
    """A ρ that single precision cannot square is named before any work."""
    system = assemble(hook())
    with pytest.raises(ParameterError, match=r"hook: rho=1e-09 is below 1e-06 of the spacing 0\.8"):
        MultigridGradients().solve(system, np.array([1e-9]))
    with pytest.raises(ParameterError, match=r"hook: rho=1e-09 is below"):
        MultigridGradients().prepare(system, 1e18)


@pytest.mark.data
def test_a_real_horse_agrees_with_the_direct_solver(data_dir):
    """Patches of a horse at ρ = inf are right to 1e-7 of their maximum."""
    shape = spem.read(data_dir / "horse_poses" / "1.obj", voxels=4000)
    sources = patch_sources(assemble(shape), 20, np.random.default_rng(0))
    found, direct = (source_values(sources, np.inf, solver=s) for s in (MultigridGradients(), Direct()))
    assert np.abs(found - direct).max() < 1e-7
