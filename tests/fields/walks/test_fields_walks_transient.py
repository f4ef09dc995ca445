"""The transient field: closed forms, order, decay, monotone in time."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.linalg
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.special import j0, j1, jn_zeros

import spem
from spem.errors import ConvergenceError, ParameterError
from spem.fields.operator import assemble
from spem.fields.walks.killed import killed_walk
from spem.fields.walks.lifetimes import expected_time
from spem.fields.walks.transient import decay_rate, solve_transient
from spem.shapes.closed_forms import ball_field, interval_field
from spem.shapes.shape import Shape
from spem.shapes.synthetic import ball, disk, interval

RHO = 0.7
TIMES = np.array([0.05, 0.2, 1.0])


def _line(spacing):
    """Return an interval of length 2 and its exact field over time."""
    shape = interval(2.0, spacing, offset=0.3137)
    k = np.arange(300)
    wave = (k + 0.5) * np.pi
    rate = wave**2 + RHO**-2
    part = np.cos(np.outer(shape.points[:, 0], wave)) * (2 * wave * (-1.0) ** k / rate)
    return shape, interval_field(shape.points, 2.0, RHO)[:, None] - part @ np.exp(-np.outer(rate, TIMES))


def _round(spacing):
    """Return a disk of radius 1 and its exact field over time."""
    shape = disk(1.0, spacing, offset=0.3137)
    wave = jn_zeros(0, 100)
    rate = wave**2 + RHO**-2
    r = np.linalg.norm(shape.points, axis=1)
    part = j0(np.outer(r, wave)) * (2 * wave / (j1(wave) * rate))
    return shape, ball_field(shape.points, 1.0, RHO)[:, None] - part @ np.exp(-np.outer(rate, TIMES))


@pytest.mark.parametrize("exact", [_line, _round])
def test_second_order_in_space_on_closed_forms(exact):
    """The series of an interval and of a disk are met at every time, to second order of the spacing."""
    errors = []
    for spacing in (0.1, 0.05):
        shape, wanted = exact(spacing)
        errors.append(np.abs(solve_transient(shape, RHO, TIMES).values - wanted).max())
    assert errors[1] < 2e-3
    assert np.log2(errors[0] / errors[1]) > 1.8


@settings(max_examples=12, deadline=None)
@given(
    st.integers(1, 3),
    st.integers(0, 2**32 - 1),
    st.sampled_from(["surface", "voxel"]),
    st.sampled_from([0.8, np.inf]),
    st.sampled_from([0.0, 1.0, None]),
)
def test_agrees_with_the_dense_exponential(ndim, seed, boundary, rho, start):
    """Over five decades of times, to the tolerance, from any start and in any dimension."""
    rng = np.random.default_rng(seed)
    mask = rng.random((6 - ndim,) * ndim) < 0.8
    mask.flat[0] = True
    system = assemble(Shape.from_mask(mask, tuple(rng.uniform(0.5, 2.0, ndim))), boundary)
    begin = rng.normal(size=system.n_nodes) if start is None else np.full(system.n_nodes, start)
    times = np.geomspace(1e-3, 1e2, 6)
    found = solve_transient(system, rho, times, start=begin)
    matrix = system.matrix(rho**-2.0).toarray() / system.mass[:, None]
    steady = np.linalg.solve(matrix, system.rhs / system.mass)
    for t, column in zip(times, found.values.T, strict=True):
        exact = steady + scipy.linalg.expm(-t * matrix) @ (begin - steady)
        assert np.abs(column - exact).max() < 2e-8 * max(1, np.abs(begin - steady).max())


@pytest.mark.parametrize("start", [0.0, 1.0])
def test_monotone_between_start_and_steady_state(start):
    """From 0 the field rises at every node, from 1 it falls; it ends at v and starts where it is told."""
    times = np.concatenate([[0.0], np.geomspace(1e-2, 10, 20), [np.inf]])
    found = solve_transient(disk(1.0, 0.1), 0.5, times, start=start)
    step = np.diff(found.values, axis=1) * (1 if start == 0 else -1)
    assert step.min() > -2e-8
    assert np.array_equal(found.values[:, 0], np.full(found.steady.size, start))
    assert np.allclose(found.values[:, -1], spem.field(disk(1.0, 0.1), 0.5), atol=1e-9)


@pytest.mark.parametrize("rho", [0.4, np.inf])
def test_tends_to_the_steady_state_at_the_lowest_rate(rho):
    """Late, the distance from v falls as exp(-(λ₁ + 1/ρ²) t)."""
    shape = disk(1.0, 0.1)
    rate = decay_rate(shape, rho)
    times = np.array([1.0, 1.5])
    found = solve_transient(shape, rho, times, rtol=1e-11)
    gap = np.linalg.norm(found.values - found.steady[:, None], axis=0)
    assert np.isclose(np.log(gap[0] / gap[1]) / 0.5, rate, rtol=1e-4)
    assert np.isclose(rate, decay_rate(shape, np.inf) + rho**-2.0, rtol=1e-10)


@pytest.mark.parametrize(
    ("make", "size", "exact"),
    [(interval, 2.0, (np.pi / 2) ** 2), (disk, 1.0, jn_zeros(0, 1)[0] ** 2), (ball, 1.0, np.pi**2)],
)
def test_lowest_eigenvalue_to_second_order(make, size, exact):
    """Of an interval, a disk and a ball."""
    errors = [abs(decay_rate(make(size, h, offset=0.3137), np.inf) / exact - 1) for h in (0.2, 0.1)]
    assert errors[1] < 4e-3
    assert np.log2(errors[0] / errors[1]) > 1.7


def test_survival_over_all_time_is_the_mean_lifetime():
    """The chance to be on the way at time t, integrated over t, is the mean time that a walk lasts."""
    shape = interval(4.0, 0.2)
    times = np.concatenate([[0.0], np.geomspace(1e-4, 60, 1500)])
    # on the way still: neither arrived (start 0) nor killed (1 less start 1)
    arrived = solve_transient(shape, 1.5, times).values
    killed = 1 - solve_transient(shape, 1.5, times, start=1.0).values
    total = np.trapezoid(1 - arrived - killed, times, axis=1)
    assert np.allclose(total, expected_time(killed_walk(shape, 1.5)), rtol=1e-3)


def test_one_node_and_nothing_to_do():
    """A single node decays at its own rate; a start at the steady state stays there."""
    dot = Shape.from_mask([1], spacing=1.0)
    found = solve_transient(dot, np.inf, [1.0], boundary="voxel")
    assert np.allclose(found.values, 1 - np.exp(-2.0))
    assert decay_rate(dot, np.inf, boundary="voxel") == 2.0
    still = solve_transient(disk(1.0, 0.2), np.inf, [0.0, 1.0], start=1.0)
    assert np.allclose(still.values, 1.0, atol=1e-12)
    assert still.n_solves == 1


def test_missed_tolerance_carries_the_best():
    """Too few solves raise, with what they reached."""
    with pytest.raises(ConvergenceError, match="after 7 solves, more than rtol=1e-13") as caught:
        solve_transient(disk(1.0, 0.05), RHO, np.geomspace(1e-3, 1, 5), rtol=1e-13, max_solves=8)
    assert caught.value.solution.values.shape[1] == 5


def test_wrong_arguments_are_refused():
    """Each says what was expected."""
    shape = Shape.from_mask(np.ones(4), name="rod")
    with pytest.raises(ParameterError, match="expected one or more times of at least 0"):
        solve_transient(shape, 1.0, [-1.0])
    with pytest.raises(ParameterError, match="expected one or more times of at least 0"):
        solve_transient(shape, 1.0, "soon")
    with pytest.raises(ParameterError, match=r"rod: a field at time 0 is one finite number or \(4,\)"):
        solve_transient(shape, 1.0, [1.0], start=[0.0, 1.0])


def test_lowest_rate_is_the_lowest_value_of_the_spectrum():
    """Found by inverse iteration here, among all of them by a dense solver."""
    shape = disk(6.0, 1.0, offset=0.2)
    for boundary in ("surface", "voxel"):
        system = assemble(shape, boundary)
        root = np.sqrt(system.mass)
        values = np.linalg.eigvalsh(system.matrix().toarray() / root[:, None] / root)
        assert np.isclose(decay_rate(system, np.inf), values[0], rtol=1e-10)
