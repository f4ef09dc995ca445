"""Meshes to shapes: sizes, repairs, reports, errors and the real files."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
import trimesh
from scipy.spatial.transform import Rotation

from spem.errors import ParameterError, ShapeError, SizeError
from spem.shapes.distance import signed_distance
from spem.shapes.mesh_files import load_mesh
from spem.shapes.meshes import mesh_shape, read_mesh
from spem.shapes.shape import Shape
from spem.shapes.surface import Surface

BALL = trimesh.creation.icosphere(3)


def line_volumes(shape: Shape) -> np.ndarray:
    """Return the volume between the cuts as summed along the lines of each axis."""
    ends = [(shape.cuts.fraction[shape.cuts.direction // 2 == axis] - 0.5).sum() for axis in range(3)]
    return (shape.n_nodes + np.array(ends)) * np.prod(shape.spacing)


def test_default_is_the_budget_and_the_report_says_what_was_done() -> None:
    """Without a size a mesh has about 15,000 nodes; a clean one has no repairs."""
    shape = mesh_shape(BALL.vertices, BALL.faces)
    assert abs(shape.n_nodes - 15_000) < 300
    assert shape.report.method == "scanline filling"
    assert shape.report.watertight is True
    assert shape.report.repairs == ()
    assert np.allclose(shape.points.mean(axis=0), 0, atol=1e-9)


@pytest.mark.parametrize("voxels", [1000, 30_000])
def test_budget_is_met_where_volumes_overlap(voxels: int) -> None:
    """The signed volume of overlapping balls counts twice; the budget is met all the same."""
    vertices = np.concatenate([BALL.vertices, BALL.vertices + np.array([0.5, 0, 0])])
    faces = np.concatenate([BALL.faces, BALL.faces + len(BALL.vertices)])
    shape = mesh_shape(vertices, faces, voxels=voxels)
    assert abs(shape.n_nodes / voxels - 1) < 0.05


def test_spacing_may_differ_by_axis() -> None:
    """With a spacing per axis the volume between cuts is the same."""
    shape = mesh_shape(BALL.vertices, BALL.faces, spacing=(0.05, 0.1, 0.08))
    assert shape.spacing == (0.05, 0.1, 0.08)
    assert np.allclose(line_volumes(shape), BALL.volume, rtol=5e-3)


@pytest.mark.parametrize("radius", [5.0, 20.0])
def test_inner_radius_is_met(radius: float) -> None:
    """The deepest node lies the asked number of voxels from the surface."""
    shape = mesh_shape(BALL.vertices, BALL.faces, inner_radius=radius)
    assert np.isclose(signed_distance(shape).max() / shape.spacing[0], radius, rtol=0.04)


def test_coordinates_are_those_of_the_mesh() -> None:
    """Nodes of a box away from the origin lie within it, x along axis 0."""
    box = trimesh.creation.box(bounds=[[10, 20, 30], [12, 23, 34]])
    shape = mesh_shape(box.vertices, box.faces, spacing=0.5)
    assert shape.mask.shape == (6, 8, 10)
    assert np.allclose(
        [shape.points.min(axis=0), shape.points.max(axis=0)], [[10.25, 20.25, 30.25], [11.75, 22.75, 33.75]]
    )


def test_largest_part_is_kept_unless_all_are_wanted() -> None:
    """Of two balls the larger is kept and the report says so; "all" keeps both."""
    vertices = np.concatenate([BALL.vertices, 0.5 * BALL.vertices + np.array([3, 0, 0])])
    faces = np.concatenate([BALL.faces, BALL.faces + len(BALL.vertices)])
    one = mesh_shape(vertices, faces, spacing=0.1)
    both = mesh_shape(vertices, faces, spacing=0.1, components="all")
    assert np.isclose(one.report.volume_kept, 8 / 9, atol=0.01)
    assert one.report.components == both.report.components == 2
    assert np.allclose(line_volumes(both), 1.125 * BALL.volume, rtol=0.01)


def test_plates_a_fraction_of_a_voxel_apart_are_two_components() -> None:
    """Two boxes with a slit thinner than a voxel between their nodes do not join."""
    boxes = [
        trimesh.creation.box(bounds=[[0, 0, 0], [6, 6, 2.9]]),
        trimesh.creation.box(bounds=[[0, 0, 3.1], [6, 6, 6]]),
    ]
    mesh = trimesh.util.concatenate(boxes)
    shape = mesh_shape(mesh.vertices, mesh.faces, spacing=1.0, components="all")
    assert (shape.report.components, shape.n_nodes) == (2, 216)


def test_inside_out_mesh_is_the_same_shape() -> None:
    """A mesh of negative volume is turned, and the report says so."""
    right, wrong = (mesh_shape(BALL.vertices, faces) for faces in (BALL.faces, BALL.faces[:, ::-1]))
    assert np.array_equal(right.mask, wrong.mask)
    assert wrong.report.repairs == ("turned the surface right side out",)
    assert wrong.report.watertight is True


def test_flipped_and_repeated_faces_are_repaired_without_filling_holes() -> None:
    """Flipped, repeated and degenerate faces leave a closed ball, filled by scanlines."""
    faces = BALL.faces.copy()
    faces[7] = faces[7, ::-1]
    shape = mesh_shape(BALL.vertices, np.concatenate([faces, faces[30:31], [[1, 1, 2]]]))
    assert shape.report.method == "scanline filling"
    assert shape.report.watertight is False
    assert len(shape.report.repairs) == 3
    assert np.array_equal(shape.mask, mesh_shape(BALL.vertices, BALL.faces).mask)


def test_open_mesh_is_filled_by_winding_number_and_says_so() -> None:
    """A ball that lacks a face keeps its volume; method and hole are reported."""
    shape = mesh_shape(BALL.vertices, BALL.faces[1:])
    assert shape.report.method == "generalised winding number"
    assert shape.report.watertight is False
    assert shape.report.repairs == ("filled over 3 open edges in 1 loop",)
    assert np.allclose(line_volumes(shape), BALL.volume, rtol=5e-3)


def test_fin_on_a_closed_mesh_is_told_and_adds_nothing() -> None:
    """An edge of three faces is not manifold: the winding number fills the box, and the report says so."""
    box = trimesh.creation.box((1, 1, 1))
    vertices = np.vstack([box.vertices, [[0, 0, 2]]])
    faces = np.vstack([box.faces, [[*box.edges_unique[0], 8]]])
    shape = mesh_shape(vertices, faces, voxels=1000)
    assert shape.report.method == "generalised winding number"
    assert shape.report.watertight is False
    assert shape.report.repairs == ("filled over 3 open edges in 1 loop",)
    assert np.allclose(shape.volume, 1.0, rtol=0.01)


def test_boxes_that_share_an_edge_are_closed() -> None:
    """An edge of four faces whose directions balance leaves nothing open: scanlines fill both boxes."""
    boxes = [trimesh.creation.box((1, 1, 1)) for _ in range(2)]
    boxes[1].apply_translation((1, 1, 0))
    both = trimesh.util.concatenate(boxes)
    both.merge_vertices()
    shape = mesh_shape(both.vertices, both.faces, voxels=1000, components="all")
    assert shape.report.method == "scanline filling"
    assert shape.report.watertight is True
    assert shape.report.components == 2


def test_vertices_repeated_for_each_face_are_closed() -> None:
    """A triangle soup without shared vertices, as in STL, is watertight where corners meet."""
    soup = BALL.vertices[BALL.faces].reshape(-1, 3)
    shape = mesh_shape(soup, np.arange(len(soup)).reshape(-1, 3))
    assert shape.report.watertight is True
    assert np.array_equal(shape.mask, mesh_shape(BALL.vertices, BALL.faces).mask)


def test_arrays_given_are_not_changed() -> None:
    """The caller's arrays stay as they are."""
    vertices, faces = np.array(BALL.vertices), np.array(BALL.faces)[:, ::-1].copy()
    copies = vertices.copy(), faces.copy()
    mesh_shape(vertices, faces, voxels=500)
    assert np.array_equal(vertices, copies[0])
    assert np.array_equal(faces, copies[1])


def test_flat_mesh_is_refused() -> None:
    """A plane, also one with both sides, encloses no volume."""
    square = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])
    for faces in ([[0, 1, 2], [0, 2, 3]], [[0, 1, 2], [0, 2, 3], [0, 2, 1], [0, 3, 2]]):
        with pytest.raises(ShapeError, match="mesh encloses no volume"):
            mesh_shape(square, faces)


def test_mesh_thinner_than_the_grid_names_a_spacing_that_does() -> None:
    """Too coarse a grid is refused with a spacing at which nodes lie inside."""
    plate = trimesh.creation.box((4, 4, 0.05))
    vertices = plate.vertices @ Rotation.from_euler("xyz", [0.5, 0.6, 0.7]).as_matrix()
    with pytest.raises(ShapeError, match="thinner than the grid") as caught:
        mesh_shape(vertices, plate.faces, spacing=2.5)
    enough = float(re.search(r"a spacing of (\S+) or finer", str(caught.value))[1])
    assert mesh_shape(vertices, plate.faces, spacing=enough).n_nodes > 0


@pytest.mark.parametrize("spacing", [1e-4, 1e-12, 1e-300])
def test_grid_over_the_limit_is_refused_before_it_is_made(spacing: float) -> None:
    """However fine the spacing, the error comes at once and names the sizes."""
    with pytest.raises(SizeError, match="the limit is 2 GiB"):
        mesh_shape(BALL.vertices, BALL.faces, spacing=spacing, memory_limit=2 << 30)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"voxels": 0}, "voxels=0: expected a whole number of at least 1"),
        ({"spacing": -1.0}, "spacing=-1.0: expected one positive number, or 3"),
        ({"spacing": (1.0, 2.0)}, "expected one positive number, or 3"),
        ({"inner_radius": float("nan")}, "inner_radius=nan: expected a number of at least 1"),
        ({"voxels": 100, "spacing": 1.0}, "given together"),
        ({"components": "most"}, "expected 'largest' or 'all'"),
    ],
)
def test_arguments_out_of_range_are_refused(arguments: dict, message: str) -> None:
    """Sizes that make no sense are ParameterErrors that quote them."""
    with pytest.raises(ParameterError, match=message):
        mesh_shape(BALL.vertices, BALL.faces, **arguments)


def test_arrays_that_are_no_mesh_are_refused() -> None:
    """Wrong shapes, faces without vertices and infinite coordinates are told apart."""
    with pytest.raises(ParameterError, match=r"expected vertices \(n, 3\)"):
        mesh_shape(BALL.vertices[:, :2], BALL.faces)
    with pytest.raises(ShapeError, match="has no faces"):
        mesh_shape(BALL.vertices, BALL.faces[:0])
    with pytest.raises(ShapeError, match="from 0 to 641"):
        mesh_shape(BALL.vertices, BALL.faces + 1)
    with pytest.raises(ShapeError, match="not finite"):
        mesh_shape(np.where(BALL.vertices > 0.9, np.nan, BALL.vertices), BALL.faces)


@pytest.mark.data
def test_watertight_meshes_keep_their_volume(data_dir: Path) -> None:
    """Every twelfth mesh of the SHREC'11 copy has its volume between the cuts within 1 %."""
    for path in sorted((data_dir / "shrec11").glob("T*.obj"))[::12]:
        shape = read_mesh(path, components="all")
        off = line_volumes(shape) / Surface(*load_mesh(path)).volume - 1
        assert np.abs(off).min() < 0.01, path.name
        assert shape.report.watertight is True
        assert shape.report.source == str(path)


@pytest.mark.data
@pytest.mark.parametrize(
    ("pattern", "hole"),
    [
        ("horse_poses/*.obj", "filled over 19 open edges in 2 loops"),
        ("tosca_cats/cat[0-2].off", "filled over 76 open edges in"),
    ],
)
def test_real_meshes_with_holes_keep_their_volume(data_dir: Path, pattern: str, hole: str) -> None:
    """Horses and cats are filled over their holes, within 1 % of the mesh's volume."""
    for path in sorted(data_dir.glob(pattern)):
        shape = read_mesh(path)
        assert np.abs(line_volumes(shape) / Surface(*load_mesh(path)).volume - 1).min() < 0.01, path.name
        assert shape.report.method == "generalised winding number"
        assert any(phrase.startswith(hole) for phrase in shape.report.repairs)
        assert shape.report.volume_kept > 0.99
