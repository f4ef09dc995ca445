"""The V-cycle on a device, against dense algebra."""

from __future__ import annotations

import numpy as np
import pytest
from simulator import SimulatedRuntime

from spem.fields.operator import assemble
from spem.fields.solvers.cuda.cycle import TAIL_TILES, Cycle
from spem.fields.solvers.cuda.levels import Hierarchy
from spem.fields.solvers.engine import LANES
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
    """A cycle over the simulator, on vectors of the host."""

    def __init__(self, *shapes: Shape, order: str = "forward", tail_tiles: int = TAIL_TILES) -> None:
        self.runtime = SimulatedRuntime(order)
        self.hierarchy = Hierarchy.of([assemble(shape) for shape in shapes], self.runtime)
        self.cycle = Cycle(self.hierarchy, self.runtime, tail_tiles)
        self.n_rows = self.hierarchy.levels[0].layout.n_rows
        self.rows = self.runtime.download(self.hierarchy.rows)
        self.active = np.ones(len(shapes), bool)

    def prepare(self, shifts: np.ndarray = SHIFTS) -> None:
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


def dense_cycle(matrices, maps, reds) -> np.ndarray:
    """The V-cycle of textbooks as a matrix: Gauss-Seidel by colours, the coarse equation, and back."""
    matrix, red = matrices[0], reds[0]
    if len(matrices) == 1:
        return np.linalg.inv(matrix)
    coarse = dense_cycle(matrices[1:], maps[1:], reds[1:])
    eye = np.eye(len(matrix))

    def relax(z, colour):
        z = z.copy()
        z[colour] += ((eye - matrix @ z) / np.diag(matrix)[:, None])[colour]
        return z

    z = relax(relax(np.zeros_like(matrix), red), ~red)
    z = z + maps[0] @ coarse @ maps[0].T @ (eye - matrix @ z)
    return relax(relax(z, ~red), red)


@pytest.mark.parametrize("tail_tiles", [0, 2, TAIL_TILES])
@pytest.mark.parametrize("name", SHAPES)
def test_is_the_symmetric_cycle_of_dense_algebra(name, tail_tiles):
    """One application equals red-black Gauss-Seidel, a coarse solve, and back, in dense double precision."""
    rig = Rig(SHAPES[name], tail_tiles=tail_tiles)
    rig.prepare()
    n = rig.rows.size
    rhs = np.random.default_rng(0).standard_normal((n, LANES)).astype(np.float32)
    found, partial = rig.apply(rhs)
    for lane in (0, 3, 7):
        exact = dense_cycle(*dense_levels(rig, SHIFTS[lane]))[np.ix_(rig.rows, rig.rows)]
        assert np.allclose(found[:, lane], exact @ rhs[:, lane], atol=3e-6 * np.abs(exact).max() * np.sqrt(n))
    assert np.allclose(partial.sum(axis=0), np.sum(rhs.astype(float) * found, axis=0), rtol=1e-12)
