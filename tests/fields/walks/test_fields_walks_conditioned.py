"""Doob's h-transform: conductances, conservation, the identity (3.3), drift, and sampled paths."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.linalg
import scipy.sparse

import spem
from spem.errors import ParameterError
from spem.fields.gradients import log_gradient
from spem.fields.walks.conditioned import (
    arriving_walk,
    conductances,
    drift,
    network_laplacian,
    source_walk,
    transform_walk,
    transition_density,
)
from spem.fields.walks.killed import killed_walk
from spem.fields.walks.lifetimes import arrival_probabilities, expected_steps, expected_time
from spem.fields.walks.paths import sample_paths
from spem.shapes.shape import Shape
from spem.shapes.synthetic import ball, disk, interval

MODELS = ("surface", "voxel")
RHO = 3.0


@pytest.mark.parametrize("boundary", MODELS)
@pytest.mark.parametrize("shape", [interval(9.0, 0.7), disk(5.0, (1.0, 0.7), offset=0.3), ball(3.0, 1.0)])
def test_conditioned_on_a_solution_the_walk_is_conservative(shape, boundary):
    """With h = v, and with the field of a source, rows add to 1 with the boundary and nothing is killed."""
    walk = killed_walk(shape, RHO, boundary=boundary)
    fields = spem.source_fields(spem.sources(shape, 2, boundary=boundary), RHO)
    for conditioned in (arriving_walk(walk), source_walk(fields, 1)):
        assert np.abs(conditioned.killing).max() < 1e-13
        total = conditioned.transition.sum(axis=1) + conditioned.arrival
        assert np.abs(total - 1).max() < 1e-13
    apart = np.ones(walk.log_boundary.size, bool)
    apart[fields.sources.edge_source == 1] = False
    assert not source_walk(fields, 1).edge_arrival[apart].any()


def test_only_a_solution_makes_it_conservative():
    """Of h between 1 and v, and solutions of another ρ, none but v itself leaves nothing to be killed."""
    walk = killed_walk(disk(6.0, 1.0), RHO)
    log_v = arriving_walk(walk).log_h
    killed = [np.abs(transform_walk(walk, share * log_v).killing).max() for share in (0.0, 0.5, 1.0)]
    assert killed[0] > killed[1] > 1e-2
    assert killed[2] < 1e-13
    other = arriving_walk(killed_walk(walk.system, 2 * RHO)).log_h
    # (A + M/ρ²) h = M (1/ρ² - 1/ρ'²) h of the other solution, so this share is killed at every step
    share = walk.system.mass * (RHO**-2 - (2 * RHO) ** -2) / walk.rate
    assert np.allclose(transform_walk(walk, other).killing, share, rtol=1e-10)


@pytest.mark.parametrize("boundary", MODELS)
def test_the_transformed_operator_is_the_laplacian_of_the_network(boundary):
    """1/h ∘ (Δ - 1/ρ²) ∘ h is the Laplacian of c̃ over the measure h²M, as a matrix, to rounding (3.3)."""
    walk = killed_walk(disk(5.0, 1.0, offset=0.2), RHO, boundary=boundary)
    conditioned = arriving_walk(walk)
    h, system = np.exp(conditioned.log_h), walk.system
    middle = scipy.sparse.diags_array(1 / system.mass) @ system.matrix(RHO**-2)
    left = scipy.sparse.diags_array(1 / h) @ middle @ scipy.sparse.diags_array(h)
    assert abs(left - network_laplacian(conditioned)).max() < 1e-13 * abs(left).max()


def test_conductances_are_symmetric_and_make_the_walk():
    """c̃_xy = h(x) h(y) c_xy; the chance of a step is its share of all conductances of the node."""
    walk = arriving_walk(killed_walk(disk(4.0, 1.0), RHO))
    interior, ends = conductances(walk)
    assert abs(interior - interior.T).max() == 0
    plain, _ = conductances(killed_walk(walk.system, RHO))
    h = np.exp(walk.log_h)
    assert np.allclose(interior.toarray(), h[:, None] * plain.toarray() * h, rtol=1e-14)
    node, _ = walk.system.domain.boundary_edges
    total = interior.sum(axis=1) + np.bincount(node, ends, walk.n_nodes)
    assert np.allclose(interior.toarray() / total[:, None], walk.transition.toarray(), rtol=1e-12)
    assert np.allclose(ends / total[node], walk.edge_arrival, rtol=1e-12)


def test_drift_is_the_gradient_of_the_logarithm():
    """Away from the surface it is 2 ∇(log h) to rounding, everywhere in the voxel model; zero with h = 1."""
    for boundary in MODELS:
        walk = arriving_walk(killed_walk(disk(6.0, (1.0, 0.8), offset=0.3), RHO, boundary=boundary))
        wanted = 2 * log_gradient(walk.system, walk.log_h, log_boundary=0.0)
        error = np.abs(drift(walk) - wanted).max(axis=1)
        inner = (walk.system.domain.neighbours < walk.n_nodes).all(axis=1)
        assert error[inner | (boundary == "voxel")].max() < 1e-14
        free = drift(arriving_walk(killed_walk(walk.system, np.inf)))
        assert np.abs(free[inner]).max() < 1e-12


def test_arrival_time_is_the_slope_of_the_log_field():
    """Conditioned on arriving, the mean time is -∂(log v)/∂(1/ρ²): closed form on an interval."""
    root, half, errors = 1 / RHO, 5.0, []
    for spacing in (0.4, 0.2):
        shape = interval(2 * half, spacing, offset=0.3137)
        time = expected_time(arriving_walk(killed_walk(shape, RHO)))
        x = shape.points[:, 0]
        exact = (half * np.tanh(half * root) - x * np.tanh(x * root)) / (2 * root)
        errors.append(np.abs(time - exact).max())
    assert errors[1] < 5e-3
    assert np.log2(errors[0] / errors[1]) > 1.8


def test_conditioned_walks_arrive_sooner_the_smaller_rho():
    """At every node the mean time and number of steps fall as ρ falls."""
    system = killed_walk(disk(6.0, 1.0), 1.0).system
    walks = [arriving_walk(killed_walk(system, rho)) for rho in (1.0, 2.0, 5.0, np.inf)]
    for read in (expected_time, expected_steps):
        assert (np.diff([read(walk) for walk in walks], axis=0) > 0).all()


def test_conditioned_walk_ends_in_its_source_and_keeps_ratios():
    """It ends in its source for certain; h = v keeps the sources in the ratio of their fields."""
    sources = spem.sources(disk(5.0, 1.0), 5)
    fields = spem.source_fields(sources, RHO)
    own = arrival_probabilities(source_walk(fields, 2), sources)
    assert np.allclose(own, np.eye(5)[:, [2]], atol=1e-12)
    conditioned = arriving_walk(killed_walk(sources.system, RHO))
    ratio = fields.values / fields.values.sum(axis=0)
    assert np.allclose(arrival_probabilities(conditioned, sources), ratio, rtol=1e-11)


@pytest.mark.parametrize("boundary", MODELS)
def test_kernel_of_the_network_gives_that_of_the_killed_walk(boundary):
    """h(x) p̃_t(x, y) h(y) is the kernel of exp(-t M⁻¹(A + M/ρ²)), to rounding (3.4)."""
    walk = killed_walk(disk(3.0, 0.8), 2.0, boundary=boundary)
    conditioned, system = arriving_walk(walk), walk.system
    h = np.exp(conditioned.log_h)
    kernel = h[:, None] * transition_density(conditioned, 1.3) * h
    matrix = system.matrix(2.0**-2).toarray() / system.mass[:, None]
    direct = scipy.linalg.expm(-1.3 * matrix) / system.mass / np.prod(system.shape.spacing)
    assert np.abs(kernel - direct).max() < 1e-13
    assert np.abs(kernel - kernel.T).max() < 1e-15


def test_heat_kernel_is_gaussian_far_from_the_boundary():
    """(3.2) in one and two dimensions, to the second order of the grid."""
    line = interval(24.0, 0.2)
    density = transition_density(killed_walk(line, np.inf), 0.8)
    middle, x = line.n_nodes // 2, line.points[:, 0]
    exact = np.exp(-np.square(x - x[middle]) / 3.2) / np.sqrt(np.pi * 3.2)
    assert np.abs(density[middle] - exact).max() < 4e-3


def test_paths_step_from_node_to_node_and_end_where_they_must():
    """Each step goes to a neighbour; the last one to the source, or to nowhere when it is killed."""
    sources = spem.sources(disk(5.0, 1.0), 6)
    fields = spem.source_fields(sources, RHO)
    shape, rng = sources.system.shape, np.random.default_rng(3)
    ends = []
    for path in sample_paths(source_walk(fields, 4), 30, 20, rng):
        assert path.arrived
        assert path.points.shape == (path.n_steps + 1, 2)
        moved = np.abs(np.diff(path.points[:-1], axis=0)).sum(axis=1)
        assert np.allclose(moved, 1.0)
        ends.append(path.points[-1])
    mine = sources.points.position[sources.group == 4]
    near = np.linalg.norm(np.array(ends)[:, None] - mine, axis=2).min(axis=1)
    assert near.max() < 1e-12
    fates = {path.arrived for path in sample_paths(killed_walk(shape, 2.0), 30, 60, rng)}
    assert fates == {True, False}


def test_mean_path_length_is_the_expected_number_of_steps():
    """Of conditioned paths, within four standard errors."""
    walk = arriving_walk(killed_walk(disk(5.0, 1.0), 2.0))
    steps = [path.n_steps for path in sample_paths(walk, 38, 2000, np.random.default_rng(0))]
    assert abs(np.mean(steps) - expected_steps(walk)[38]) < 4 * np.std(steps) / np.sqrt(2000)


def test_nodes_that_a_source_does_not_reach():
    """They keep no chance of a step, have no mean time and cannot be started from."""
    line = Shape.from_mask([1, 1, 0, 0, 1], name="line")
    fields = spem.source_fields(spem.sources(line), np.inf)
    walk = source_walk(fields, 0)
    assert walk.killing[:2].max() < 1e-14
    assert walk.killing[2] == 1
    assert not walk.probability[2].any()
    assert np.isnan(expected_time(walk)[2])
    assert np.isfinite(expected_time(walk)[:2]).all()
    with pytest.raises(ParameterError, match="no walk from node 2: the source does not reach it"):
        sample_paths(walk, 2, 1, np.random.default_rng(0))


def test_wrong_arguments_are_refused():
    """Each says what was expected."""
    walk = killed_walk(Shape.from_mask(np.ones((3, 3))), 1.0)
    with pytest.raises(ParameterError, match=r"log h must be \(9,\), one a node, not \(8,\)"):
        transform_walk(walk, np.zeros(8))
    with pytest.raises(ParameterError, match="expected a time of at least 0"):
        transition_density(walk, -1.0)
    with pytest.raises(ParameterError, match="a dense kernel takes 4000 nodes at most, not 4900"):
        transition_density(killed_walk(Shape.from_mask(np.ones((70, 70))), 1.0), 1.0)
    fields = spem.source_fields(spem.sources(Shape.from_mask(np.ones(3000))), 2.0)
    with pytest.raises(ParameterError, match=r"h falls by e\^-1\d\d\d, more than a float64 holds"):
        expected_time(source_walk(fields, 0))
