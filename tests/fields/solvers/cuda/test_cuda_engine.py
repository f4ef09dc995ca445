"""The sweep's engine on a device, against that of the host."""

from __future__ import annotations

import gc
from typing import Any

import numpy as np
import pytest
from backends import DEVICES, needs_simulator, use_device, use_runtime, with_memory
from simulator import SimulatedRuntime
from simulator.runtime import DeviceMemoryError

from spem.errors import ParameterError, SizeError
from spem.fields.operator import System, assemble
from spem.fields.solvers.cuda.cycle import cycle_bytes
from spem.fields.solvers.cuda.engine import CudaEngine
from spem.fields.solvers.cuda.workspace import engine_bytes, require_batch
from spem.fields.solvers.engine import LANES, Small, SourceEngine
from spem.fields.solvers.host import HostEngine
from spem.fields.solvers.sweep import Sweep
from spem.shapes import synthetic
from spem.shapes.shape import Shape

RHO = np.geomspace(0.5, 20.0, 16)
SHIFTS = np.geomspace(1e-2, 4.0, LANES)


def porous(*sides: int, spacing: tuple[float, ...] | float = 1.0) -> System:
    """A grid with a third of its voxels missing at random."""
    inside = np.random.default_rng(sum(sides)).random(sides) < 0.67
    return assemble(Shape.from_mask(inside, spacing), "voxel")


BATCHES = {
    "1-D": (porous(300), assemble(synthetic.interval(40.0, 1.0))),
    "2-D": (assemble(synthetic.disk(9.3, 1.0)), porous(14, 9, spacing=(1.0, 1.7)), porous(1, 1)),
    "3-D": (assemble(synthetic.ball(4.2, 1.0)), porous(6, 9, 7, spacing=(0.5, 1.0, 0.8))),
    "4-D": (porous(4, 5, 4, 5),),
}


@pytest.fixture(params=BATCHES)
def systems(request: pytest.FixtureRequest) -> tuple[System, ...]:
    """Systems of one dimension, with and without cuts."""
    return BATCHES[request.param]


def solve(engine: SourceEngine, product: Small, active: np.ndarray) -> None:
    """Conjugate gradients until single precision ends."""
    start, beta = product, None
    engine.select(active)
    for _ in range(60):
        alpha = ratio(product, engine.search(beta))
        new = engine.improve(alpha)
        beta, product = ratio(new, product), new
        if np.all(new <= 1e-13 * start):
            return
    pytest.fail("no convergence")


def ratio(numerator: Small, denominator: Small) -> Small:
    """Quotient, zero where there is nothing to divide."""
    return np.divide(numerator, denominator, out=np.zeros_like(numerator), where=denominator > 0)


def two_blocks(engine: SourceEngine) -> list[Any]:
    """Do two rounds of solves at fixed shifts, as a sweep does them; return all answers."""
    count, answers = engine.counts.size, []
    active = np.ones(count, bool)
    identity = np.broadcast_to(np.eye(LANES), (count, LANES, LANES)).copy()
    for number in range(2):
        mix = np.zeros((count, number * LANES, LANES))
        mix[:, :LANES] = 0.5 * identity if number else 0
        product, _ = engine.measure(mix, np.broadcast_to(SHIFTS, (count, LANES)).copy(), active)
        solve(engine, product, active)
        answers.append(engine.overlaps())
        remove = np.zeros((count, number * LANES, LANES))
        remove[:, :LANES] = -0.25 * identity if number else 0
        answers.extend(engine.append(identity, remove))
    turn = [np.eye(2 * LANES)[:, : 3 + b] for b in range(count)]
    return [*answers, *engine.columns(turn)]


@pytest.mark.parametrize("device", DEVICES)
@pytest.mark.parametrize(
    ("name", "dtype"), [("1-D", np.float64), ("2-D", np.float32), ("3-D", np.float64), ("4-D", np.float32)]
)
def test_answers_are_those_of_the_host(device: str, name: str, dtype: Any) -> None:
    """Solutions, products and columns agree with the host's to the accuracy of the solves."""
    systems = BATCHES[name]
    engine = CudaEngine(systems, dtype, use_runtime(device))
    host = HostEngine(systems, dtype)
    assert engine.counts.tolist() == host.counts.tolist()
    assert engine.units.tolist() == host.units.tolist()
    for found, expected in zip(two_blocks(engine), two_blocks(host), strict=True):
        assert found.dtype == expected.dtype
        assert found == pytest.approx(expected, rel=1e-4, abs=3e-6 * float(np.abs(expected).max()))


@pytest.mark.parametrize("device", DEVICES)
def test_solutions_solve_the_systems(device: str, systems: tuple[System, ...]) -> None:
    """Columns of a first block are the deficits u, (A + s M) u = s M·1, and z has the size of the error."""
    engine = CudaEngine(systems, np.float64, use_runtime(device))
    active, count = np.ones(len(systems), bool), len(systems)
    product, peak = engine.measure(np.zeros((count, 0, LANES)), np.tile(SHIFTS, (count, 1)), active)
    solve(engine, product, active)
    engine.append(np.tile(np.eye(LANES), (count, 1, 1)), np.zeros((count, 0, LANES)))
    for b, (columns, system) in enumerate(zip(engine.columns([np.eye(LANES)] * count), systems, strict=True)):
        square = min(system.shape.spacing) ** 2
        for lane, shift in enumerate(SHIFTS):
            matrix = system.matrix(shift / square).toarray()
            deficit = np.linalg.solve(matrix, shift / square * system.mass)
            assert columns[:, lane] == pytest.approx(deficit, abs=2e-6)
            assert 0.3 < peak[b, lane] / deficit.max() < 3


@pytest.mark.parametrize("device", DEVICES)
def test_right_hand_sides_are_refined_to_double_precision(device: str, systems: tuple[System, ...]) -> None:
    """Rounds of refinement solve (A + s M) v = b to 1e-12, with the residuals that they tell of."""
    engine = CudaEngine(systems, np.float32, use_runtime(device))
    rng, active = np.random.default_rng(0), np.ones(len(systems), bool)
    rhs = [rng.normal(size=(system.n_nodes, LANES)) for system in systems]
    shifts = np.tile(SHIFTS, (len(systems), 1))
    square = engine.load(rhs)
    assert square == pytest.approx(np.array([np.sum(b**2, axis=0) for b in rhs]), rel=1e-13)
    for number in range(4):
        product, rest = engine.refine(shifts, active)
        if number == 3:
            break
        solve(engine, product, active)
    assert np.all(rest <= 1e-24 * square)
    for values, b, system in zip(engine.solution(), rhs, systems, strict=True):
        unit = min(system.shape.spacing) ** 2
        for lane, shift in enumerate(SHIFTS):
            left = b[:, lane] - system.matrix(shift / unit) @ values[:, lane] * unit
            assert np.linalg.norm(left) <= 2e-12 * np.linalg.norm(b[:, lane])


@pytest.mark.parametrize("device", DEVICES)
def test_a_batch_gives_what_its_systems_give_alone(device: str) -> None:
    """Sweeps of several systems and of each alone are the same, bit by bit, in any order of threads."""
    systems = *BATCHES["3-D"], assemble(synthetic.box((3.0, 9.0, 5.0), 1.0))
    together = Sweep(device=use_device(device)).hyperfields(systems, [RHO] * 3)
    for order in ("backward", "shuffled"):
        alone = [Sweep(device=use_device(device, order)).hyperfield(system, RHO) for system in systems]
        for one, other in zip(together, alone, strict=True):
            assert one.error == other.error
            for name in ("basis", "gram", "mass", "stiffness", "source"):
                assert np.array_equal(getattr(one, name), getattr(other, name))


@pytest.mark.parametrize("device", DEVICES)
def test_inactive_systems_answer_zero_and_keep_their_vectors(device: str) -> None:
    """Systems that are left out of a search answer zero, and go on later from where they were."""
    systems = BATCHES["2-D"]
    shifts, everyone = np.tile(SHIFTS, (3, 1)), np.ones(3, bool)
    some = np.array([True, False, True])
    answers = []
    for narrow in (False, True):
        engine = CudaEngine(systems, np.float64, use_runtime(device))
        product, _ = engine.measure(np.zeros((3, 0, LANES)), shifts, everyone)
        alpha = ratio(product, engine.search(None))
        engine.improve(alpha)
        if narrow:
            engine.select(some)
            left_out = engine.search(np.ones((3, LANES)))
            assert not left_out[1].any()
            assert left_out[0].all()
            engine.select(everyone)
        answers.append(engine.overlaps())
    assert np.array_equal(*answers)
    product, peak = engine.measure(np.zeros((3, 0, LANES)), shifts, some)
    assert not product[1].any()
    assert not peak[1].any()


@pytest.mark.parametrize("device", DEVICES)
def test_projections_are_fields_in_node_order(device: str) -> None:
    """Constant + B·mix on the device agrees with columns on the host."""
    systems = BATCHES["3-D"]
    engine = CudaEngine(systems, np.float32, use_runtime(device))
    two_blocks(engine)
    rng = np.random.default_rng(0)
    constant, mix = rng.normal(size=(2, 11)), rng.normal(size=(2, 2 * LANES, 11))
    table = engine.project(constant, mix)
    assert table.shape == (engine.hierarchy.levels[0].layout.n_rows, 11)
    columns = engine.columns([np.eye(2 * LANES)] * 2)
    for b, values in enumerate(engine.to_nodes(table)):
        expected = constant[b] + columns[b].astype(float) @ mix[b]
        assert values == pytest.approx(expected, rel=1e-6, abs=1e-6 * np.abs(expected).max())


@pytest.mark.parametrize("device", DEVICES)
def test_stages_are_timed_and_counted_apart(device: str) -> None:
    """A profile tells seconds and bytes of each stage; without one there are no seconds."""
    systems = BATCHES["2-D"]
    for profile in (False, True):
        engine = CudaEngine(systems, np.float32, use_runtime(device), profile=profile)
        product, _ = engine.measure(np.zeros((3, 0, LANES)), np.ones((3, LANES)), np.ones(3, bool))
        engine.search(None)
        engine.improve(product)
        engine.to_nodes(engine.project(np.ones((3, 2)), np.zeros((3, 0, 2))))
        stages = {"hierarchy", "blocks", "krylov", "cycle", "project", "transfers"}
        assert set(engine.bytes) == stages
        assert set(engine.seconds) == (stages if profile else set())
        assert all(seconds > 0 for seconds in engine.seconds.values())
        assert engine.bytes["cycle"] == 2 * cycle_bytes(engine.hierarchy)


class Watched(SimulatedRuntime):
    """A device that fails at one of its allocations, and knows the most bytes that were held."""

    def __init__(self, failing: int = -1) -> None:
        super().__init__()
        self.failing, self.count, self.most, self.whole = failing, 0, 0, self.free_bytes()

    def _allocate(self, shape: Any, dtype: Any) -> Any:
        self.count += 1
        if self.count == self.failing:
            msg = "planted"
            raise DeviceMemoryError(msg)
        array = super()._allocate(shape, dtype)
        self.most = max(self.most, self.whole - self.free_bytes())
        return array


class Lent:
    """A backend over one runtime."""

    def __init__(self, runtime: SimulatedRuntime) -> None:
        self.runtime = runtime

    def open(self, systems: Any, dtype: Any) -> SourceEngine:
        """Make an engine over it."""
        return CudaEngine(systems, dtype, self.runtime)


@needs_simulator
def test_memory_that_ends_leaves_nothing_behind() -> None:
    """Wherever a device fails to give memory, the error tells the sizes and all memory is given back."""
    systems = BATCHES["2-D"][:1]
    calm = Watched()
    Sweep(device=Lent(calm)).hyperfields(systems, [RHO])
    gc.collect()
    assert calm.free_bytes() == calm.whole
    for failing in np.linspace(1, calm.count, 7).astype(int).tolist():
        runtime = Watched(failing)
        with pytest.raises(SizeError, match=r"the simulator ran out of memory, .* 1 shape of 267 nodes"):
            Sweep(device=Lent(runtime)).hyperfields(systems, [RHO])
        gc.collect()
        assert runtime.free_bytes() == runtime.whole, failing


@pytest.mark.parametrize("device", DEVICES)
def test_too_large_a_batch_is_refused_before_anything_is_allocated(device: str) -> None:
    """A batch over the free memory is refused with its sizes; halves may do."""
    systems = BATCHES["2-D"]
    message = r"3 shapes of 349 nodes with 24 columns would take .* MiB on .*, which has .* free"
    with with_memory(device, engine_bytes(systems, np.float32, 3) - 1) as small:
        with pytest.raises(SizeError, match=message):
            small.open(systems, np.float32)
        fields = Sweep(device=small).hyperfields(systems, [RHO] * 3)
    expected = Sweep(device=use_device(device)).hyperfields(systems, [RHO] * 3)
    for one, other in zip(fields, expected, strict=True):
        assert np.array_equal(one.basis, other.basis)


def test_more_rows_than_can_be_numbered_are_refused() -> None:
    """A batch over 32-bit numbers is refused, whatever the memory."""
    systems = BATCHES["2-D"]
    assert require_batch([systems[0]] * 1000) is None
    with pytest.raises(SizeError, match=r"1200000 shapes of 320,400,000 nodes: .* at most 536,870,912 "):
        require_batch([systems[0]] * 1_200_000)


@needs_simulator
def test_the_estimate_of_memory_is_close() -> None:
    """A sweep holds no more than was estimated for its blocks, and most of that."""
    system = assemble(synthetic.ball(11.0, 1.0))
    runtime = Watched()
    with Sweep(device=Lent(runtime)).batch([system], [RHO]) as batch:
        blocks = batch.reduced[0].turn.shape[0] // LANES
        held = runtime.whole - runtime.free_bytes()
    estimate = engine_bytes([system], np.float32, blocks)
    assert 0.6 * estimate < held <= estimate
    assert runtime.most <= 1.3 * estimate


@needs_simulator
def test_a_closed_engine_says_so() -> None:
    """Whatever is asked of a closed engine, or of one without right-hand sides, is refused in one line."""
    engine = CudaEngine(BATCHES["2-D"], np.float32, SimulatedRuntime())
    with pytest.raises(ParameterError, match="no right-hand sides: load"):
        engine.solution()
    engine.close()
    engine.close()
    for ask in (lambda: engine.hierarchy, engine.overlaps, lambda: engine.select(np.ones(3, bool))):
        with pytest.raises(ParameterError, match="this engine is closed"):
            ask()


@needs_simulator
def test_batches_of_several_dimensions_are_refused() -> None:
    """Systems of different dimensions do not go together, and none is no batch."""
    for systems in ((), (BATCHES["1-D"][0], BATCHES["2-D"][0])):
        with pytest.raises(ParameterError, match="expected shapes, all of one dimension"):
            CudaEngine(systems, np.float32, SimulatedRuntime())
