"""Connected components."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from spem.errors import ParameterError
from spem.shapes.components import keep_components
from spem.shapes.shape import Cuts, Shape


def test_the_largest_component_is_kept_and_reported():
    """Specks go; the report has their number and the share of the volume that stays."""
    mask = np.zeros((20, 30))
    mask[2:12, 3:13] = 1
    mask[15, 20:22] = 1
    mask[12, 13] = 1
    shape = keep_components(Shape.from_mask(mask, 0.5))
    assert shape.n_nodes == 100
    assert shape.origin == (0.5, 1.0)
    assert shape.report.components == 3
    assert shape.report.volume_kept == pytest.approx(100 / 103)
    assert shape.report.repairs == ("kept the largest of 3 components (97 % of the volume)",)


def test_all_components_are_only_counted():
    """The word all changes nothing but the count."""
    shape = Shape.from_mask([[1, 0, 1]])
    kept = keep_components(shape, "all")
    assert kept.n_nodes == 2
    assert kept.report.components == 2
    assert kept.report.repairs == ()


def test_cuts_follow_their_voxels():
    """Cuts of the component that stays are kept, at its new indices."""
    mask = np.array([0, 1, 0, 0, 1, 1, 0], bool)
    shape = Shape.from_mask(
        mask, cuts=Cuts(np.array([1, 4, 5]), np.array([1, 0, 1]), np.array([0.1, 0.2, 0.3]))
    )
    kept = keep_components(shape)
    assert kept.origin == (3.0,)
    assert kept.cuts.voxel.tolist() == [1, 2]
    assert kept.cuts.fraction.tolist() == [0.2, 0.3]


def test_an_inner_cut_parts_two_voxels():
    """Where two surfaces pass between inside neighbours, these are not connected by their edge."""
    mask = np.ones((1, 5), bool)
    cut = Cuts(np.array([1, 2]), np.array([3, 2]), np.array([0.4, 0.4]))
    kept = keep_components(Shape.from_mask(mask, cuts=cut))
    assert kept.n_nodes == 3
    assert kept.report.components == 2
    assert kept.cuts.fraction.tolist() == [0.4]
    wide = keep_components(Shape.from_mask(np.ones((2, 5), bool), cuts=cut))
    assert wide.report.components == 1


@settings(max_examples=60, deadline=None)
@given(hnp.arrays(bool, hnp.array_shapes(min_dims=2, max_dims=3, max_side=5)), st.integers(0, 2**32 - 1))
def test_components_agree_with_the_whole_graph(mask, seed):
    """Any set of inner cuts gives the count that the graph of all nodes gives."""
    if not mask.any():
        return
    shape = Shape.from_mask(mask)
    rng = np.random.default_rng(seed)
    grid = np.arange(shape.mask.size).reshape(shape.mask.shape)
    voxel, direction, pairs = [], [], []
    for axis in range(shape.ndim):
        low = grid.take(range(grid.shape[axis] - 1), axis=axis).ravel()
        high = grid.take(range(1, grid.shape[axis]), axis=axis).ravel()
        both = shape.mask.ravel()[low] & shape.mask.ravel()[high]
        cut = rng.random(low.size) < 0.4
        voxel += [*low[both & cut], *high[both & cut]]
        direction += [2 * axis + 1] * np.count_nonzero(both & cut) + [2 * axis] * np.count_nonzero(both & cut)
        pairs += zip(low[both & ~cut], high[both & ~cut], strict=True)
    cuts = Cuts(np.array(voxel, int), np.array(direction, int), np.full(len(voxel), 0.5))
    shape = Shape(shape.mask, shape.spacing, shape.origin, cuts=cuts)
    ends = np.array(pairs, int).reshape(-1, 2).T
    graph = coo_array((np.ones(len(pairs)), tuple(ends)), shape=(grid.size,) * 2)
    _, label = connected_components(graph, directed=False)
    sizes = np.bincount(label[shape.voxels])
    kept = keep_components(shape)
    assert kept.report.components == np.count_nonzero(sizes)
    assert kept.n_nodes == sizes.max()


def test_other_words_are_refused():
    """Only two words are known."""
    with pytest.raises(ParameterError, match="components='some': expected 'largest' or 'all'"):
        keep_components(Shape.from_mask([1]), "some")
