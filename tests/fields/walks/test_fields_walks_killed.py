"""The killed walk: its chances, what becomes of it on average, and walks counted."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.stats import binom

import spem
from spem.errors import ParameterError
from spem.fields.boundary.sources import point_sources
from spem.fields.operator import assemble
from spem.fields.walks.conditioned import arriving_walk, transform_walk
from spem.fields.walks.estimate import estimate_field, estimate_sources, sample_discounts
from spem.fields.walks.intervals import Estimate
from spem.fields.walks.killed import Walk, killed_walk
from spem.fields.walks.lifetimes import (
    arrival_by_step,
    arrival_probabilities,
    expected_steps,
    expected_time,
)
from spem.fields.walks.paths import sample_paths
from spem.fields.walks.steps import step_table, streams, uniform
from spem.shapes.shape import Cuts, Shape
from spem.shapes.synthetic import ball, disk, interval, n_ball

MODELS = ("surface", "voxel")


def rough(ndim, seed):
    """Return a shape of random voxels, spacing and cuts."""
    rng = np.random.default_rng(seed)
    mask = rng.random((5 - ndim // 2,) * ndim) < 0.7
    mask.flat[0] = True
    shape = Shape.from_mask(mask, tuple(rng.uniform(0.5, 2.0, ndim)))
    node, direction = assemble(shape).domain.boundary_edges
    some = rng.random(node.size) < 0.5
    cuts = Cuts(shape.voxels[node[some]], direction[some], rng.uniform(0.01, 1.0, np.count_nonzero(some)))
    return Shape(shape.mask, shape.spacing, shape.origin, cuts=cuts)


@settings(max_examples=20, deadline=None)
@given(
    st.integers(1, 4), st.integers(0, 2**32 - 1), st.sampled_from(MODELS), st.sampled_from([0.7, 9.0, np.inf])
)
def test_every_row_adds_to_one_and_the_field_is_its_fixed_point(ndim, seed, boundary, rho):
    """Steps, arrival and killing are all that happens; v is the chance to arrive in any dimension."""
    shape = rough(ndim, seed)
    walk = killed_walk(shape, rho, boundary=boundary)
    total = walk.transition.sum(axis=1) + walk.arrival + walk.killing
    assert np.abs(total - 1).max() < 1e-15 * 4
    assert walk.probability.min() > 0
    assert np.array_equal(walk.killing > 0, np.full(walk.n_nodes, np.isfinite(rho)))
    v = spem.field(shape, rho, boundary=boundary, solver=spem.Direct())
    assert np.allclose(walk.transition @ v + walk.arrival, v, rtol=1e-12, atol=0)


@pytest.mark.parametrize("boundary", MODELS)
def test_sources_are_places_to_arrive_at(boundary):
    """The chance to end in a source is the field of the source; all of them add up to v."""
    sources = spem.sources(disk(6.0, 1.0, offset=0.3), 7, boundary=boundary)
    walk = killed_walk(sources.system, 3.0)
    chance = arrival_probabilities(walk, sources)
    assert np.allclose(chance, spem.source_fields(sources, 3.0).values, rtol=1e-12, atol=0)
    v = spem.field(sources.system.shape, 3.0, boundary=boundary, solver=spem.Direct())
    assert np.allclose(chance.sum(axis=0), v, rtol=1e-12)


def test_free_walk_on_a_line_takes_the_steps_that_gamblers_know():
    """From place k of n, ruin takes (k + 1) (n - k) steps on average."""
    k = np.arange(9)
    steps = expected_steps(killed_walk(Shape.from_mask(np.ones(9)), np.inf, boundary="voxel"))
    assert np.allclose(steps, (k + 1) * (9 - k))


@pytest.mark.parametrize("make", [disk, ball])
def test_free_walk_lasts_as_long_as_brownian_motion(make):
    """The mean time to leave a ball is (R² - r²) / 2d, to rounding: M weighs the nodes next to cut edges."""
    shape = make(1.0, 0.2, offset=0.3137)
    exact = (1 - np.square(shape.points).sum(axis=1)) / (2 * shape.ndim)
    assert np.allclose(expected_time(killed_walk(shape, np.inf)), exact, rtol=1e-12)


def test_killed_walk_lasts_as_long_as_its_mean_says():
    """Where the boundary is far the time is exponential of mean ρ², and the steps 1 + 2dρ²/h²."""
    walk = killed_walk(disk(20.0, 1.0), 1.5, boundary="voxel")
    middle = int(np.argmin(np.square(walk.system.shape.points).sum(axis=1)))
    assert np.isclose(expected_time(walk)[middle], 1.5**2, rtol=1e-4)
    assert np.isclose(expected_steps(walk)[middle], 1 + 4 * 1.5**2, rtol=1e-4)


@pytest.mark.parametrize("rho", [2.0, np.inf])
def test_arrivals_step_by_step_add_up_to_the_field(rho):
    """Also as the discounted arrivals of the walk that is never killed."""
    walk = killed_walk(interval(8.0, 0.5), rho)
    steps = arrival_by_step(walk, 5, 2000)
    v = spem.field(walk.system.shape, rho, solver=spem.Direct())
    assert np.isclose(steps.sum(), v[5], rtol=1e-10)
    free = killed_walk(walk.system, np.inf)
    assert np.allclose(walk.probability, free.probability * (1 - walk.killing)[:, None], rtol=1e-14)


@pytest.mark.parametrize("boundary", MODELS)
@pytest.mark.parametrize(
    "shape", [interval(9.0, 0.7), disk(5.0, 1.0, offset=0.3), ball(4.0, 1.0), n_ball(2.0, 1.0, ndim=4)]
)
def test_estimates_hold_the_solution(shape, boundary):
    """In one to four dimensions every simultaneous 99 % interval holds the solver's value."""
    rng = np.random.default_rng(5)
    nodes = np.linspace(0, shape.n_nodes - 1, 6).astype(int)
    walk = killed_walk(shape, 2.0, boundary=boundary)
    found = estimate_field(walk, nodes=nodes, n_walks=4000, rng=rng, comparisons=48)
    v = spem.field(shape, 2.0, boundary=boundary, solver=spem.Direct())[nodes]
    assert found.covers(v).all()
    assert (found.upper - found.lower < 0.12).all()
    assert np.allclose(found.steps, expected_steps(walk)[nodes], rtol=0.15)


def test_walks_end_in_each_source_as_often_as_its_field_says():
    """Counts by source hold v^{p_i} and leave out edges of no source."""
    sources = point_sources(assemble(disk(4.0, 1.0))).select([3, 9])
    walk, rng = killed_walk(sources.system, np.inf), np.random.default_rng(2)
    found = estimate_sources(walk, sources, nodes=[10, 20], n_walks=20_000, rng=rng, comparisons=4)
    assert found.covers(arrival_probabilities(walk, sources)[:, [10, 20]].T).all()
    assert found.arrivals.shape == (2, 2)


def test_discounted_arrivals_have_the_mean_and_less_variance():
    """Walks that are never killed estimate v by what their arrivals count, with less variance."""
    walk = killed_walk(disk(5.0, 1.0), 3.0)
    v = spem.field(walk.system.shape, 3.0, solver=spem.Direct())
    nodes = [20, 40]
    found = sample_discounts(walk, nodes=nodes, n_walks=8000, rng=np.random.default_rng(1))
    error = np.abs(found.mean(axis=1) - v[nodes]) / (found.std(axis=1) / np.sqrt(8000))
    assert (error < 4).all()
    assert (found.var(axis=1) < 0.5 * v[nodes] * (1 - v[nodes])).all()


def test_laplace_walks_all_arrive():
    """With ρ = inf no walk is killed, and the interval ends at 1."""
    found = estimate_field(disk(3.0, 1.0), np.inf, nodes=[0, 9], n_walks=500, rng=np.random.default_rng(0))
    assert np.array_equal(found.arrivals, [500, 500])
    assert np.array_equal(found.upper, [1.0, 1.0])
    assert found.covers([1.0, 1.0 + 1e-15]).all()


def test_same_seed_same_walks_and_nodes_do_not_disturb_each_other():
    """A generator of the same state gives the same counts; other nodes after a node leave it alone."""
    shape = disk(4.0, 1.0)
    runs = [
        estimate_field(shape, 2.0, nodes=nodes, n_walks=300, rng=np.random.default_rng(8)).arrivals
        for nodes in ([5, 7], [5, 7], [5, 8])
    ]
    assert np.array_equal(runs[0], runs[1])
    assert runs[0][0] == runs[2][0]


@pytest.mark.parametrize("chance", [0.0, 1e-5, 0.003, 0.2, 0.5, 0.999, 1.0])
def test_intervals_hold_at_least_as_often_as_they_say(chance):
    """For any chance, near 0 and 1 too, the exact share of intervals that hold it is at least the level."""
    n = 400
    counts = np.arange(n + 1)
    every = Estimate(counts, n, counts, np.ones(n + 1))
    held = binom.pmf(counts, n, chance)[every.covers(np.full(n + 1, chance))].sum()
    assert held >= 0.99 - 1e-12


def test_more_comparisons_make_wider_intervals():
    """Bonferroni: ten intervals at once at 0.99 are single ones at 0.999."""
    one = Estimate(np.array([0]), 100, np.array([30]), np.ones(1), level=0.999)
    ten = Estimate(np.array([0]), 100, np.array([30]), np.ones(1), level=0.99, comparisons=10)
    assert np.allclose([one.lower, one.upper], [ten.lower, ten.upper])


def test_streams_are_uniform_and_apart():
    """Moments of the numbers are those of the uniform distribution; two streams are uncorrelated."""
    states = streams(2, np.random.default_rng(4))
    numbers = np.array([[uniform(state) for _ in range(20_000)] for state in states])
    assert numbers.min() >= 0
    assert numbers.max() < 1
    for power in (1, 2, 3):
        assert np.allclose((numbers**power).mean(axis=1), 1 / (power + 1), atol=0.012)
    assert abs(np.corrcoef(numbers)[0, 1]) < 0.03
    assert np.abs([np.corrcoef(row[1:], row[:-1])[0, 1] for row in numbers]).max() < 0.03


def test_steps_that_exceed_one_are_refused():
    """A table of a walk that is none says what h must be."""
    walk = killed_walk(Shape.from_mask(np.ones(5)), np.inf, boundary="voxel")
    bumpy = Walk(walk.system, np.inf, np.log([1.0, 1, 3, 1, 1]), np.zeros(2))
    assert bumpy.killing.min() < 0
    with pytest.raises(ParameterError, match=r"add up to 2 at some node; h must be an upper solution"):
        step_table(bumpy)


def test_wrong_arguments_are_refused():
    """Each says what was expected."""
    shape, rng = Shape.from_mask(np.ones((3, 3))), np.random.default_rng(0)
    walk = killed_walk(shape, 1.0)
    with pytest.raises(ParameterError, match="expected Shape, got str"):
        killed_walk("hand.png", 1.0)
    with pytest.raises(ParameterError, match="expected a positive length"):
        killed_walk(shape, 0.0)
    with pytest.raises(ParameterError, match="nodes are whole numbers from 0 to 8"):
        estimate_field(walk, nodes=[9], n_walks=10, rng=rng)
    with pytest.raises(ParameterError, match="n_walks=0: expected a whole number"):
        estimate_field(walk, nodes=[0], n_walks=0, rng=rng)
    with pytest.raises(ParameterError, match="a walk has its own"):
        estimate_field(walk, 2.0, nodes=[0], n_walks=5, rng=rng)
    with pytest.raises(ParameterError, match="expected Generator, got int"):
        estimate_field(walk, nodes=[0], n_walks=5, rng=0)
    with pytest.raises(ParameterError, match="rho is missing"):
        estimate_field(shape, nodes=[0], n_walks=5, rng=rng)
    with pytest.raises(ParameterError, match="level=1: expected a chance"):
        estimate_field(walk, nodes=[0], n_walks=5, rng=rng, level=1)
    with pytest.raises(ParameterError, match="comparisons=0: expected at least 1"):
        estimate_field(walk, nodes=[0], n_walks=5, rng=rng, comparisons=0)
    with pytest.raises(ParameterError, match="make both of one system"):
        arrival_probabilities(walk, spem.sources(disk(3.0, 1.0)))
    with pytest.raises(ParameterError, match="as many values to hold"):
        estimate_field(walk, nodes=[0], n_walks=5, rng=rng).covers([0.1, 0.2])
    with pytest.raises(ParameterError, match=r"log h must be \(9,\) on nodes, \(12,\) on boundary edges"):
        Walk(walk.system, 1.0, np.zeros(8), np.zeros(12))
    with pytest.raises(ParameterError, match="must be below infinity and not NaN"):
        Walk(walk.system, 1.0, np.full(9, np.nan), np.zeros(12))
    with pytest.raises(ParameterError, match="grows by more than 1e308"):
        Walk(walk.system, 1.0, np.linspace(0, 9000, 9), np.zeros(12))


@pytest.mark.parametrize("rho", [1e160, 1e300])
def test_a_huge_rho_is_infinite(rho):
    """Its square is more than a float64 holds."""
    shape = Shape.from_mask(np.ones((2, 3)))
    walk, free = killed_walk(shape, rho), killed_walk(shape, np.inf)
    np.testing.assert_allclose(walk.killing, 0, atol=1e-300)
    np.testing.assert_allclose(expected_steps(walk), expected_steps(free))


def test_a_tiny_rho_is_refused():
    """In units of the spacing; its inverse square may be more than a float64 holds."""
    shape = Shape.from_mask(np.ones((2, 3)), spacing=1e-9)
    assert killed_walk(shape, 1e-14).killing.min() > 0.99
    for rho in (1e-16, 1e-160):
        with pytest.raises(ParameterError, match="below 1e-06 of the spacing 1e-09"):
            killed_walk(shape, rho)


def test_transformed_walks_have_no_discount_and_are_transformed_no_more():
    """Their chances would be those of another walk."""
    walk = arriving_walk(killed_walk(Shape.from_mask(np.ones(3)), 1.0))
    assert not walk.plain
    with pytest.raises(ParameterError, match="this walk is transformed already"):
        arriving_walk(walk)
    with pytest.raises(ParameterError, match="this walk is transformed already"):
        sample_discounts(walk, nodes=[0], n_walks=2, rng=np.random.default_rng(0))


def test_sources_of_the_other_boundary_are_refused():
    """Though the shape is the same, and has as many boundary edges."""
    shape = Shape.from_mask(np.ones(3))
    with pytest.raises(ParameterError, match="make both of one system"):
        arrival_probabilities(killed_walk(shape, 1.0), spem.sources(shape, boundary="voxel"))


@pytest.mark.parametrize("node", [1.5, True, [0, 1], [], 3, -1, None, "0"])
def test_paths_start_at_one_node(node):
    """Neither at a fraction, nor at several."""
    walk = killed_walk(Shape.from_mask(np.ones(3)), 1.0)
    with pytest.raises(ParameterError, match=r"nodes are whole numbers from 0 to 2|expected one node"):
        sample_paths(walk, node, 1, np.random.default_rng(0))
    with pytest.raises(ParameterError, match=r"nodes are whole numbers from 0 to 2|expected one node"):
        arrival_by_step(walk, node, 1)


@pytest.mark.parametrize("count", [0, -1, 1.5, True, None, [2]])
def test_numbers_of_walks_and_steps_are_whole(count):
    """One at least."""
    walk, rng = killed_walk(Shape.from_mask(np.ones(3)), 1.0), np.random.default_rng(0)
    with pytest.raises(ParameterError, match="expected a whole number of at least 1"):
        sample_paths(walk, 0, count, rng)
    with pytest.raises(ParameterError, match="expected a whole number of at least 1"):
        arrival_by_step(walk, 0, count)
    with pytest.raises(ParameterError, match="expected a whole number of at least 1"):
        estimate_field(walk, nodes=[0], n_walks=count, rng=rng)


@pytest.mark.parametrize("comparisons", [np.nan, np.inf, 0])
def test_comparisons_are_a_number(comparisons):
    """Otherwise intervals would be empty, or everything."""
    with pytest.raises(ParameterError, match="comparisons="):
        Estimate(np.array([0]), 9, np.array([3]), np.ones(1), comparisons=comparisons)


def test_h_that_is_wrong_is_refused():
    """One value too many on the boundary, or none that is positive."""
    walk = killed_walk(Shape.from_mask(np.ones(3)), 1.0)
    with pytest.raises(ParameterError, match=r"on the boundary must be one number or \(2,\), not \(3,\)"):
        transform_walk(walk, np.zeros(3), np.zeros(3))
    with pytest.raises(ParameterError, match="h is zero everywhere"):
        expected_steps(transform_walk(walk, np.full(3, -np.inf)))
    with pytest.raises(ParameterError, match="expected Walk, got Shape"):
        arriving_walk(walk.system.shape)


@pytest.mark.data
@pytest.mark.parametrize("file", ["tari1000/obj11_1.png", "kimia216", "horse_poses/1.obj"])
def test_estimates_hold_the_solution_on_real_shapes(data_dir, file):
    """Silhouettes and an open mesh, with the surface where it was found."""
    path = data_dir / file
    shape = spem.read(min(path.glob("*.png")) if path.is_dir() else path, voxels=1500)
    rho, rng = 0.1 * shape.size, np.random.default_rng(7)
    nodes = rng.choice(shape.n_nodes, 12, replace=False)
    found = estimate_field(shape, rho, nodes=nodes, n_walks=4000, rng=rng, comparisons=36)
    assert found.covers(spem.field(shape, rho, solver=spem.Direct())[nodes]).all()
