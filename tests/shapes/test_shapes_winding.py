"""Filling of surfaces with holes by their generalised winding number."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh

from spem.shapes import winding
from spem.shapes.surface import Surface
from spem.shapes.voxelize import lattice_around, voxelize
from spem.shapes.winding import fill_by_winding


@pytest.fixture(scope="module")
def ball() -> Surface:
    """Return an icosphere of 1280 faces."""
    mesh = trimesh.creation.icosphere(3)
    return Surface(np.array(mesh.vertices, np.float64), np.array(mesh.faces, np.int64))


@pytest.mark.parametrize("nearly_closed", [0.01, -1.0])
def test_closed_surface_is_filled_as_by_scanlines(
    ball: Surface, nearly_closed: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    """On a closed surface mask and cuts are those of the scanline fill."""
    monkeypatch.setattr(winding, "NEARLY_CLOSED", nearly_closed)
    lattice = lattice_around(ball.vertices, (0.1, 0.12, 0.09))
    exact = voxelize(ball.vertices, ball.faces, lattice)
    filling = fill_by_winding(ball, lattice)
    assert np.array_equal(filling.mask, exact.mask)
    assert np.array_equal(filling.cuts.voxel, exact.cuts.voxel)
    assert np.allclose(filling.cuts.fraction, exact.cuts.fraction)


def test_agreeing_lines_settle_what_the_winding_number_says(
    ball: Surface, monkeypatch: pytest.MonkeyPatch
) -> None:
    """With few open edges, asking only where lines disagree gives the fill of asking everywhere."""
    holed = Surface(ball.vertices, np.delete(ball.faces, [10, 11, 500, 900], axis=0))
    lattice = lattice_around(holed.vertices, (0.08, 0.08, 0.08))
    quick = fill_by_winding(holed, lattice)
    monkeypatch.setattr(winding, "NEARLY_CLOSED", -1.0)
    full = fill_by_winding(holed, lattice)
    assert np.array_equal(quick.mask, full.mask)
    assert np.array_equal(quick.cuts.voxel, full.cuts.voxel)


def test_every_boundary_edge_of_an_open_surface_is_cut(ball: Surface) -> None:
    """A ball without its cap is closed by the winding number, and each edge out of it has a cut."""
    cap = ball.vertices[ball.faces].mean(axis=1)[:, 2] > 0.8
    lattice = lattice_around(ball.vertices, (0.1, 0.1, 0.1))
    filling = fill_by_winding(Surface(ball.vertices, ball.faces[~cap]), lattice)
    boundary = sum(np.count_nonzero(np.diff(filling.mask.astype(np.int8), axis=axis)) for axis in range(3))
    assert len(filling.cuts) == boundary
    height = lattice.positions(np.flatnonzero(filling.mask))[:, 2]
    assert 0.7 < height.max() < 0.95
    across = filling.cuts.direction == 5
    top = lattice.positions(filling.cuts.voxel[across])[:, 2] + 0.1 * filling.cuts.fraction[across]
    middle = np.linalg.norm(lattice.positions(filling.cuts.voxel[across])[:, :2], axis=1) < 0.3
    assert np.ptp(top[middle]) < 0.1


def test_sheets_over_each_other_leave_the_outermost_layer_outside() -> None:
    """Parallel open sheets add up to more than one half at the rim of the grid, which stays outside."""
    square = np.array([[0.0, 0, 0], [4, 0, 0], [4, 4, 0], [0, 4, 0]])
    vertices = np.concatenate([square + np.array([0, 0, 0.1 * k]) for k in range(6)])
    faces = np.concatenate([np.array([[0, 2, 1], [0, 3, 2]]) + 4 * k for k in range(6)])
    filling = fill_by_winding(Surface(vertices, faces), lattice_around(vertices, (0.5, 0.5, 0.5)))
    inner = filling.mask[1:-1, 1:-1, 1:-1]
    assert inner.sum() == filling.mask.sum()
