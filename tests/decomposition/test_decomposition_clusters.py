"""Clusters of nodes and of boundary sources by their interactions."""

from __future__ import annotations

import tracemalloc

import numpy as np
import pytest
from sklearn.metrics import adjusted_rand_score

import spem
from spem.decomposition.clusters import METHODS, cluster_interactions
from spem.decomposition.measurements import centred_logs
from spem.errors import ParameterError
from spem.fields.boundary.patches import patch_sources
from spem.fields.boundary.sources import point_sources
from spem.fields.operator import assemble
from spem.fields.superposition.fields import SourceFields, solve_sources
from spem.shapes.shape import Shape


def _fields(mask, boundary="voxel") -> SourceFields:
    """Solve the Laplace equation for every boundary point of a mask."""
    return solve_sources(point_sources(assemble(Shape.from_mask(mask, name="blob"), boundary)), np.inf)


def _star() -> np.ndarray:
    """Make four arms of five by sixteen pixels around a square."""
    mask = np.zeros((37, 37))
    mask[16:21] = mask[:, 16:21] = 1
    return mask


@pytest.mark.parametrize("method", METHODS)
def test_arms_of_a_star_are_clusters(method):
    """Four clusters of a star are its arms, each with a quarter of the nodes."""
    fields = _fields(_star())
    clusters = cluster_interactions(fields, 4, method=method)
    points = fields.sources.system.shape.points - 18
    arm = 2 * (np.abs(points[:, 0]) > np.abs(points[:, 1])) + (points.sum(axis=1) > 0)
    outer = np.abs(points).max(axis=1) > 5
    assert clusters.converged
    assert adjusted_rand_score(arm[outer], clusters.labels[outer]) > 0.95
    assert clusters.sizes.min() > 70


@pytest.mark.parametrize("method", METHODS)
def test_components_are_never_mixed(method):
    """With as many clusters as components, each is one of them, the larger first."""
    mask = np.zeros((4, 13))
    mask[:, :4] = mask[:, 7:] = 1
    fields = _fields(mask, "surface")
    clusters = cluster_interactions(fields, 2, method=method)
    assert clusters.labels.tolist() == fields.sources.system.domain.component.tolist()
    assert not np.isnan(clusters.centres).any()
    assert np.isneginf(clusters.centres[0]).sum() == 16
    edges = cluster_interactions(fields, 2, method=method, over="boundary")
    assert edges.sizes.tolist() == [20, 16]


def test_order_and_seed_do_not_matter_to_the_numbers():
    """Clusters come by falling size, the same ones for the same seed, and centres are means."""
    fields = _fields(np.ones((4, 30)))
    first, again = (cluster_interactions(fields, 5, rng=np.random.default_rng(3)) for _ in range(2))
    assert first.labels.tolist() == again.labels.tolist()
    assert (np.diff(first.sizes) <= 0).all()
    assert first.sizes.sum() == 120
    centred = centred_logs(fields)
    for k in range(first.n_clusters):
        assert first.centres[k] == pytest.approx(centred[:, first.labels == k].mean(axis=1))


def test_clusters_of_few_sources_take_no_square_of_the_nodes():
    """Over the boundary of a shape of many nodes, memory is that of the fields."""
    system = assemble(Shape.from_mask(np.ones((60, 60)), name="blob"))
    fields = solve_sources(patch_sources(system, 12), np.inf)
    tracemalloc.start()
    clusters = cluster_interactions(fields, 3, over="boundary")
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert clusters.sizes.sum() == 12
    assert peak < 30 * fields.log.nbytes < 8 * 3600**2


def test_fewer_distinct_vectors_give_fewer_clusters():
    """Equal vectors stay together: no cluster comes back empty."""
    fields = _fields(np.ones((1, 4)))
    flat = SourceFields(fields.sources, np.inf, np.repeat(fields.log[:, :2], 2, axis=1))
    clusters = cluster_interactions(flat, 3)
    assert clusters.sizes.tolist() == [2, 2]
    assert clusters.n_clusters == 2


def test_one_node_is_one_cluster():
    """A shape of one node has one cluster by either method."""
    for method in METHODS:
        assert cluster_interactions(_fields([[1]]), 1, method=method, over="boundary").sizes.sum() == 4


@pytest.mark.parametrize("method", METHODS)
def test_one_vector_is_one_cluster(method):
    """A shape of one node has one cluster, whatever the method."""
    assert cluster_interactions(_fields(np.ones((1, 1))), 1, method=method).labels.tolist() == [0]


def test_bad_arguments_are_refused():
    """Too many clusters, none, no dimension and unknown words have their line."""
    fields = _fields(np.ones((2, 3)))
    with pytest.raises(ParameterError, match=r"blob: n_clusters=7: expected a whole number, 1 .* at most 6"):
        cluster_interactions(fields, 7)
    with pytest.raises(ParameterError, match="n_clusters=0"):
        cluster_interactions(fields, 0)
    with pytest.raises(ParameterError, match=r"n_clusters=2\.5: expected a whole number"):
        cluster_interactions(fields, 2.5)
    with pytest.raises(ParameterError, match="n_dimensions=0: expected a whole number, 1 or more"):
        cluster_interactions(fields, 2, n_dimensions=0)
    with pytest.raises(ParameterError, match="method='ward': expected 'kmeans' or 'mixture'"):
        cluster_interactions(fields, 2, method="ward")
    with pytest.raises(ParameterError, match="over='volume': expected 'region' or 'boundary'"):
        cluster_interactions(fields, 2, over="volume")


@pytest.mark.data
def test_clusters_of_a_hand_are_connected(data_dir):
    """On a real hand each of six clusters is a connected region, but for a few nodes."""
    shape = spem.read(data_dir / "tari1000" / "obj11_3.png", inner_radius=10)
    clusters = cluster_interactions(_fields(shape.mask), 6)
    for k in range(6):
        piece = Shape.from_mask(shape.to_grid(clusters.labels, fill=-1) == k)
        assert np.mean(assemble(piece).domain.component == 0) > 0.95
