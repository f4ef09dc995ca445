"""Cells on a boundary: shares of each piece, equality, connection."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.sparse.csgraph import connected_components

from spem.fields.boundary.cells import equal_cells
from spem.fields.boundary.points import point_graph
from spem.fields.boundary.sources import point_sources
from spem.fields.operator import assemble
from spem.shapes.shape import Shape
from spem.shapes.synthetic import shell


def _connected(points, cell) -> bool:
    """Whether every cell is in one piece."""
    graph = point_graph(points.system, points.points.edge_point).tocoo()
    graph.data = np.where(cell[graph.row] == cell[graph.col], graph.data, 0)
    within = graph.tocsr()
    within.eliminate_zeros()
    return connected_components(within)[0] == cell.max() + 1


def test_each_piece_has_its_share():
    """Cells are numbered piece after piece, and have within each piece nearly one area."""
    points = point_sources(assemble(shell(0.5, 1.0, 0.08, offset=0.2)))
    cell = equal_cells(points, np.array([12, 30]), np.array([0, 5]))
    assert np.array_equal(cell >= 12, points.points.contour == 1)
    area = np.bincount(cell, points.measure)
    for piece in (area[:12], area[12:]):
        assert piece.max() < 1.15 * piece.mean()
    assert _connected(points, cell)


@pytest.mark.parametrize("count", [5, 17, 60])
def test_cells_of_a_thin_plate_are_equal(count):
    """A plate of one voxel, where both sides and the rim are near in space, is divided well."""
    points = point_sources(assemble(Shape.from_mask(np.ones((1, 20, 30))), "voxel"))
    cell = equal_cells(points, np.array([count]), np.array([0]))
    area = np.bincount(cell, points.measure)
    assert area.max() < 1.2 * area.mean()
    assert _connected(points, cell)


def test_as_many_cells_as_points():
    """At the limit every point is a cell."""
    points = point_sources(assemble(Shape.from_mask(np.ones((2, 2, 2))), "voxel"))
    assert np.array_equal(np.sort(equal_cells(points, np.array([24]), np.array([3]))), np.arange(24))


@pytest.mark.parametrize(("unit", "origin"), [(10.0, (0.0, 0.0, 0.0)), (1e-3, (7.3, -1e3, 0.1))])
def test_unit_and_origin_do_not_matter(unit, origin):
    """Points that tie on the grid tie in millimetres and metres, wherever the grid lies."""
    mask = np.ones((9, 12, 7))
    mask[4:, 6:] = 0
    spacing = (0.3, 0.7, 0.4)
    there = Shape.from_mask(mask, tuple(unit * h for h in spacing), origin=origin)
    cells = [
        equal_cells(point_sources(assemble(shape)), np.array([30]), np.array([2]))
        for shape in (Shape.from_mask(mask, spacing), there)
    ]
    assert np.array_equal(*cells)
