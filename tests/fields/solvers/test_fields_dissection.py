"""Nested dissection: whatever the shape, an order and fronts that a factorisation can trust."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from spem.fields.domain import Domain, surface_domain, voxel_domain
from spem.fields.solvers.dissection import Dissection, dissect
from spem.shapes.shape import Cuts, Shape

MASKS = st.integers(1, 4).flatmap(
    lambda d: hnp.arrays(bool, hnp.array_shapes(min_dims=d, max_dims=d, max_side=24 // (d * d) + 2))
)


def dissected(shape: Shape, domain: Domain | None = None) -> tuple[Dissection, Domain]:
    """Dissection of a shape, and the domain it was made from."""
    found = voxel_domain(shape) if domain is None else domain
    return dissect(found, np.argwhere(shape.mask).astype(np.int32)), found


def rows_of(d: Dissection, f: int) -> np.ndarray:
    """Rows of one front."""
    return d.rows[d.row_start[f] : d.row_start[f + 1]]


def check(d: Dissection, domain: Domain) -> None:
    """Every node is eliminated once, and every coupling is in the rows of the front that meets it first."""
    n = domain.n_nodes
    assert np.array_equal(np.sort(d.order), np.arange(n))
    assert np.array_equal(d.order[d.rank], np.arange(n))
    assert d.start[0] == 0
    assert d.start[-1] == n
    assert np.all(np.diff(d.start) > 0)
    for f in range(d.n_fronts):
        end, rows = d.start[f + 1], rows_of(d, f)
        assert np.all(np.diff(rows) > 0)
        assert rows.size == 0 or rows[0] >= end
        near = domain.neighbours[d.order[d.start[f] : end]]
        later = d.rank[near[near < n]]
        assert np.isin(later[later >= end], rows).all()
        up = d.parent[f]
        assert (up == -1) == (rows.size == 0)
        if up >= 0:  # the update fits into the parent's front
            assert up > f
            own = np.arange(d.start[up], d.start[up + 1])
            assert np.isin(rows, np.concatenate([own, rows_of(d, up)])).all()


@settings(max_examples=40, deadline=None)
@given(mask=MASKS)
def test_fronts_cover_every_coupling(mask):
    """On random masks of one to four dimensions the fronts hold all that elimination fills in."""
    if mask.any():
        check(*dissected(Shape.from_mask(mask)))


@pytest.mark.parametrize("size", [(2000,), (70, 50), (16, 14, 12), (8, 7, 6, 5)])
def test_boxes_of_any_dimension(size):
    """Boxes of one to four dimensions, larger than a leaf, are dissected into several fronts."""
    d, domain = dissected(Shape.from_mask(np.ones(size)))
    check(d, domain)
    assert d.n_fronts > 3


def test_edges_cut_between_nodes_are_no_couplings():
    """A wall of cut edges through a square separates it at no cost."""
    shape = Shape.from_mask(np.ones((30, 30)))
    upper, lower = shape.voxels[14 * 30 : 15 * 30], shape.voxels[15 * 30 : 16 * 30]
    direction = np.repeat(np.array([1, 0], np.uint8), 30)
    cuts = Cuts(np.concatenate([upper, lower]), direction, np.full(60, 0.5))
    halves = Shape(shape.mask, shape.spacing, shape.origin, "halves", cuts)
    d, domain = dissected(halves, surface_domain(halves))
    check(d, domain)
    assert np.count_nonzero(d.parent == -1) == 2


def test_fill_grows_like_a_dissection():
    """Entries of the factor of a square grow like n log n, and its work like n^1.5."""
    small, large = (dissected(Shape.from_mask(np.ones((side, side))))[0] for side in (64, 256))
    assert large.n_entries / small.n_entries < 16 * 1.5
    assert large.flops / small.flops < 64 * 1.3


def test_a_winding_limb_is_cut_across():
    """A coiled limb costs about as much as a straight one of the same length and width."""
    mask = np.zeros((102, 99), bool)
    for turn in range(12):
        mask[1 + 8 * turn : 5 + 8 * turn, :] = True
        column = slice(-4, None) if turn % 2 == 0 else slice(0, 4)
        mask[1 + 8 * turn : 13 + 8 * turn, column] = True
    coil = dissected(Shape.from_mask(mask))[0]
    straight = dissected(Shape.from_mask(np.ones((mask.sum() // 4, 4))))[0]
    assert coil.n_entries < 1.3 * straight.n_entries


def test_peak_counts_the_factor_and_the_updates_that_wait():
    """The peak is at least the factor, and at most the factor and all updates together."""
    d, _ = dissected(Shape.from_mask(np.ones((20, 20, 20))))
    assert d.n_entries < d.peak_entries < d.n_entries + np.sum(np.diff(d.row_start) ** 2)
