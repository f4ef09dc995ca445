"""Scanline filling: exact masks and exact cuts of closed surfaces."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from spem.shapes.crossings import cross_lines
from spem.shapes.shape import MIN_FRACTION
from spem.shapes.surface import Surface, merge_vertices
from spem.shapes.voxelize import Filling, Lattice, lattice_around, voxelize


def surface_of(*meshes: trimesh.Trimesh) -> Surface:
    """Return trimesh's meshes as one surface."""
    mesh = trimesh.util.concatenate(meshes)
    return Surface(np.array(mesh.vertices, np.float64), np.array(mesh.faces, np.int64))


def fill(surface: Surface, spacing: float) -> tuple[Filling, Lattice]:
    """Fill a surface on the lattice centred on it."""
    lattice = lattice_around(surface.vertices, (spacing,) * 3)
    return voxelize(surface.vertices, surface.faces, lattice), lattice


def cut_points(filling: Filling, lattice: Lattice) -> np.ndarray:
    """Return where the cuts lie in space."""
    points = lattice.positions(filling.cuts.voxel)
    axis, up = filling.cuts.direction // 2, filling.cuts.direction % 2
    step = np.where(up, 1, -1) * filling.cuts.fraction * np.array(lattice.spacing)[axis]
    points[np.arange(len(axis)), axis] += step
    return points


def line_volumes(filling: Filling, lattice: Lattice) -> np.ndarray:
    """Return the volume between the cuts as summed along the lines of each axis."""
    nodes = np.count_nonzero(filling.mask)
    ends = [(filling.cuts.fraction[filling.cuts.direction // 2 == axis] - 0.5).sum() for axis in range(3)]
    return (nodes + np.array(ends)) * np.prod(lattice.spacing)


def n_boundary_edges(mask: np.ndarray) -> int:
    """Return the number of edges from inside to outside."""
    return sum(np.count_nonzero(np.diff(mask.astype(np.int8), axis=axis)) for axis in range(3))


def box(low: tuple[float, float, float], high: tuple[float, float, float]) -> trimesh.Trimesh:
    """Return an aligned box."""
    return trimesh.creation.box(bounds=[low, high])


def test_ball_has_its_volume_and_every_boundary_edge_its_cut() -> None:
    """The fill of an icosphere holds the mesh's volume between cuts, which lie on its facets."""
    surface = surface_of(trimesh.creation.icosphere(4))
    filling, lattice = fill(surface, 0.07)
    assert len(filling.cuts) == n_boundary_edges(filling.mask)
    assert np.allclose(line_volumes(filling, lattice), surface.volume, rtol=2e-3)
    radius = np.linalg.norm(cut_points(filling, lattice), axis=1)
    facet = np.cos(np.arcsin(np.linalg.norm(np.diff(surface.triangles[:, :2], axis=1), axis=2).max()))
    assert radius.max() <= 1 + 1e-12
    assert radius.min() >= facet


def test_cuts_of_a_ball_approach_the_sphere_with_the_square_of_the_facets() -> None:
    """Halving the facets quarters the distance from the cuts to the sphere."""
    miss = []
    for subdivisions in (2, 3, 4):
        filling, lattice = fill(surface_of(trimesh.creation.icosphere(subdivisions)), 0.1)
        miss.append(np.mean(1 - np.linalg.norm(cut_points(filling, lattice), axis=1)))
    assert np.all(np.log2(np.array(miss[:-1]) / miss[1:]) > 1.9)


@given(st.tuples(*[st.integers(-16, 16)] * 3))
@settings(max_examples=25, deadline=None)
def test_cube_is_exact_wherever_its_faces_meet_the_lattice(eighths: tuple[int, int, int]) -> None:
    """A cube of whole spacings holds its volume in nodes, also with faces and edges through nodes."""
    offset = np.array(eighths) / 8
    surface = surface_of(box((0, 0, 0), (4, 5, 6)))
    lattice = Lattice((-3.0, -3.0, -3.0), (1.0, 1.0, 1.0), (12, 13, 14))
    filling = voxelize(surface.vertices + offset, surface.faces, lattice)
    assert np.count_nonzero(filling.mask) == 4 * 5 * 6
    assert len(filling.cuts) == n_boundary_edges(filling.mask)
    assert np.allclose(line_volumes(filling, lattice), 120, rtol=2 * MIN_FRACTION)
    start = np.ceil(offset + 3).astype(int)
    assert filling.mask[tuple(slice(i, i + n) for i, n in zip(start, (4, 5, 6), strict=True))].all()


def test_faces_through_nodes_are_cut_there() -> None:
    """On an octahedron whose slanted faces pass through nodes all axes agree, and cuts lie on its faces."""
    mesh = trimesh.creation.icosahedron()
    corners = 6.0 * np.array([[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]])
    mesh = trimesh.Trimesh(corners, mesh.faces[:0], process=False).convex_hull
    surface = surface_of(mesh)
    lattice = Lattice((-7.0,) * 3, (1.0,) * 3, (15, 15, 15))
    filling = voxelize(surface.vertices, surface.faces, lattice)
    boundary = n_boundary_edges(filling.mask)
    assert len(filling.cuts) >= boundary
    assert np.allclose(np.abs(cut_points(filling, lattice)).sum(axis=1), 6, atol=3 * MIN_FRACTION)
    index = np.abs(lattice.positions(np.arange(15**3))).sum(axis=1).reshape(15, 15, 15)
    assert filling.mask[index < 6].all()
    assert not filling.mask[index > 6].any()


@given(st.integers(0, 2**32 - 1))
@settings(max_examples=15, deadline=None)
def test_turned_boxes_are_exact(seed: int) -> None:
    """A box in any orientation is filled where its inequalities hold and cut on its faces."""
    rng = np.random.default_rng(seed)
    turn = Rotation.random(rng=rng).as_matrix()
    half = rng.uniform(1.5, 4, 3)
    surface = surface_of(box(tuple(-half), tuple(half)))
    filling, lattice = fill(Surface(surface.vertices @ turn.T + rng.uniform(-9, 9, 3), surface.faces), 0.7)
    middle = np.array(lattice.origin) + (np.array(lattice.shape) - 1) / 2 * np.array(lattice.spacing)
    own = np.abs((lattice.positions(np.arange(filling.mask.size)) - middle) @ turn) - half
    assert np.array_equal(filling.mask.ravel(), own.max(axis=1) < 0)
    assert len(filling.cuts) == n_boundary_edges(filling.mask)
    assert np.allclose(
        (np.abs((cut_points(filling, lattice) - middle) @ turn) - half).max(axis=1), 0, atol=1e-9
    )


def test_torus_has_its_volume() -> None:
    """The volume between the cuts of a torus is the mesh's."""
    surface = surface_of(trimesh.creation.torus(1.0, 0.35))
    filling, lattice = fill(surface, 0.05)
    assert np.allclose(line_volumes(filling, lattice), surface.volume, rtol=1e-2)
    assert np.isclose(line_volumes(filling, lattice)[2], surface.volume, rtol=5e-4)


def test_overlapping_balls_are_their_union() -> None:
    """Two balls at distance r have the volume of 27/16 of a ball, and no cut lies within either."""
    ball = trimesh.creation.icosphere(4)
    filling, lattice = fill(surface_of(ball, ball.copy().apply_translation([1, 0, 0])), 0.05)
    assert np.allclose(line_volumes(filling, lattice), 27 / 16 * ball.volume, rtol=3e-3)
    assert len(filling.cuts) >= n_boundary_edges(filling.mask)
    points = cut_points(filling, lattice)
    depth = np.minimum(np.linalg.norm(points, axis=1), np.linalg.norm(points - [1, 0, 0], axis=1))
    assert depth.min() > 0.995


def test_shell_turned_inward_is_a_hollow_and_outward_nothing() -> None:
    """An inner sphere that faces inward is hollow, one that faces outward is part of the solid."""
    outer, inner = trimesh.creation.icosphere(3), trimesh.creation.icosphere(3, radius=0.5)
    solid, lattice = fill(surface_of(outer, inner), 0.08)
    inner.invert()
    surface = surface_of(outer, inner)
    hollow, _ = fill(surface, 0.08)
    assert np.allclose(line_volumes(hollow, lattice), surface.volume, rtol=5e-3)
    assert np.allclose(line_volumes(solid, lattice), outer.volume, rtol=5e-3)
    assert not hollow.mask[tuple(n // 2 for n in lattice.shape)]


def test_plates_nearer_than_a_voxel_are_cut_apart() -> None:
    """Edges between the inside nodes of two plates are cut from both sides, at the plates."""
    surface = surface_of(box((0, 0, 0), (6, 6, 2.8)), box((0, 0, 3.1), (6, 6, 6)))
    filling, lattice = fill(surface, 1.0)
    assert np.count_nonzero(filling.mask) == 216
    assert len(filling.cuts) == n_boundary_edges(filling.mask) + 2 * 36
    layer = np.unravel_index(filling.cuts.voxel, lattice.shape)[2]
    up = filling.cuts.fraction[(filling.cuts.direction == 5) & (layer == 3)]
    down = filling.cuts.fraction[(filling.cuts.direction == 4) & (layer == 4)]
    assert up.size == down.size == 36
    assert np.allclose(up, 0.3)
    assert np.allclose(down, 0.4)


def test_touching_parts_leave_no_gap() -> None:
    """Two boxes that share a face are one solid without a cut between them."""
    filling, _ = fill(surface_of(box((0, 0, 0), (4, 4, 2.3)), box((0, 0, 2.3), (4, 4, 4))), 1.0)
    assert np.count_nonzero(filling.mask) == 64
    assert len(filling.cuts) == n_boundary_edges(filling.mask)


@given(st.integers(0, 2**32 - 1), st.sampled_from([0.0, 0.25, 0.5]))
@settings(max_examples=20, deadline=None)
def test_surface_of_voxels_is_filled_with_those_voxels(seed: int, shift: float) -> None:
    """Voxels whose faces, edges and corners touch in every way are found again, corner on node or not."""
    wanted = np.zeros((8, 8, 8), bool)
    wanted[1:-1, 1:-1, 1:-1] = np.random.default_rng(seed).random((6, 6, 6)) < 0.5
    surface = merge_vertices(voxel_surface(wanted))
    assert surface.closed
    # voxel i spans i - 1/2 to i + 1/2; a shift of one half puts its lower corner on node i
    filling = voxelize(surface.vertices + shift, surface.faces, Lattice((0.0,) * 3, (1.0,) * 3, (8, 8, 8)))
    assert np.array_equal(filling.mask, wanted)
    assert len(filling.cuts) == n_boundary_edges(wanted)
    up = filling.cuts.direction % 2 == 1
    assert np.allclose(filling.cuts.fraction[up], 0.5 + shift)
    assert np.allclose(filling.cuts.fraction[~up], max(0.5 - shift, MIN_FRACTION))


def voxel_surface(mask: np.ndarray) -> Surface:
    """Return the faces between inside and outside voxels, two triangles each, without shared corners."""
    corners = []
    for axis in range(3):
        square = np.array([[0, 0], [1, 0], [1, 1], [0, 1]]) - 0.5
        quad = np.insert(square, 0, 0.5, axis=1)[:, np.argsort([axis, (axis + 1) % 3, (axis + 2) % 3])]
        change = np.diff(mask.astype(np.int8), axis=axis)
        corners += [np.argwhere(change < 0)[:, None] + quad, np.argwhere(change > 0)[:, None] + quad[::-1]]
    vertices = np.concatenate(corners)
    faces = np.arange(4 * len(vertices)).reshape(-1, 4)[:, [[0, 1, 2], [0, 2, 3]]].reshape(-1, 3)
    return Surface(vertices.reshape(-1, 3), faces)


@given(st.integers(0, 2**32 - 1), st.tuples(*[st.integers(-5, 5)] * 3))
@settings(max_examples=10, deadline=None)
def test_whole_spacings_of_translation_change_nothing(seed: int, steps: tuple[int, int, int]) -> None:
    """A mesh moved with its lattice by whole spacings has the same mask and cuts."""
    surface = bumpy(seed)
    spacing = (0.11, 0.13, 0.17)
    lattice = lattice_around(surface.vertices, spacing)
    shift = np.array(steps) * np.array(spacing)
    still = voxelize(surface.vertices, surface.faces, lattice)
    moved_lattice = lattice_around(surface.vertices + shift, spacing)
    moved = voxelize(surface.vertices + shift, surface.faces, moved_lattice)
    assert np.allclose(moved_lattice.origin, lattice.origin + shift)
    assert np.array_equal(still.mask, moved.mask)
    assert np.array_equal(still.cuts.voxel, moved.cuts.voxel)
    assert np.allclose(still.cuts.fraction, moved.cuts.fraction, atol=1e-9)


@given(st.integers(0, 2**32 - 1))
@settings(max_examples=10, deadline=None)
def test_quarter_turns_turn_the_fill(seed: int) -> None:
    """A mesh turned by 90 degrees about z has the turned mask and the turned cuts."""
    surface = bumpy(seed)
    still, _ = fill(surface, 0.13)
    turned_vertices = surface.vertices @ np.array([[0.0, -1, 0], [1, 0, 0], [0, 0, 1]]).T
    turned, _ = fill(Surface(turned_vertices, surface.faces), 0.13)
    assert np.array_equal(np.rot90(still.mask), turned.mask)
    number = np.arange(still.mask.size).reshape(still.mask.shape)
    place = np.empty(number.size, np.int64)
    place[np.rot90(number).ravel()] = np.arange(number.size)
    # +x becomes +y, +y becomes -x
    direction = np.array([2, 3, 1, 0, 4, 5], np.uint8)[still.cuts.direction]
    order = np.lexsort((direction, place[still.cuts.voxel]))
    assert np.array_equal(place[still.cuts.voxel][order], turned.cuts.voxel)
    assert np.array_equal(direction[order], turned.cuts.direction)
    assert np.allclose(still.cuts.fraction[order], turned.cuts.fraction, atol=1e-9)


def bumpy(seed: int) -> Surface:
    """Return a closed star-shaped surface with random bumps."""
    rng = np.random.default_rng(seed)
    ball = trimesh.creation.icosphere(2)
    radius = 1 + 0.3 * np.sin(ball.vertices @ rng.normal(size=(3, 3)) * 2).sum(axis=1) / 3
    return Surface(np.array(ball.vertices) * radius[:, None], np.array(ball.faces, np.int64))


@given(st.integers(0, 2**32 - 1))
@settings(max_examples=10, deadline=None)
def test_crossings_of_every_line_sum_to_zero(seed: int) -> None:
    """No line misses or doubles a crossing, though vertices, edges and slivers lie on lines."""
    rng = np.random.default_rng(seed)
    ball = trimesh.creation.icosphere(2)
    points = np.round(np.array(ball.vertices) * rng.uniform(2, 5) + 7, rng.integers(0, 3))
    for axis in range(3):
        lines = cross_lines(points, np.array(ball.faces, np.int64), (15, 15, 15), axis)
        total = np.concatenate([[0], np.cumsum(lines.sign)])[lines.start]
        assert not total.any()
        within = np.diff(lines.where)[~np.isin(np.arange(1, len(lines)), lines.start)]
        assert (within >= 0).all()


@pytest.mark.parametrize("extent", [0.2, 0.49, 1.0, 3.3, 7.5, 10.0])
def test_lattice_keeps_off_the_sides_of_the_box(extent: float) -> None:
    """The outermost inner nodes are within the box and off its sides, one layer lies outside."""
    lattice = lattice_around(np.array([[0.0, 0, 0], [extent, 1, 1]]), (1.0, 1.0, 1.0))
    first, last = lattice.origin[0] + 1, lattice.origin[0] + lattice.shape[0] - 2
    assert min(first, extent - last) >= min(0.25, extent / 2) - 1e-12
    assert lattice.origin[0] < 0
    assert last + 1 > extent
