"""Conjugate gradients on a device, against dense algebra and the host's."""

from __future__ import annotations

import numpy as np
import pytest
from backends import DEVICES, needs_simulator, use_runtime
from simulator.runtime import Order

from spem.fields.operator import assemble
from spem.fields.solvers.cuda import krylov
from spem.fields.solvers.cuda.cycle import TAIL_TILES, Cycle
from spem.fields.solvers.cuda.krylov import Krylov, Vectors, bytes_per_iteration
from spem.fields.solvers.cuda.levels import Hierarchy
from spem.fields.solvers.engine import LANES
from spem.fields.solvers.host import HostEngine
from spem.shapes.shape import Shape

SHIFTS = np.geomspace(1e-3, 10.0, LANES)


def porous(*sides: int) -> Shape:
    """A grid with a third of its voxels missing at random."""
    return Shape.from_mask(np.random.default_rng(3).random(sides) < 0.67)


def ball(radius: int) -> Shape:
    """A ball of voxels."""
    grid = np.indices((2 * radius + 3,) * 3) - (radius + 1)
    return Shape.from_mask(np.sum(grid**2, axis=0) <= radius**2)


def hand(scale: int) -> Shape:
    """A palm with thin fingers."""
    mask = np.zeros((44, 30), bool)
    mask[20:, 4:] = True
    for k in range(4):
        mask[2:20, 4 + 7 * k : 8 + 7 * k] = True
    return Shape.from_mask(mask.repeat(scale, axis=0).repeat(scale, axis=1))


def ratio(numerator: np.ndarray, denominator: np.ndarray) -> np.ndarray:
    """Quotient, zero for a lane that has nothing left to solve."""
    quotient = np.divide(numerator, denominator, out=np.zeros_like(numerator), where=denominator > 0)
    return quotient.astype(np.float32)


class Solver:
    """Conjugate gradients on a device, on vectors of the host."""

    def __init__(
        self, device: str, *shapes: Shape, order: Order = "forward", tail_tiles: int = TAIL_TILES
    ) -> None:
        self.systems = [assemble(shape) for shape in shapes]
        self.runtime = runtime = use_runtime(device, order)
        self.hierarchy = Hierarchy.of(self.systems, runtime)
        self.rows = runtime.download(self.hierarchy.rows)
        shape = self.hierarchy.levels[0].layout.n_rows + 1, LANES
        self.vectors = Vectors(*(runtime.zeros(shape, np.float32) for _ in range(5)))
        cycle = Cycle(self.hierarchy, runtime, tail_tiles)
        self.krylov = Krylov(cycle, self.hierarchy, runtime, self.vectors)
        self.active = np.ones(len(shapes), bool)

    def start(self, rhs: np.ndarray, shifts: np.ndarray = SHIFTS) -> np.ndarray:
        """Take ``(n_nodes, LANES)`` right-hand sides; return r·z."""
        self.write(self.vectors.r, rhs)
        self.krylov.prepare(np.broadcast_to(shifts, (self.active.size, LANES)), self.active)
        return self.krylov.precondition()

    def write(self, vector, values: np.ndarray) -> None:
        """Put values in node order into a vector."""
        table = np.zeros(vector.shape, np.float32)
        table[self.rows] = values
        vector[:] = self.runtime.upload(table)

    def read(self, vector) -> np.ndarray:
        """Values of a vector in node order."""
        found = self.runtime.download(vector)
        assert not np.delete(found, self.rows, axis=0).any()  # padding and the dummy row
        return found[self.rows]


def iterate(engine, rz: np.ndarray, tolerance: float = 1e-6, limit: int = 100) -> int:
    """Iterate until r·z of all lanes has fallen by the square of a tolerance; return how often."""
    goal, beta = rz * tolerance**2, None
    count = 0
    while count < limit:
        new = engine.improve(ratio(rz, engine.search(beta)))
        count += 1
        if np.all(new <= goal):
            break
        beta, rz = ratio(new, rz), new
    return count


@pytest.mark.parametrize("device", DEVICES)
def test_solves_the_equations(device):
    """The solutions of a batch satisfy their linear systems, computed independently in dense algebra."""
    solver = Solver(device, porous(9, 10, 11), porous(4, 4, 4), porous(1, 1, 60))
    rhs = np.random.default_rng(1).standard_normal((solver.rows.size, LANES))
    iterate(solver.krylov, solver.start(rhs))
    solver.krylov.finish()
    found, first = solver.read(solver.vectors.x), solver.hierarchy.first_node
    for system, a, b in zip(solver.systems, first[:-1], first[1:], strict=True):
        for lane in range(LANES):
            exact = np.linalg.solve(system.matrix(SHIFTS[lane]).toarray(), rhs[a:b, lane])
            assert np.allclose(found[a:b, lane], exact, atol=3e-6 * np.abs(exact).max())


SHAPES = {
    "ball": ball(9),
    "hand": hand(3),
    "plate": Shape.from_mask(np.ones((40, 40, 3))),
    "sheet": Shape.from_mask(np.ones((40, 40, 3)), (1.0, 1.0, 0.3)),
}


@pytest.mark.parametrize("device", DEVICES)
@pytest.mark.parametrize("name", SHAPES)
def test_converges_about_as_fast_as_on_the_host(device, name):
    """Iterations are at most 1.3 times those with the host's cycle, or one more where these are few."""
    shape, shifts = SHAPES[name], np.geomspace(1e-4, 10.0, LANES)
    solver = Solver(device, shape)
    system = solver.systems[0]
    engine = HostEngine([system], np.float32, 1)
    rz, _ = engine.measure(np.zeros((1, 0, LANES)), shifts[None], np.ones(1, bool))
    wanted = iterate(engine, rz)
    found = iterate(solver.krylov, solver.start(system.mass[:, None] * shifts, shifts))
    assert found <= max(1.3 * wanted, wanted + 1)


@pytest.mark.parametrize("device", DEVICES)
def test_products_and_peaks_are_those_of_the_vectors(device, monkeypatch):
    """r·z, p·q, q and the largest |z| are right, however many runs of tiles they are added up in."""
    monkeypatch.setattr(krylov, "_RUN_TILES", 2)
    solver = Solver(device, porous(10, 11, 12), porous(3, 3, 3))
    rhs = np.random.default_rng(2).standard_normal((solver.rows.size, LANES)).astype(np.float32)
    rz, (x, _, z, p, q) = solver.start(rhs), solver.vectors
    peak, pq = solver.krylov.peak(), solver.krylov.search(None)
    answer, product = solver.read(z).astype(float), solver.read(q).astype(float)
    assert np.array_equal(solver.read(p), answer)
    assert not solver.read(x).any()
    first = solver.hierarchy.first_node
    for b, system in enumerate(solver.systems):
        own = slice(first[b], first[b + 1])
        assert np.array_equal(peak[b], np.abs(answer[own]).max(axis=0))
        assert np.allclose(rz[b], np.sum(rhs[own] * answer[own], axis=0), rtol=1e-12)
        assert np.allclose(pq[b], np.sum(answer[own] * product[own], axis=0), rtol=1e-12)
        for lane in range(LANES):
            exact = system.matrix(SHIFTS[lane]) @ answer[own, lane]
            assert np.allclose(product[own, lane], exact, atol=1e-6 * np.abs(exact).max())


@pytest.mark.parametrize("device", DEVICES)
def test_iterations_do_not_depend_on_the_batch_or_on_the_order_of_threads(device):
    """Each system of a batch gets the bits that it gets alone, in whatever order threads and blocks run."""
    shapes = porous(9, 8, 11), porous(2, 4, 3), porous(7, 7, 7)
    batch = Solver(device, *shapes, order="shuffled", tail_tiles=2)
    rhs = np.random.default_rng(4).standard_normal((batch.rows.size, LANES))
    iterate(batch.krylov, batch.start(rhs), 0.0, 4)
    batch.krylov.finish()
    found, first = batch.read(batch.vectors.x), batch.hierarchy.first_node
    for b, (shape, order) in enumerate(zip(shapes, ("forward", "backward", "shuffled"), strict=True)):
        alone, own = Solver(device, shape, order=order, tail_tiles=2), slice(first[b], first[b + 1])
        iterate(alone.krylov, alone.start(rhs[own]), 0.0, 4)
        alone.krylov.finish()
        assert np.array_equal(found[own], alone.read(alone.vectors.x))


@pytest.mark.parametrize("device", DEVICES)
def test_selecting_takes_the_last_step_and_leaves_others_alone(device):
    """A system that is left out keeps its last x; one that goes on gets the bits it would have got."""
    shapes = porous(6, 7, 8), porous(7, 7, 7)
    solver, other = Solver(device, *shapes), Solver(device, *shapes)
    rhs = np.random.default_rng(6).standard_normal((solver.rows.size, LANES))
    cut = solver.hierarchy.first_node[1]
    rz = solver.start(rhs)
    new = solver.krylov.improve(ratio(rz, solver.krylov.search(None)))
    solver.krylov.select(np.array([False, True]))
    kept = solver.read(solver.vectors.x)
    beta = ratio(new, rz)
    pq = solver.krylov.search(beta)
    assert not pq[0].any()
    solver.krylov.improve(ratio(new, pq))
    solver.krylov.select(np.ones(2, bool))
    found = solver.read(solver.vectors.x)
    assert kept.any()
    assert np.array_equal(found[:cut], kept[:cut])
    iterate(other.krylov, other.start(rhs), 0.0, 2)
    other.krylov.finish()
    assert np.array_equal(found[cut:], other.read(other.vectors.x)[cut:])
    solver.krylov.select(np.zeros(2, bool))
    assert not solver.krylov.search(None).any()


@pytest.mark.parametrize("device", DEVICES)
def test_selecting_the_same_systems_moves_nothing(device, monkeypatch):
    """What is selected already is not uploaded again, and other shifts for it still count."""
    rhs = np.random.default_rng(1).standard_normal((ball(3).n_nodes, LANES))
    solver = Solver(device, ball(3))
    first = solver.start(rhs)
    uploads = []
    with monkeypatch.context() as patch:
        patch.setattr(solver.runtime, "upload", uploads.append)
        solver.krylov.select(solver.active.copy())
    assert uploads == []
    assert np.array_equal(solver.krylov.precondition(), first)
    assert np.array_equal(solver.start(rhs, 2 * SHIFTS), Solver(device, ball(3)).start(rhs, 2 * SHIFTS))


@pytest.mark.parametrize("device", DEVICES)
def test_lanes_with_nothing_to_solve_stay_zero(device):
    """Lanes with r = 0 have x = 0 after any number of iterations, and no product is wrong for them."""
    solver = Solver(device, porous(7, 7, 7))
    rhs = np.ones((solver.rows.size, LANES))
    rhs[:, ::3] = 0
    iterate(solver.krylov, solver.start(rhs))
    solver.krylov.finish()
    found = solver.read(solver.vectors.x)
    assert not found[:, ::3].any()
    assert found[:, 1].all()


@needs_simulator
def test_bytes_of_an_iteration():
    """They add up over systems, and are a few hundred a node."""
    shapes = porous(9, 9, 9), porous(20, 3, 5)
    parts = [bytes_per_iteration(Solver("simulated", shape).hierarchy) for shape in shapes]
    assert bytes_per_iteration(Solver("simulated", *shapes).hierarchy) == sum(parts)
    assert 500 < parts[0] / shapes[0].n_nodes < 900
