"""Correlations between nodes, between boundary sources, and between both."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import spem
from spem.decomposition import interactions
from spem.decomposition.interactions import (
    boundary_interactions,
    node_correlation,
    source_correlation,
    source_node_correlation,
)
from spem.decomposition.measurements import centred_logs
from spem.errors import ParameterError
from spem.fields.boundary.sources import point_sources
from spem.fields.operator import assemble
from spem.fields.superposition.fields import SourceFields, solve_sources
from spem.shapes.shape import Shape


def _fields(mask, rho=np.inf, boundary="surface", spacing=1.0) -> SourceFields:
    """Solve for every boundary point of a mask."""
    return solve_sources(point_sources(assemble(Shape.from_mask(mask, spacing), boundary)), rho)


def _two_squares() -> SourceFields:
    """Fields on two squares of four and six columns, apart."""
    mask = np.zeros((4, 13))
    mask[:, :4] = mask[:, 7:] = 1
    return _fields(mask)


def test_correlations_are_those_of_numpy():
    """In one component each correlation is Pearson's, of log vectors over sources, of (4.1) over nodes."""
    fields = _fields(np.ones((4, 7)), rho=3.0)
    m, n = fields.log.shape
    centred = centred_logs(fields)
    assert node_correlation(fields, range(n)) == pytest.approx(np.corrcoef(fields.log.T), abs=1e-12)
    assert node_correlation(fields, range(n)) == pytest.approx(np.corrcoef(centred.T), abs=1e-12)
    assert source_correlation(fields, range(m)) == pytest.approx(np.corrcoef(centred), abs=1e-12)
    both = np.corrcoef(boundary_interactions(fields), fields.log.T)[:m, m:]
    assert source_node_correlation(fields, range(m)) == pytest.approx(both, abs=1e-12)


@settings(max_examples=25, deadline=None)
@given(st.integers(0, 2**32 - 1), st.sampled_from(["surface", "voxel"]))
def test_correlations_are_symmetric_and_bounded(seed, boundary):
    """On any shape, in pieces or not, no correlation is NaN or beyond one, and order does not matter."""
    rng = np.random.default_rng(seed)
    mask = rng.random((5, 6)) < 0.6
    mask.flat[0] = True
    fields = _fields(mask, float(rng.choice([1.0, np.inf])), boundary, tuple(rng.uniform(0.5, 2, 2)))
    for correlate, count in zip((source_correlation, node_correlation), fields.log.shape, strict=True):
        found = correlate(fields, range(count))
        assert (np.abs(found) <= 1).all()
        assert found == pytest.approx(found.T, abs=1e-9)
        own = np.diag(found)
        assert own[own != 0] == pytest.approx(1)
    mixed = source_node_correlation(fields, range(fields.log.shape[0]))
    assert (np.abs(mixed) <= 1).all()


def test_components_do_not_correlate():
    """Nodes and sources of different components have correlation 0, those of one what it alone would give."""
    fields = _two_squares()
    component = fields.sources.system.domain.component
    apart = component[:, None] != component
    found = node_correlation(fields, range(component.size))
    assert (found[apart] == 0).all()
    small = np.flatnonzero(component == 1)
    reached = np.isfinite(fields.log[:, small]).all(axis=1)
    alone = np.corrcoef(fields.log[np.ix_(reached, small)].T)
    assert found[np.ix_(small, small)] == pytest.approx(alone, abs=1e-12)
    touched = component[np.isfinite(fields.log).argmax(axis=1)]
    sources = source_correlation(fields, range(touched.size))
    assert (sources[touched[:, None] != touched] == 0).all()
    assert (np.abs(sources[touched[:, None] == touched]) > 1e-6).all()
    mixed = source_node_correlation(fields, range(touched.size))
    assert (mixed[touched[:, None] != component] == 0).all()


def test_sources_that_reach_one_node_are_left_out():
    """Correlations are taken over the entries that both vectors have."""
    fields = _fields(np.ones((3, 5)))
    log = fields.log.copy()
    log[[1, 4], 2] = -np.inf
    holed = SourceFields(fields.sources, np.inf, log)
    kept = np.delete(fields.log, [1, 4], axis=0)
    expected = np.corrcoef(kept[:, 2], kept[:, 9])[0, 1]
    assert float(node_correlation(holed, 2, 9)) == pytest.approx(expected)


def test_constant_vectors_correlate_with_nothing():
    """A vector without variation, or of fewer than three entries, has correlation 0."""
    fields = _fields(np.ones((1, 3)), boundary="voxel")
    flat = SourceFields(fields.sources, np.inf, np.full(fields.log.shape, -np.pi))
    assert (node_correlation(flat, range(3)) == 0).all()
    holed = flat.log.copy()
    holed[0, 0] = -np.inf
    assert (node_correlation(SourceFields(fields.sources, np.inf, holed), range(3)) == 0).all()
    assert (node_correlation(_fields([1, 1, 1, 1]), range(4)) == 0).all()


@pytest.mark.parametrize("boundary", ["surface", "voxel"])
def test_boundary_interactions_are_symmetric(boundary):
    """What flows through one source of another's field is what flows back, in logs, in pieces or not."""
    mask = np.ones((4, 9))
    mask[1:3, 3] = 0
    mask[:, 7] = 0
    log = boundary_interactions(_fields(mask, 2.0, boundary, (1.0, 0.7)))
    assert np.isneginf(log).any()
    assert np.exp(log) == pytest.approx(np.exp(log).T, rel=1e-10)


def test_sources_are_limits_of_nodes():
    """The vector of a source that touches one node is that of the node, up to a constant."""
    fields = _fields(np.ones((5, 5)), 4.0)
    source = int(np.argmin(np.linalg.norm(fields.sources.position - [-0.5, 2], axis=1)))
    assert float(source_node_correlation(fields, source, 2)) == pytest.approx(1)
    assert source_node_correlation(fields, source).argmax() == 2


def test_shapes_follow_the_arguments():
    """One number gives a map, two arrays every pair, in their shapes."""
    fields = _fields(np.ones((3, 5)))
    m, n = fields.log.shape
    assert node_correlation(fields, 3).shape == (n,)
    assert node_correlation(fields, [3], [[1, 2], [4, 5]]).shape == (1, 2, 2)
    assert node_correlation(fields, [], [1, 2]).shape == (0, 2)
    assert node_correlation(fields, 3, 4).shape == ()
    assert source_correlation(fields, [0, 1]).shape == (2, m)
    assert source_node_correlation(fields, 0).shape == (n,)


def test_blocks_do_not_change_the_result(monkeypatch):
    """However small the blocks are, the numbers are the same."""
    fields = _two_squares()
    whole = node_correlation(fields, range(40)), source_correlation(fields, range(36))
    monkeypatch.setattr(interactions, "_BLOCK", 200)
    assert node_correlation(fields, range(40)) == pytest.approx(whole[0], abs=1e-12)
    assert source_correlation(fields, range(36)) == pytest.approx(whole[1], abs=1e-12)


def test_unknown_numbers_are_refused():
    """Nodes and sources that do not exist, and fractions, have their line."""
    fields = _fields(np.ones((3, 5)))
    with pytest.raises(ParameterError, match="node 15, expected a whole number from 0 to 14"):
        node_correlation(fields, 0, [2, 15])
    with pytest.raises(ParameterError, match="node -1"):
        source_node_correlation(fields, 0, -1)
    with pytest.raises(ParameterError, match=r"source 0\.5"):
        source_correlation(fields, 0.5)
    with pytest.raises(ParameterError, match="source 16"):
        boundary_interactions(fields, [16])


@pytest.mark.data
def test_fingers_of_a_hand_tell_themselves_apart(data_dir):
    """On a real hand a fingertip correlates with its own finger and not with the far end of the hand."""
    shape = spem.read(data_dir / "tari1000" / "obj11_3.png", inner_radius=10)
    fields = solve_sources(point_sources(assemble(shape, "voxel")), np.inf)
    tip = int(np.argmin(shape.points[:, 0]))
    away = np.linalg.norm(shape.points - shape.points[tip], axis=1) / shape.size
    found = node_correlation(fields, tip)
    assert found[away < 0.1].min() > 0.8
    assert found[away > 1.0].max() < 0.2
    near = fields.sources.nearest(shape.points[tip])[0]
    assert source_node_correlation(fields, near, tip)[0] > 0.95
