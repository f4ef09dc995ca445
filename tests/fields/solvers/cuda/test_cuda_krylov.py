"""Conjugate gradients on a device, against dense algebra and the host's."""

from __future__ import annotations

import numpy as np
from simulator import SimulatedRuntime

from spem.fields.operator import assemble
from spem.fields.solvers.cuda.cycle import TAIL_TILES, Cycle
from spem.fields.solvers.cuda.krylov import Krylov, Vectors, bytes_per_iteration
from spem.fields.solvers.cuda.levels import Hierarchy
from spem.fields.solvers.engine import LANES
from spem.shapes.shape import Shape

SHIFTS = np.geomspace(1e-3, 10.0, LANES)


def porous(*sides: int) -> Shape:
    """A grid with a third of its voxels missing at random."""
    return Shape.from_mask(np.random.default_rng(3).random(sides) < 0.67)


class Solver:
    """Conjugate gradients over the simulator, on vectors of the host."""

    def __init__(self, *shapes: Shape, order: str = "forward", tail_tiles: int = TAIL_TILES) -> None:
        self.systems = [assemble(shape) for shape in shapes]
        self.runtime = runtime = SimulatedRuntime(order)
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
        table = np.zeros(vector.shape, np.float32)
        table[self.rows] = values
        vector[:] = self.runtime.upload(table)

    def read(self, vector) -> np.ndarray:
        found = self.runtime.download(vector)
        assert not np.delete(found, self.rows, axis=0).any()  # padding and the dummy row
        return found[self.rows]

    def run(self, rz: np.ndarray, tolerance: float = 1e-6, limit: int = 100) -> int:
        """Iterate until r·z of all lanes has fallen by the square of a tolerance."""
        goal, beta = rz * tolerance**2, None
        for count in range(1, limit + 1):
            pq = self.krylov.search(beta)
            new = self.krylov.improve(np.divide(rz, pq, out=np.zeros_like(rz), where=pq > 0))
            if np.all(new <= goal):
                break
            beta = np.divide(new, rz, out=np.zeros_like(rz), where=rz > 0)
            rz = new
        self.krylov.finish()
        return count


def test_solves_the_equations():
    """The solutions of a batch satisfy their linear systems, computed independently in dense algebra."""
    solver = Solver(porous(9, 10, 11), porous(4, 4, 4), porous(1, 1, 60))
    rhs = np.random.default_rng(1).standard_normal((solver.rows.size, LANES))
    solver.run(solver.start(rhs))
    found, first = solver.read(solver.vectors.x), solver.hierarchy.first_node
    for system, a, b in zip(solver.systems, first[:-1], first[1:], strict=True):
        for lane in range(LANES):
            exact = np.linalg.solve(system.matrix(SHIFTS[lane]).toarray(), rhs[a:b, lane])
            assert np.allclose(found[a:b, lane], exact, atol=3e-6 * np.abs(exact).max())
