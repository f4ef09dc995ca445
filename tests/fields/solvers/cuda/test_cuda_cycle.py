"""The V-cycle on a device, against dense algebra."""

from __future__ import annotations

import numpy as np
import pytest
from backends import DEVICES, needs_simulator, use_runtime
from hypothesis import given, settings
from hypothesis import strategies as st
from simulator.runtime import Order

from spem.fields.operator import assemble
from spem.fields.solvers.cuda.cycle import TAIL_TILES, Cycle, cycle_bytes
from spem.fields.solvers.cuda.levels import Hierarchy
from spem.fields.solvers.cuda.programs import read_source
from spem.fields.solvers.engine import LANES
from spem.fields.solvers.multigrid import COARSEST
from spem.shapes.shape import Shape

SHIFTS = np.geomspace(1e-3, 10.0, LANES)


def box(*sides: int, spacing: float | tuple[float, ...] = 1.0) -> Shape:
    """A full grid."""
    return Shape.from_mask(np.ones(sides), spacing)


def lattice(*sides: int) -> Shape:
    """Single voxels two apart, which touch no other."""
    mask = np.zeros(sides, bool)
    mask[(slice(None, None, 2),) * len(sides)] = True
    return Shape.from_mask(mask)


def porous(*sides: int) -> Shape:
    """A grid with a third of its voxels missing at random."""
    return Shape.from_mask(np.random.default_rng(3).random(sides) < 0.67)


SHAPES = {
    "point": box(1),
    "segment": box(150),
    "strip": box(2, 30, spacing=(1.0, 0.4)),
    "disk": porous(20, 24),
    "ball": porous(9, 10, 11),
    "lattice": lattice(11, 11, 11),
    "tesseract": porous(4, 5, 5, 4),
}


class Rig:
    """A cycle on a device, on vectors of the host."""

    def __init__(
        self, device: str, *shapes: Shape, order: Order = "forward", tail_tiles: int = TAIL_TILES
    ) -> None:
        self.runtime = use_runtime(device, order)
        self.hierarchy = Hierarchy.of([assemble(shape) for shape in shapes], self.runtime)
        self.cycle = Cycle(self.hierarchy, self.runtime, tail_tiles)
        self.n_rows = self.hierarchy.levels[0].layout.n_rows
        self.rows = self.runtime.download(self.hierarchy.rows)
        self.active = np.ones(len(shapes), bool)

    def prepare(self, shifts: np.ndarray = SHIFTS) -> None:
        """Take the same shifts for all systems."""
        self.cycle.prepare(np.broadcast_to(shifts, (self.active.size, LANES)), self.active)

    def apply(self, values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Answers to ``(n_nodes, LANES)`` right-hand sides in node order, and r·z of each tile."""
        r = np.zeros((self.n_rows + 1, LANES), np.float32)
        r[self.rows] = values
        z = self.runtime.zeros(r.shape, np.float32)
        self.cycle.apply(self.runtime.upload(r), z)
        found = self.runtime.download(z)
        assert not np.delete(found, self.rows, axis=0).any()  # padding and the dummy row
        return found[self.rows], self.runtime.download(self.cycle.partial)

    def nodes(self, system: int) -> slice:
        """Nodes of a system among all."""
        return slice(*self.hierarchy.first_node[system : system + 2])


def dense_levels(rig: Rig, shift: float):
    """A + s M and the colours of each level, and the maps between, as dense matrices over rows."""
    matrices, maps, reds = [], [], []
    for level in rig.hierarchy.levels:
        layout, n = level.layout, level.layout.n_rows
        table, weight, diagonal, mass = (
            rig.runtime.download(each)
            for each in (level.neighbours, level.weight, level.diagonal, level.mass)
        )
        if level.fine:
            weight = np.repeat(weight, n, axis=0)
        matrix = np.zeros((n, n + 1))
        np.subtract.at(matrix, (np.arange(n)[:, None], table), weight)
        matrices.append(matrix[:, :n] + np.diag(diagonal + np.float32(shift) * mass.astype(float)))
        reds.append(np.arange(n) < layout.middle_tile[0] * 128)
        if level.parent is not None:
            up = np.zeros((n, rig.hierarchy.levels[len(maps) + 1].layout.n_rows + 1))
            up[np.arange(n), rig.runtime.download(level.parent)] = 1
            maps.append(up[:, :-1])
    return matrices, maps, reds


def dense_cycle(matrices, maps, reds, r: np.ndarray) -> np.ndarray:
    """The V-cycle of textbooks: Gauss-Seidel by colours, the coarse equation, and back."""
    matrix, red = matrices[0], reds[0]
    if len(matrices) == 1:
        return np.linalg.solve(matrix, r)

    def relax(z, colour):
        return np.where(colour, z + (r - matrix @ z) / np.diag(matrix), z)

    z = relax(relax(np.zeros_like(r), red), ~red)
    z = z + maps[0] @ dense_cycle(matrices[1:], maps[1:], reds[1:], maps[0].T @ (r - matrix @ z))
    return relax(relax(z, ~red), red)


@pytest.mark.parametrize("device", DEVICES)
@pytest.mark.parametrize("tail_tiles", [0, 2, TAIL_TILES])
@pytest.mark.parametrize("name", SHAPES)
def test_is_the_symmetric_cycle_of_dense_algebra(device, name, tail_tiles):
    """One application equals red-black Gauss-Seidel, a coarse solve, and back, in dense double precision."""
    rig = Rig(device, SHAPES[name], tail_tiles=tail_tiles)
    rig.prepare()
    rhs = np.random.default_rng(0).standard_normal((rig.rows.size, LANES)).astype(np.float32)
    found, partial = rig.apply(rhs)
    r = np.zeros((rig.n_rows, LANES))
    r[rig.rows] = rhs
    for lane in (0, 3, 7):
        exact = dense_cycle(*dense_levels(rig, SHIFTS[lane]), r[:, lane])[rig.rows]
        assert np.allclose(found[:, lane], exact, atol=2e-6 * np.abs(exact).max())
    assert np.allclose(partial.sum(axis=0), np.sum(rhs.astype(float) * found, axis=0), rtol=1e-12)


@pytest.mark.parametrize("device", DEVICES)
def test_is_symmetric_and_positive(device):
    """As a matrix the cycle is symmetric, and with A + s M it has eigenvalues in (0, 2)."""
    shape = porous(6, 5, 7)
    rig, n = Rig(device, shape, tail_tiles=0), shape.n_nodes
    rig.prepare(np.full(LANES, 0.01))
    columns = np.zeros((n, n + LANES))
    for k in range(0, n, LANES):
        columns[:, k : k + LANES] = rig.apply(np.eye(n, n + LANES)[:, k : k + LANES])[0]
    inverse = columns[:, :n]
    assert np.abs(inverse - inverse.T).max() < 3e-7 * inverse.max()
    upper = np.linalg.cholesky(assemble(shape).matrix(0.01).toarray())
    eigenvalues = np.linalg.eigvalsh(upper.T @ (inverse + inverse.T) @ upper / 2)
    assert eigenvalues[0] > 0.2
    assert eigenvalues[-1] < 1.5


@pytest.mark.parametrize("device", DEVICES)
@settings(max_examples=6, deadline=None, derandomize=True)
@given(sides=st.lists(st.tuples(*[st.integers(1, 12)] * 3), min_size=2, max_size=4), seed=st.integers(0, 99))
def test_answers_do_not_depend_on_the_batch_or_on_the_order_of_threads(device, sides, seed):
    """Each system of a batch gets the bits that it gets alone, in whatever order threads and blocks run."""
    rng = np.random.default_rng(seed)
    shapes = []
    for each in sides:
        mask = rng.random(each) < 0.8
        mask.flat[0] = True
        shapes.append(Shape.from_mask(mask))
    batch = Rig(device, *shapes, tail_tiles=2, order="shuffled")
    batch.prepare()
    rhs = rng.standard_normal((batch.rows.size, LANES))
    found, partial = batch.apply(rhs)
    first_tile = batch.hierarchy.levels[0].layout.first_tile
    for b, shape in enumerate(shapes):
        alone = Rig(device, shape, tail_tiles=2, order=("forward", "backward")[b % 2])
        alone.prepare()
        answer, sums = alone.apply(rhs[batch.nodes(b)])
        assert np.array_equal(found[batch.nodes(b)], answer)
        assert np.array_equal(partial[first_tile[b] : first_tile[b + 1]], sums)


@pytest.mark.parametrize("device", DEVICES)
@pytest.mark.parametrize("tail_tiles", [0, TAIL_TILES])
def test_systems_that_are_not_active_keep_their_vectors(device, tail_tiles):
    """Only the rows and tiles of active systems are written, and they get what all active would give them."""
    rig = Rig(device, porous(9, 9, 9), porous(8, 9, 10), box(3, 3, 3), tail_tiles=tail_tiles)
    rig.prepare()
    rhs = np.random.default_rng(5).standard_normal((rig.rows.size, LANES))
    whole, _ = rig.apply(rhs)
    rig.active = np.array([False, True, False])
    rig.prepare()
    found, _ = rig.apply(rhs)
    assert np.array_equal(found[rig.nodes(1)], whole[rig.nodes(1)])
    assert not found[rig.nodes(0)].any()
    assert not found[rig.nodes(2)].any()
    rig.cycle.select(np.zeros(3, bool))
    assert not rig.apply(rhs)[0].any()


@pytest.mark.parametrize("device", DEVICES)
def test_lanes_with_nothing_to_solve_stay_zero(device):
    """A residual of zeros has an answer of zeros, whatever other lanes and the call before had."""
    rig = Rig(device, porous(9, 9, 9), tail_tiles=2)
    rig.prepare()
    rhs = np.ones((rig.rows.size, LANES))
    rig.apply(rhs)
    rhs[:, 2:5] = 0
    found, partial = rig.apply(rhs)
    assert not found[:, 2:5].any()
    assert not partial[:, 2:5].any()
    assert found[:, [0, 1, 5, 6, 7]].all()


@pytest.mark.parametrize("device", DEVICES)
def test_coarsest_systems_are_solved_exactly(device):
    """A system of few nodes is inverted: the answer is its solution, for shifts of any size."""
    shape = porous(5, 4, 3)
    rig = Rig(device, shape, box(1, 1, 1))
    shifts = np.geomspace(1e-12, 1e12, LANES)
    rig.prepare(shifts)
    found, _ = rig.apply(np.ones((rig.rows.size, LANES)))
    for lane, shift in enumerate(shifts):
        exact = np.linalg.solve(assemble(shape).matrix(shift).toarray(), np.ones(shape.n_nodes))
        assert np.allclose(found[rig.nodes(0), lane], exact, rtol=1e-5)


@needs_simulator
def test_bytes_of_a_cycle():
    """They add up over systems; a system that is inverted reads its inverse and r, and writes z."""
    small, large = box(2, 2, 2), porous(9, 9, 9)
    assert cycle_bytes(Rig("simulated", small).hierarchy) == 32 * (8 * 8 + 8 + 8)
    parts = [cycle_bytes(Rig("simulated", shape).hierarchy) for shape in (small, large)]
    assert cycle_bytes(Rig("simulated", small, large).hierarchy) == sum(parts)
    assert 200 < parts[1] / large.n_nodes < 400


def test_kernels_know_the_size_of_the_coarsest_level():
    """The constant in the source is that of the hierarchy."""
    assert f"#define COARSEST {COARSEST} " in read_source("cycle.cu")
