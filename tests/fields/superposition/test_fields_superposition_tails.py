"""Logs of single-source fields against exact discrete solutions, within the range of float64 and below."""

from __future__ import annotations

import importlib.util
from pathlib import Path

import mpmath
import numpy as np
import pytest

from spem.fields.boundary.sources import point_sources
from spem.fields.operator import assemble
from spem.fields.solvers.direct import Direct
from spem.fields.superposition.fields import solve_sources
from spem.fields.superposition.tails import far_system
from spem.shapes.shape import Cuts, Shape

EXACT = Path(__file__).parents[3] / "benchmarks" / "_exact.py"


@pytest.fixture(scope="module")
def bar_logs():
    """The exact solutions of straight bars that the benchmark has."""
    spec = importlib.util.spec_from_file_location("_exact", EXACT)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module.bar_logs


def end_source(counts):
    """The source at the middle of the first end of a bar."""
    sources = point_sources(assemble(Shape.from_mask(np.ones(counts)), "voxel"))
    middle = np.array([-1, *(n // 2 for n in counts[1:])])
    return sources.select([int(np.square(sources.position - middle).sum(axis=1).argmin())])


@pytest.mark.parametrize(
    ("counts", "rho", "smallest"),
    [
        ((300, 9), np.inf, -42),
        ((300, 9), 5.0, -49),
        ((40, 5, 5), np.inf, -14),
        ((40, 5, 5), 5.0, -14),
        ((30, 21), 0.05, -95),
        ((1000, 3), np.inf, -326),
        ((1200, 2, 2), 3.0, -670),
        ((120, 3), 0.01, -480),
        ((1500, 2), 0.7, -1027),
    ],
)
def test_every_entry_of_a_bar_is_right(bar_logs, counts, rho, smallest):
    """A field falls by hundreds of decades along a bar and is right in relative terms all the way."""
    log = solve_sources(end_source(counts), rho).log[0]
    exact = bar_logs(counts, tuple(n // 2 for n in counts[1:]), rho)
    error = [abs(mpmath.expm1(mpmath.mpf(float(a)) - b)) for a, b in zip(log, exact, strict=True)]
    assert max(error) < 1e-12
    assert log.min() / np.log(10) == pytest.approx(smallest, rel=0.05)


def test_tails_of_many_sources_at_once():
    """Sources all around a long bar, whose tails lie on different nodes, are as right together as alone."""
    sources = point_sources(assemble(Shape.from_mask(np.ones((900, 3))), "surface"))
    some = sources.select(np.arange(0, sources.n_sources, 97))
    together = solve_sources(some, 2.0).log
    assert together.min() < -800
    for i in range(some.n_sources):
        alone = solve_sources(some.select([i]), 2.0).log[0]
        assert np.allclose(together[i], alone, rtol=1e-13, atol=1e-13)


def test_reciprocity_at_four_hundred_decades():
    """What the source at one end gives at the other is what it gets from there, by symmetry."""
    sources = point_sources(assemble(Shape.from_mask(np.ones((1400, 3))), "voxel"))
    ends = [int(np.abs(sources.position - end).sum(axis=1).argmin()) for end in ([-1, 1], [1400, 1])]
    log = solve_sources(sources.select(ends), np.inf).log.reshape(2, 1400, 3)
    assert log[0].min() < -900
    assert np.allclose(log[0], log[1, ::-1], rtol=1e-13)


@pytest.mark.parametrize("boundary", ["surface", "voxel"])
def test_system_of_the_far_nodes_is_a_block_of_the_whole(boundary):
    """Its matrix is that of the nodes chosen, with edges cut from one side or both and other spacings."""
    rng = np.random.default_rng(5)
    mask = rng.random((9, 8, 7)) < 0.6
    framed = Shape.from_mask(mask)
    ends = framed.voxels[framed.mask.ravel()[framed.voxels + 1]][::3]
    voxel, direction = np.concatenate([ends, ends + 1]), np.repeat([5, 4], ends.size).astype(np.uint8)
    cuts = Cuts(voxel, direction, rng.uniform(0.05, 1.0, voxel.size))
    shape = Shape(framed.mask, (1.0, 0.5, 3.0), (0.0, 0.0, 0.0), cuts=cuts)
    system, far = assemble(shape, boundary), rng.random(shape.n_nodes) < 0.5
    block = system.matrix(0.3)[np.flatnonzero(far)][:, np.flatnonzero(far)]
    assert np.allclose(far_system(system, far).matrix(0.3).toarray(), block.toarray(), rtol=1e-14, atol=0)


def test_a_solver_is_asked_as_often_as_needed():
    """Fields within the range of float64 take one factorisation; tails take one for each range below."""
    counted = []

    class Counting(Direct):
        def prepare(self, system, shift):
            counted.append(system.n_nodes)
            return super().prepare(system, shift)

    solve_sources(end_source((500, 5)), np.inf, solver=Counting())
    assert counted == [2500]
    counted.clear()
    solve_sources(end_source((1500, 3)), np.inf, solver=Counting())
    assert len(counted) == 2
    assert counted[1] < counted[0] == 4500
