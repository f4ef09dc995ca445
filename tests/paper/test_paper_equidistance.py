"""Spread of a field at one depth."""

from __future__ import annotations

import numpy as np

from spem.fields.boundary_distance import distance_to_boundary
from spem.paper.data import Data
from spem.paper.equidistance import BAND, distinct_nodes, spread_along_curve, spread_ratios
from spem.paper.limbs import fingers
from spem.paper.silhouettes import chosen
from spem.shapes.synthetic import disk


def test_a_field_of_the_depth_alone_has_ratio_one():
    """Its spread is what the band's width explains, or less where this is taken for wider than it is."""
    shape = disk(20.0, 1.0)
    fields = (3 * distance_to_boundary(shape))[:, None]
    found = spread_ratios(shape, fields, 6.0)
    assert 0.5 < found["sub-voxel"][0] < 1.0001
    assert spread_along_curve(shape, fields, 6.0)[0] < 1e-12


def test_a_field_of_something_else_has_a_large_ratio():
    """Here of the angle."""
    shape = disk(20.0, 1.0)
    other = np.arctan2(*shape.points.T)
    fields = (0.01 * distance_to_boundary(shape) + other)[:, None]
    assert spread_ratios(shape, fields, 6.0)["sub-voxel"][0] > 50
    assert spread_along_curve(shape, fields, 6.0)[0] > BAND


def test_distinct_nodes_lie_where_they_should():
    """The first is the deepest of all; the last two are equally deep, one in a finger and one in the palm."""
    (hand,) = chosen(Data(), "hand").shapes
    nodes, depth = distinct_nodes(hand), distance_to_boundary(hand)
    core = fingers(hand).core
    assert np.unique(nodes).size == 5
    assert depth[nodes[0]] == depth[core].max()
    assert abs(depth[nodes[3]] - depth[nodes[4]]) < 0.1
    assert core[nodes].tolist() == [True, True, True, False, True]
