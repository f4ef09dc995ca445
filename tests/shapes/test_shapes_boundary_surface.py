"""Boundary surfaces: the mesh where it is sound, else the grid's."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import trimesh

from spem.codes.sources import source_hash
from spem.errors import ParameterError, ShapeError
from spem.shapes.boundary_surface import boundary_surface
from spem.shapes.meshes import mesh_shape
from spem.shapes.rescale import to_voxel_budget
from spem.shapes.shape import Shape


@pytest.fixture(scope="module")
def ball() -> trimesh.Trimesh:
    """Return an icosphere of 320 faces."""
    return trimesh.creation.icosphere(2)


def test_sound_mesh_is_its_own_surface(ball: trimesh.Trimesh) -> None:
    """A closed manifold mesh comes back vertex by vertex."""
    surface = boundary_surface(mesh_shape(ball.vertices, ball.faces, voxels=500))
    assert np.array_equal(surface.vertices, ball.vertices)
    assert surface.repairs == ()


def test_small_hole_stays_open(ball: trimesh.Trimesh) -> None:
    """A mesh without one face is kept, and the hole is told."""
    surface = boundary_surface(mesh_shape(ball.vertices, ball.faces[1:], voxels=500))
    assert len(surface.faces) == 319
    assert surface.repairs == ("surface left open at 3 edges in 1 loop",)


def test_large_hole_is_remeshed(ball: trimesh.Trimesh) -> None:
    """A mesh without its cap gets a closed surface from the volume."""
    faces = ball.faces[ball.triangles_center[:, 2] < 0.6]
    surface = boundary_surface(mesh_shape(ball.vertices, faces, voxels=500))
    assert surface.closed
    assert surface.repairs[-1].startswith("remeshed from the filled volume: holes of")


def test_crowded_edge_is_remeshed() -> None:
    """A mesh with an inner wall has edges of three faces; its outer surface is taken from the volume."""
    box = trimesh.creation.box((2, 2, 2))
    wall = box.faces[0][[0, 1]].tolist()
    far = int(np.setdiff1d(np.arange(8), box.faces[0])[0])
    shape = mesh_shape(box.vertices, np.vstack([box.faces, [*wall, far]]), voxels=500)
    surface = boundary_surface(shape)
    assert surface.closed
    assert "with more than two faces" in surface.repairs[-1]


def test_only_the_kept_solid_has_a_surface(ball: trimesh.Trimesh) -> None:
    """A part that was dropped with its voxels is no part of the surface."""
    small = ball.copy().apply_scale(0.5).apply_translation([4, 0, 0])
    both = trimesh.util.concatenate([small, ball])
    surface = boundary_surface(mesh_shape(both.vertices, both.faces, voxels=1000))
    assert np.isclose(surface.area, ball.area)
    assert surface.repairs == ("left 1 of 2 parts of the surface out",)


def test_hollow_is_left_out(ball: trimesh.Trimesh) -> None:
    """A hollow ball has its outer sphere."""
    hole = ball.copy().apply_scale(0.5)
    hole.invert()
    both = trimesh.util.concatenate([ball, hole])
    surface = boundary_surface(mesh_shape(both.vertices, both.faces, voxels=1000))
    assert np.isclose(surface.area, ball.area)


def test_solids_that_touch_at_a_corner_are_two() -> None:
    """The surface is that of the cube that was kept; with both kept it is taken from the grid."""
    small = trimesh.creation.box((1, 1, 1)).apply_translation([1.5, 1.5, 1.5])
    both = trimesh.util.concatenate([trimesh.creation.box((2, 2, 2)), small])
    both.merge_vertices()
    assert len(both.vertices) == 15
    kept = boundary_surface(mesh_shape(both.vertices, both.faces, voxels=500))
    assert kept.volume == pytest.approx(8)
    assert kept.repairs == ("left 1 of 2 parts of the surface out",)
    whole = boundary_surface(mesh_shape(both.vertices, both.faces, voxels=500, components="all"))
    assert "2 parts of the mesh bound it" in whole.repairs[0]


def test_overlapping_parts_are_remeshed(ball: trimesh.Trimesh) -> None:
    """Two balls that overlap have one surface, that of their union."""
    both = trimesh.util.concatenate([ball, ball.copy().apply_translation([1, 0, 0])])
    surface = boundary_surface(mesh_shape(both.vertices, both.faces, voxels=2000))
    assert surface.closed
    assert "2 parts of the mesh bound it" in surface.repairs[-1]
    assert surface.area == pytest.approx(6 * np.pi, rel=0.05)


def test_volume_has_the_surface_of_its_grid() -> None:
    """The surface of a block on an anisotropic grid is closed and in the shape's coordinates."""
    shape = Shape.from_mask(np.ones((8, 8, 4), bool), (1.0, 1.0, 2.0), origin=(5.0, 0.0, 0.0))
    surface = boundary_surface(shape)
    assert surface.closed
    assert surface.volume == pytest.approx(512, rel=0.1)
    assert surface.vertices[:, 0].min() == pytest.approx(4.5, abs=0.1)


@pytest.mark.parametrize("ndim", [1, 2, 4])
def test_other_dimensions_are_refused(ndim: int) -> None:
    """Only solids have boundary surfaces."""
    with pytest.raises(ShapeError, match=f"shapes of 3 dimensions, this one has {ndim}"):
        boundary_surface(Shape.from_mask(np.ones((3,) * ndim)))


def test_a_path_is_no_shape() -> None:
    """It is to be read first."""
    with pytest.raises(ParameterError, match="expected Shape, got str; read it first"):
        boundary_surface("ball.off")  # type: ignore[arg-type]


def test_surface_goes_with_its_shape(ball: trimesh.Trimesh) -> None:
    """A resampled shape keeps its mesh, and shapes of other meshes are told apart."""
    shape = mesh_shape(ball.vertices, ball.faces, voxels=500)
    assert to_voxel_budget(shape, 900).surface is shape.surface
    assert source_hash(shape) != source_hash(replace(shape, surface=None))
