"""Nodal domains: thresholds in common, and which nodes they choose."""

from __future__ import annotations

from itertools import combinations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import spem
from spem.embedding.nodal import nodal_clusters, nodal_domains, nodal_thresholds
from spem.errors import ParameterError


def groups(seed: int = 0) -> list[np.ndarray]:
    """Three shapes whose one projection is near -5, 0 and 8, in unequal numbers."""
    rng = np.random.default_rng(seed)
    middles = np.repeat([-5.0, 0.0, 8.0], [30, 100, 60])
    return [rng.permutation(middles + 0.1 * rng.standard_normal(190))[:, None] for _ in range(3)]


def test_thresholds_are_the_outer_cluster_means():
    """Three groups of intensities give the means of the lowest and the highest."""
    assert nodal_thresholds(groups()) == pytest.approx(np.array([[-5.0, 8.0]]), abs=0.05)


def test_thresholds_midway_hold_whole_clusters():
    """Cut between the clusters, a domain has as many nodes as its group."""
    shapes = groups()
    assert nodal_clusters(shapes) == pytest.approx(np.array([[-5.0, 0.0, 8.0]]), abs=0.05)
    found = nodal_domains(shapes[0], nodal_thresholds(shapes, at="midway"))
    assert [(found == side).sum() for side in (-1, 0, 1)] == [30, 100, 60]


@settings(max_examples=20, deadline=None)
@given(st.lists(st.integers(-30, 30), min_size=3, max_size=12).filter(lambda values: len(set(values)) > 2))
def test_clusters_are_those_of_least_inertia(values: list[int]):
    """Of a few values, no division into three runs has less inertia."""
    ordered = np.sort(np.array(values, float))
    means = nodal_clusters([ordered[:, None]])[0]
    least = min(
        sum(np.square(run - run.mean()).sum() for run in np.split(ordered, [i, j]))
        for i, j in combinations(range(1, ordered.size), 2)
    )
    assert np.square(ordered[:, None] - means).min(axis=1).sum() == pytest.approx(least, abs=1e-9)


def test_thresholds_count_every_shape_the_same():
    """A shape of many nodes moves them no more than one of few."""
    small, large = groups()[0], np.tile(groups(1)[0], (50, 1)) + 1.0
    found = nodal_thresholds([small, large], nodes_per_shape=100)
    assert found == pytest.approx(np.array([[-4.5, 8.5]]), abs=0.3)


def test_thresholds_repeat_with_the_generator():
    """The same generator gives the same thresholds, and the default is one of seed 0."""
    first = nodal_thresholds(groups(), nodes_per_shape=20, rng=np.random.default_rng(0))
    assert np.array_equal(first, nodal_thresholds(groups(), nodes_per_shape=20))


@settings(max_examples=15, deadline=None)
@given(st.floats(0.01, 100.0), st.integers(0, 5))
def test_domains_do_not_depend_on_the_unit(scale: float, seed: int):
    """Intensities and thresholds in another unit choose the same nodes."""
    shapes = groups(seed)
    plain = nodal_domains(shapes[0], nodal_thresholds(shapes))
    scaled = nodal_domains(scale * shapes[0], nodal_thresholds([scale * shape for shape in shapes]))
    assert (plain == scaled).mean() > 0.99


def test_domains_are_disjoint_and_outermost():
    """Below the one threshold is −1, above the other 1, and what lies on either is in none."""
    found = nodal_domains(np.array([[-2.0, 2.0], [-1.0, 1.0], [0.0, 0.0], [3.0, -3.0]]), [[-1, 1], [-1, 1]])
    assert found.tolist() == [[-1, 1], [0, 0], [0, 0], [1, -1]]
    assert found.dtype == np.int8


def test_domains_without_thresholds_are_the_signs():
    """The second projection of a disk has the two signs, the first one alone."""
    maps = spem.maps(spem.synthetic.disk(radius=12.0, spacing=1.0), n_maps=2)
    found = nodal_domains(maps.values)
    assert set(found[:, 0].tolist()) == {1}
    assert set(found[:, 1].tolist()) == {-1, 1}
    assert np.array_equal(found, np.sign(maps.values))


def test_thresholds_refuse_what_has_no_three_clusters():
    """No shape, shapes with other maps, a projection of two values, and what is no matrix."""
    with pytest.raises(ParameterError, match="no shape: expected at least one"):
        nodal_thresholds([])
    with pytest.raises(ParameterError, match="shapes with 1 and 2 maps"):
        nodal_thresholds([np.ones((4, 1)), np.ones((4, 2))])
    with pytest.raises(ParameterError, match="projection 1 has fewer than 3"):
        nodal_thresholds([np.array([[0.0], [1.0], [1.0]])])
    with pytest.raises(ParameterError, match="finite values"):
        nodal_thresholds([np.array([[0.0], [np.nan]])])
    with pytest.raises(ParameterError, match="at='mean' must be one of means, midway"):
        nodal_thresholds(groups(), at="mean")


def test_domains_refuse_thresholds_that_do_not_fit():
    """Another number of maps, or a negative threshold above the positive one."""
    with pytest.raises(ParameterError, match="thresholds of shape"):
        nodal_domains(np.ones((3, 2)), [[-1.0, 1.0]])
    with pytest.raises(ParameterError, match="thresholds of shape"):
        nodal_domains(np.ones((3, 1)), [[1.0, -1.0]])


def test_maps_are_asked_for_their_values():
    """`Maps` in place of an array."""
    maps = spem.maps(spem.synthetic.disk(radius=6.0, spacing=1.0), 2)
    for call in (lambda: nodal_domains(maps), lambda: nodal_thresholds([maps])):
        with pytest.raises(ParameterError, match=r"expected values of nodes, got Maps; give maps\.values"):
            call()
