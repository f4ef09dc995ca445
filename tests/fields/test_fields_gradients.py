"""Gradients of fields and of their logarithms."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.special import ive

import spem
from spem.errors import ParameterError
from spem.fields.boundary.sources import check_source, point_sources
from spem.fields.gradients import gradient, log_gradient, source_gradient, unit_vectors
from spem.fields.operator import assemble
from spem.fields.superposition.fields import solve_sources
from spem.shapes.shape import Cuts, Shape
from spem.shapes.synthetic import ball, disk

OFFSET = 0.3137
RHO = 0.3


def _radial(shape, radius=1.0, rho=RHO):
    """Return the exact field of a disk or ball and its gradient."""
    r = np.linalg.norm(shape.points, axis=1)
    order = shape.ndim / 2 - 1
    grow = np.exp((r - radius) / rho)
    inner, outer = r / rho, radius / rho
    edge = ive(order, outer) / outer**order
    value = grow * ive(order, inner) / inner**order / edge
    slope = grow * ive(order + 1, inner) / inner**order / edge / rho
    return value, shape.points * (slope / r)[:, None]


@pytest.mark.parametrize(("make", "spacing"), [(disk, 0.1), (ball, 0.16)])
def test_second_order_on_closed_forms(make, spacing):
    """On the exact field of a disk and a ball errors fall with the square of the spacing."""
    errors = []
    for h in (spacing, spacing / 4):
        shape = make(1.0, h, offset=OFFSET)
        value, exact = _radial(shape)
        error = np.abs(gradient(assemble(shape), value, boundary=1.0) - exact)
        errors.append((error.max(), error.mean()))
    worst, mean = np.log(np.divide(*errors)) / np.log(4)
    assert errors[0][0] < 0.4
    assert worst > 1.6
    assert mean > 1.8


def test_solved_fields_have_right_gradients():
    """The gradient of the discrete field is first order at worst next to the surface, second in the mean."""
    worst, mean = [], []
    for h in (0.08, 0.02):
        shape = disk(1.0, h, offset=OFFSET)
        error = np.abs(gradient(assemble(shape), spem.field(shape, RHO), boundary=1.0) - _radial(shape)[1])
        worst.append(error.max())
        mean.append(error.mean())
    assert np.log(worst[0] / worst[1]) / np.log(4) > 0.8
    assert np.log(mean[0] / mean[1]) / np.log(4) > 1.75


def test_unknown_boundary_is_first_order():
    """Without boundary values the differences next to the surface are first order."""
    errors = []
    for h in (0.08, 0.02):
        shape = disk(1.0, (h, h / 2), offset=OFFSET)
        value, exact = _radial(shape)
        errors.append(np.abs(gradient(assemble(shape), value) - exact).max())
    assert np.log(errors[0] / errors[1]) / np.log(4) > 0.8


@settings(max_examples=20, deadline=None)
@given(st.integers(1, 4), st.integers(0, 2**32 - 1))
def test_parabolas_along_axes_are_exact(ndim, seed):
    """Sums of parabolas in each coordinate have their exact gradient, whatever the cuts and the spacing."""
    rng = np.random.default_rng(seed)
    mask = rng.random((4,) * ndim) < 0.7
    mask.flat[0] = True
    shape = Shape.from_mask(mask, tuple(rng.uniform(0.5, 2.0, ndim)))
    bare = assemble(shape).domain
    node, direction = np.nonzero(bare.neighbours == bare.n_nodes)
    cuts = Cuts(shape.voxels[node], direction, rng.uniform(0.05, 1.0, node.size))
    system = assemble(Shape(shape.mask, shape.spacing, shape.origin, cuts=cuts))
    a, b = rng.normal(size=(2, ndim))
    ends = shape.points[node]
    step = (2 * (direction % 2) - 1.0) * system.domain.fraction
    ends[np.arange(node.size), direction // 2] += step * np.asarray(shape.spacing)[direction // 2]
    found = gradient(system, (shape.points**2) @ a + shape.points @ b, boundary=(ends**2) @ a + ends @ b)
    assert found == pytest.approx(2 * a * shape.points + b, abs=1e-9)


def test_edges_between_inside_nodes_can_be_cut():
    """Two surfaces between neighbours part them: each sees the value on its own surface."""
    shape = Shape.from_mask([1, 1])
    cut = Cuts(np.array([1, 2]), np.array([1, 0]), np.array([0.25, 0.5]))
    system = assemble(Shape(shape.mask, shape.spacing, shape.origin, cuts=cut))
    found = gradient(system, [1.0, 10.0], boundary=[0.5, 1.25, 9.5, 10.5])
    assert found.ravel().tolist() == [1.0, 1.0]


def test_logs_agree_with_values():
    """The gradient of the log is that of the field over the field, boundary ends included."""
    shape = disk(1.0, 0.1, offset=OFFSET)
    system = assemble(shape)
    value, _ = _radial(shape)
    expected = gradient(system, value, boundary=1.0) / value[:, None]
    assert log_gradient(system, np.log(value), log_boundary=0.0) == pytest.approx(expected, rel=1e-9)


@pytest.mark.parametrize("boundary", ["voxel", "surface"])
def test_directions_hold_far_below_underflow(boundary):
    """At e^-700 of the source a strip's field still falls by the same factor each node, along its middle."""
    shape = Shape.from_mask(np.ones((5, 1400)))
    system = assemble(shape, boundary)
    sources = point_sources(system)
    end = int(np.argmin(np.linalg.norm(sources.position - [2, -0.5], axis=1)))
    middle = 2 * 1400 + np.arange(300, 1200)
    slope = source_gradient(solve_sources(sources.select([end]), np.inf), 0)[middle]
    assert slope[:, 0] == pytest.approx(0, abs=1e-9)
    assert slope[:, 1] == pytest.approx(slope[0, 1], rel=1e-9)
    assert slope[0, 1] < -0.4
    assert unit_vectors(slope)[:, 1] == pytest.approx(-1)


def test_fields_that_are_zero_have_no_direction():
    """In a component that a source does not touch the gradient is zero, never NaN."""
    sources = point_sources(assemble(Shape.from_mask([[1, 1, 1, 0, 0, 1, 1]])))
    found = source_gradient(solve_sources(sources, 2.0), 0)
    reached = np.isfinite(solve_sources(sources, 2.0).log[0])
    assert (found[~reached] == 0).all()
    assert (np.abs(found[reached]).max(axis=1) > 0).all()
    assert (unit_vectors(found)[~reached] == 0).all()


def test_one_node_alone_has_no_slope():
    """Of a single node without boundary values nothing is known."""
    system = assemble(Shape.from_mask([[1]]))
    assert gradient(system, [3.0]).tolist() == [[0.0, 0.0]]
    assert log_gradient(system, [3.0]).tolist() == [[0.0, 0.0]]


def test_wild_logs_stay_finite():
    """Neighbours that differ by more than any field does give finite slopes and unit directions."""
    system = assemble(Shape.from_mask(np.ones(3)))
    found = log_gradient(system, [-2000.0, 0.0, -2000.0], log_boundary=-np.inf)
    assert np.isfinite(found).all()
    assert unit_vectors(found).ravel().tolist() == [1.0, 0.0, -1.0]


def test_bad_fields_are_refused():
    """Fields of another length, NaN, infinite logs and wrong boundary values each have their line."""
    system = assemble(Shape.from_mask(np.ones(3), name="rod"))
    with pytest.raises(ParameterError, match=r"rod: a field must be \(3,\), one a node, not \(2,\)"):
        gradient(system, [1, 2])
    with pytest.raises(ParameterError, match="finite values; of logs with -inf take log_gradient"):
        gradient(system, [1, -np.inf, 2])
    with pytest.raises(ParameterError, match="below infinity and not NaN"):
        log_gradient(system, [0, np.nan, 0])
    with pytest.raises(ParameterError, match=r"one number or \(2,\), one a boundary edge, not \(3,\)"):
        gradient(system, [1, 2, 3], boundary=[1, 1, 1])
    with pytest.raises(ParameterError, match="source 2, expected 0 to 1"):
        check_source(point_sources(system), 2)
    with pytest.raises(ParameterError, match=r"source 0\.5, expected 0 to 1"):
        check_source(point_sources(system), 0.5)
