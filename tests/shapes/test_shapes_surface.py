"""Surfaces: closedness, and the repairs that move no vertex."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh

from spem.shapes.surface import Surface, mend, merge_vertices


@pytest.fixture
def ball() -> Surface:
    """Return an icosphere of 320 faces."""
    return surface_of(trimesh.creation.icosphere(2))


def surface_of(*meshes: trimesh.Trimesh) -> Surface:
    """Return trimesh's meshes as one surface."""
    mesh = trimesh.util.concatenate(meshes)
    return Surface(np.array(mesh.vertices, np.float64), np.array(mesh.faces, np.int64))


def test_volume_and_area_are_those_of_a_box() -> None:
    """A box far from the origin has its exact volume and area."""
    surface = surface_of(trimesh.creation.box((2, 3, 4)).apply_translation([1000, 0, -7]))
    assert np.isclose(surface.volume, 24)
    assert np.isclose(surface.area, 52)
    assert surface.closed


def test_areas_of_vertices_are_thirds_of_faces() -> None:
    """The vertices of an icosahedron share its area, that of its faces together."""
    mesh = trimesh.creation.icosahedron()
    surface = Surface(np.array(mesh.vertices), np.array(mesh.faces, np.int64))
    assert surface.vertex_areas == pytest.approx(np.full(12, surface.area / 12))
    assert surface.face_areas == pytest.approx(mesh.area_faces)


def test_holes_are_counted_by_edges_and_loops(ball: Surface) -> None:
    """Two missing faces far apart are six open edges in two loops."""
    faces = np.delete(ball.faces, [0, 200], axis=0)
    surface = Surface(ball.vertices, faces)
    assert (len(surface.open_edges), surface.n_loops) == (6, 2)
    assert mend(surface).repairs == ()


def test_edge_of_four_faces_is_closed() -> None:
    """Two boxes that share an edge are closed, though not a manifold."""
    one, two = trimesh.creation.box(), trimesh.creation.box().apply_translation([1, 1, 0])
    assert merge_vertices(surface_of(one, two)).closed


def test_flipped_faces_are_turned_back(ball: Surface) -> None:
    """Faces against their neighbours are turned, the fewest that do it, and told."""
    faces = ball.faces.copy()
    faces[[3, 50, 51, 300]] = faces[[3, 50, 51, 300], ::-1]
    mended = mend(Surface(ball.vertices, faces))
    assert mended.closed
    assert np.isclose(mended.volume, ball.volume)
    assert mended.repairs == ("flipped 4 of 320 faces to agree with their neighbours",)


def test_degenerate_and_repeated_faces_are_dropped(ball: Surface) -> None:
    """A face with a repeated corner and a face that is there twice go, and it is told."""
    faces = np.concatenate([ball.faces, ball.faces[5:7], [[4, 4, 9]]])
    mended = mend(Surface(ball.vertices, faces))
    assert np.array_equal(mended.faces, ball.faces)
    assert mended.repairs == ("dropped 1 degenerate face", "dropped 2 repeated faces")


def test_double_sided_surface_becomes_single(ball: Surface) -> None:
    """A ball whose faces are all there from both sides is a ball."""
    mended = mend(Surface(ball.vertices, np.concatenate([ball.faces, ball.faces[:, ::-1]])))
    assert np.isclose(mended.volume, ball.volume)


def test_inside_out_is_turned_as_a_whole(ball: Surface) -> None:
    """A mesh of negative volume is turned, with its hollow."""
    hollow = trimesh.creation.icosphere(2, radius=0.5)
    outer = trimesh.creation.icosphere(2)
    outer.invert()
    surface = surface_of(outer, hollow)
    mended = mend(surface)
    assert np.isclose(mended.volume, 0.875 * ball.volume)
    assert mended.repairs == ("turned the surface right side out",)


def test_single_parts_are_turned_unless_they_are_hollows() -> None:
    """Of two reversed spheres the one in a larger ball is a hollow, the other is turned."""
    outer, hollow = trimesh.creation.icosphere(2), trimesh.creation.icosphere(2, radius=0.5)
    beside = trimesh.creation.icosphere(2, radius=0.5).apply_translation([3, 0, 0])
    hollow.invert()
    beside.invert()
    mended = mend(surface_of(outer, hollow, beside))
    assert np.isclose(mended.volume, outer.volume)
    assert mended.repairs == ("turned 1 of 3 parts right side out",)


def test_island_in_a_hollow_is_a_solid() -> None:
    """A reversed sphere within the hollow of a shell is turned: there is no solid around it."""
    parts = [trimesh.creation.icosphere(2, radius=radius) for radius in (1.0, 0.7, 0.3)]
    parts[1].invert()
    parts[2].invert()
    mended = mend(surface_of(*parts))
    assert np.isclose(mended.volume, parts[0].volume * (1 - 0.7**3 + 0.3**3))


@pytest.mark.parametrize("radius", [1.0, 0.9])
@pytest.mark.parametrize("order", [1, -1])
def test_an_inside_out_part_that_pokes_out_is_turned(radius, order) -> None:
    """A reversed sphere partly in another is no hollow of it, whatever the order of its faces."""
    one, two = trimesh.creation.icosphere(3), trimesh.creation.icosphere(3, radius=radius)
    two.apply_translation([0.95, 0, 0]).invert()
    surface = surface_of(one, two)
    middles = surface.vertices[surface.faces[len(one.faces) :]].mean(axis=1)[:, 0]
    moved = len(one.faces) + np.argsort(order * middles)
    faces = np.concatenate([surface.faces[: len(one.faces)], surface.faces[moved]])
    mended = mend(Surface(surface.vertices, faces))
    assert np.isclose(mended.volume, one.volume * (1 + radius**3))
    assert mended.repairs == ("turned 1 of 2 parts right side out",)


def test_a_bar_whose_ends_alone_are_within_is_turned() -> None:
    """A reversed bar from arm to arm of a U is outside of it between them."""
    arms = [trimesh.creation.box((1, 1, 4)).apply_translation([x, 0, 0]) for x in (-2, 2)]
    bar = trimesh.creation.box((4, 0.5, 0.5))
    bar.invert()
    assert mend(surface_of(*arms, bar)).repairs == ("turned 1 of 3 parts right side out",)


def test_overlapping_hollows_are_both_hollows() -> None:
    """Two reversed spheres that overlap within a ball stay as they are."""
    parts = [trimesh.creation.icosphere(2, radius=radius) for radius in (1.0, 0.3, 0.29)]
    parts[1].apply_translation([0.2, 0, 0]).invert()
    parts[2].apply_translation([-0.1, 0, 0]).invert()
    assert mend(surface_of(*parts)).repairs == ()


def test_a_pocket_flush_with_a_wall_is_a_hollow() -> None:
    """A reversed box that shares a part of a face with the box around it stays as it is."""
    outer, pocket = trimesh.creation.box((2, 2, 2)), trimesh.creation.box((1, 1, 1))
    pocket.apply_translation([0, 0, 0.5]).invert()
    assert np.isclose(mend(surface_of(outer, pocket)).volume, 7)


def test_a_part_that_is_there_twice_is_no_hollow_of_itself() -> None:
    """A sphere and the same sphere reversed are both solids."""
    one, two = trimesh.creation.icosphere(2), trimesh.creation.icosphere(2)
    two.invert()
    assert np.isclose(mend(surface_of(one, two)).volume, 2 * one.volume)


def test_surfaces_given_are_not_changed(ball: Surface) -> None:
    """Mending leaves the arrays it was given alone."""
    faces = ball.faces[:, ::-1].copy()
    before = faces.copy()
    mend(Surface(ball.vertices, faces))
    assert np.array_equal(faces, before)


def test_surfaces_print_in_one_line(ball: Surface) -> None:
    """Numbers of vertices and faces, and what was repaired, but no coordinates."""
    told = repr(ball.with_faces(ball.faces[1:], "one face left out"))
    assert told == f"Surface({len(ball.vertices)} vertices, {len(ball.faces) - 1} faces, one face left out)"
