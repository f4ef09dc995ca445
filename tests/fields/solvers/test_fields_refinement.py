"""Iterative refinement on an engine of dense algebra: the path that host and devices share, on NumPy."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from spem.fields.operator import assemble
from spem.fields.solvers.engine import LANES
from spem.fields.solvers.host import Host
from spem.fields.solvers.refinement import refine
from spem.shapes.shape import Shape


class _DenseEngine:
    """What refinement asks of an engine, in dense algebra, with symmetric Gauss-Seidel for the cycle."""

    def __init__(self, systems):
        self.units = np.array([min(system.shape.spacing) for system in systems])
        self.counts = np.array([system.n_nodes for system in systems])
        self.systems = systems

    def load(self, rhs):
        self.b, self.v = np.stack(rhs), np.zeros((len(rhs), *rhs[0].shape))
        self.x, self.p = np.zeros(self.v.shape, np.float32), np.zeros(self.v.shape, np.float32)
        self.r, self.z, self.q = self.x.copy(), self.x.copy(), self.x.copy()
        return np.sum(self.b**2, axis=1)

    def refine(self, shifts, active):
        self.active = active
        self.matrix = [
            [system.matrix(s / unit**2).toarray() * unit**2 for s in row]
            for system, unit, row in zip(self.systems, self.units, shifts, strict=True)
        ]
        for b, lane in self._each():
            self.v[b, :, lane] += self.x[b, :, lane]
            self.r[b, :, lane] = self.b[b, :, lane] - self.matrix[b][lane] @ self.v[b, :, lane]
        return self._cycle(), self._products(self.r, self.r)

    def select(self, active):
        self.active = active

    def search(self, beta):
        for b, lane in self._each():
            if beta is None:
                self.x[b, :, lane] = self.p[b, :, lane] = 0
            turned = 0 if beta is None else np.float32(beta[b, lane]) * self.p[b, :, lane]
            self.p[b, :, lane] = self.z[b, :, lane] + turned
            self.q[b, :, lane] = self.matrix[b][lane].astype(np.float32) @ self.p[b, :, lane]
        return self._products(self.p, self.q)

    def improve(self, alpha):
        for b, lane in self._each():
            step = np.float32(alpha[b, lane])
            self.x[b, :, lane] += step * self.p[b, :, lane]
            self.r[b, :, lane] -= step * self.q[b, :, lane]
        return self._cycle()

    def solution(self):
        return list(self.v)

    def close(self):
        pass

    def _each(self):
        return ((b, lane) for b in np.flatnonzero(self.active) for lane in range(LANES))

    def _cycle(self):
        for b, lane in self._each():
            lower = np.tril(self.matrix[b][lane])
            middle = np.diag(lower) * np.linalg.solve(lower, self.r[b, :, lane])
            self.z[b, :, lane] = np.linalg.solve(lower.T, middle)
        return self._products(self.r, self.z)

    def _products(self, one, other):
        found = np.einsum("bil,bil->bl", one, other, dtype=np.float64)
        return np.where(self.active[:, None], found, 0.0)


def bar() -> Shape:
    """A small solid with flat voxels."""
    return Shape.from_mask(np.ones((6, 4, 3)), (0.5, 1.0, 0.7), name="bar")


def exact(system, rhs, shifts):
    return np.stack(
        [np.linalg.solve(system.matrix(s).toarray(), b) for s, b in zip(shifts, rhs.T, strict=True)], axis=1
    )


OPEN = {"dense": _DenseEngine, "host": lambda systems: Host().open(systems, np.float32)}


@pytest.fixture(params=OPEN)
def open_engine(request):
    return OPEN[request.param]


@pytest.mark.parametrize("count", [1, 8, 13])
def test_solves_each_column_at_its_own_shift(open_engine, count):
    """Columns of any sign at shifts from zero up come to the solutions of dense algebra."""
    system, rng = assemble(bar()), np.random.default_rng(3)
    rhs, shifts = rng.normal(size=(system.n_nodes, count)), np.linspace(0.0, 5.0, count)
    found = refine(open_engine([system, system]), rhs, shifts, rtol=1e-11, limit=100)
    true = exact(system, rhs, shifts)
    assert found.residual.max() <= 1e-11
    assert np.abs(found.values - true).max() <= 1e-9 * np.abs(true).max()
    assert found.spent.min() > 0


def test_the_residual_is_that_of_the_equations(open_engine):
    """The residual is what the values leave of the equations, whether the tolerance is met or not."""
    system, rng = assemble(bar()), np.random.default_rng(4)
    rhs = rng.normal(size=(system.n_nodes, 8))
    for limit in (1, 3, 100):
        found = refine(open_engine([system]), rhs, np.full(8, 0.1), rtol=1e-6, limit=limit)
        true = np.linalg.norm(rhs - system.matrix(0.1) @ found.values, axis=0) / np.linalg.norm(rhs, axis=0)
        assert np.allclose(found.residual, true, rtol=1e-5)
        assert found.spent.max() <= limit


def test_zero_columns_stay_zero_and_cost_nothing(open_engine):
    """A column of zeros is answered with zeros, without an iteration; all zeros without a refinement."""
    system = assemble(bar())
    rhs = np.zeros((system.n_nodes, 3))
    rhs[5, 1] = 1.0
    found = refine(open_engine([system]), rhs, np.zeros(3), rtol=1e-8, limit=50)
    assert not found.values[:, [0, 2]].any()
    assert found.spent[[0, 2]].max() == 0
    assert found.spent[1] > 0
    nothing = refine(open_engine([system]), 0 * rhs, np.zeros(3), rtol=1e-8, limit=50)
    assert not nothing.values.any()
    assert nothing.residual.max() == 0


@settings(max_examples=10, deadline=None)
@given(st.permutations(range(11)), st.integers(0, 11))
def test_an_answer_does_not_depend_on_its_place(order, dropped):
    """Columns in any order and company, easy and hard, come to the same bits."""
    system, rng = assemble(bar()), np.random.default_rng(5)
    rhs = rng.normal(size=(system.n_nodes, 11)) * np.geomspace(1e-30, 1e30, 11)
    rhs[:, 2] = 0
    shifts = np.geomspace(1e-3, 1e3, 11)
    whole = refine(OPEN["host"]([system] * 2), rhs, shifts, rtol=1e-9, limit=60)
    some = list(order[dropped:]) or [0]
    part = refine(OPEN["host"]([system] * 3), rhs[:, some], shifts[some], rtol=1e-9, limit=60)
    assert np.array_equal(part.values, whole.values[:, some])
    assert np.array_equal(part.residual, whole.residual[some])
    assert np.array_equal(part.spent, whole.spent[some])


def test_a_tolerance_below_rounding_stalls(open_engine):
    """A residual that rounding keeps up ends the iteration long before the limit."""
    system = assemble(bar())
    rhs = np.random.default_rng(6).normal(size=(system.n_nodes, 2))
    found = refine(open_engine([system]), rhs, np.zeros(2), rtol=1e-30, limit=10_000)
    assert 1e-30 < found.residual.max() < 1e-14
    assert found.spent.max() < 300


def test_a_long_line_is_not_taken_for_stalled():
    """A refinement that takes the slow part of a residual, and leaves the fast, is followed by another."""
    system = assemble(Shape.from_mask(np.ones(962)), "voxel")
    shifts = np.array([1e-6])
    found = refine(OPEN["host"]([system]), system.mass[:, None] * shifts, shifts, rtol=1e-8, limit=1000)
    assert found.residual.max() <= 1e-8


def test_scales_of_any_size_are_equal():
    """Units of length and strengths of sources far outside of single precision change nothing."""
    mask = np.ones((5, 7))
    system, tiny = assemble(Shape.from_mask(mask)), assemble(Shape.from_mask(mask, (2.0**-200, 2.0**-200)))
    rhs = np.random.default_rng(7).normal(size=(35, 4))
    usual = refine(OPEN["host"]([system]), rhs, np.full(4, 0.25), rtol=1e-10, limit=50)
    shifts = np.full(4, 0.25 * 2.0**400)
    small = refine(OPEN["host"]([tiny]), rhs, shifts, rtol=1e-10, limit=50)
    assert np.array_equal(small.values * 2.0**400, usual.values)
