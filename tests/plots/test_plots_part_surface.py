"""Borders between labels, surfaces divided by them, and the files they are written to."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st

from spem.decomposition.transfer import vertex_labels
from spem.errors import ParameterError, ShapeError
from spem.plots.borders import Borders
from spem.plots.part_surface import divide, part_surface
from spem.plots.ply import write_parts_mesh, write_ply
from spem.plots.raster import render_surface
from spem.plots.style import PART_COLOURS, part_colours
from spem.plots.surfaces import shape_surface
from spem.shapes.read import read
from spem.shapes.shape import Cuts, Shape


def ball(radius: float) -> Shape:
    """Make a ball of a radius in voxels, about the middle of its grid."""
    t = np.arange(-np.ceil(radius), np.ceil(radius) + 1)
    grid = np.stack(np.meshgrid(t, t, t, indexing="ij"))
    return Shape.from_mask((grid**2).sum(axis=0) < radius**2, origin=(t[0],) * 3, name="ball")


def area(vertices: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """Area of each triangle."""
    a, b, c = vertices[faces].transpose(1, 0, 2)
    return np.linalg.norm(np.cross(b - a, c - a), axis=1) / 2


@settings(max_examples=25, deadline=None)
@given(st.integers(1, 3), st.integers(0, 2**32 - 1))
def test_every_node_keeps_its_label(ndim, seed):
    """However the labels are scattered, smoothing changes none of them."""
    rng = np.random.default_rng(seed)
    mask = rng.random((6,) * ndim) < 0.7
    mask.flat[0] = True
    shape = Shape.from_mask(mask)
    labels = rng.integers(-1, 4, shape.n_nodes)
    index = np.stack(np.unravel_index(shape.voxels, shape.mask.shape), axis=1)
    assert np.array_equal(Borders.of(shape, labels).at(index), labels)


def test_straight_borders_stay_where_they_are():
    """Between two halves of a square, the border is half way between their nodes, along its whole length."""
    borders = Borders.of(Shape.from_mask(np.ones((12, 12))), np.arange(144) // 12 >= 6)
    rows = np.linspace(1, 12, 30)
    index = np.stack(np.meshgrid([6.49, 6.51], rows, indexing="ij"), axis=-1).reshape(-1, 2)
    assert borders.at(index).tolist() == [0] * 30 + [1] * 30


def test_slanted_borders_lose_their_stairs():
    """Along a border at a slope the smooth one stays within a third of a voxel of the line."""
    shape = Shape.from_mask(np.ones((40, 40)))
    side = shape.points @ [0.4, 1.0] - 27.3
    borders = Borders.of(shape, side > 0)
    grid = np.stack(np.meshgrid(*[np.linspace(5, 34, 200)] * 2, indexing="ij"), axis=-1).reshape(-1, 2)
    away = (grid @ [0.4, 1.0] - 27.3) / np.hypot(0.4, 1.0)
    wrong = (borders.at(grid + 1) == 1) != (away > 0)
    assert np.abs(away[wrong]).max() < 0.34


def test_smoothing_does_not_cross_a_cut():
    """Two rows parted by cut edges keep weights of nought for each other's label."""
    mask = np.zeros((4, 12), bool)
    mask[1:3, 1:11] = True
    inside = np.flatnonzero(mask)
    cuts = Cuts(inside, np.repeat([1, 0], 10).astype(np.uint8), np.full(20, 0.5))
    shape = Shape(mask, (1.0, 1.0), (0.0, 0.0), cuts=cuts)
    assert np.array_equal(Borders.of(shape, np.repeat([0, 1], 10)).weights, np.repeat(np.eye(2), 10, axis=0))


def test_division_keeps_the_surface():
    """Cut triangles cover what they were cut from: the same area, closed, turned the same way."""
    shape = ball(6.0)
    rng = np.random.default_rng(0)
    whole = shape_surface(shape)
    labels = rng.integers(0, 4, shape.n_nodes)
    divided = part_surface(shape, labels)
    assert len(np.unique(divided.face_labels)) == 4
    assert area(divided.vertices, divided.faces).sum() == pytest.approx(
        area(whole.vertices, whole.faces).sum()
    )
    mesh = trimesh.Trimesh(divided.vertices, divided.faces, process=False)
    assert mesh.is_watertight
    assert mesh.is_winding_consistent
    assert mesh.volume > 0


def test_caps_of_a_ball_have_their_area():
    """A plane divides the surface of a ball in proportion to height, here to less than half a voxel."""
    shape = ball(12.0)
    surface = part_surface(shape, (shape.points[:, 0] > 4.5).astype(int))
    parts = np.bincount(surface.face_labels, area(surface.vertices, surface.faces))
    radius = np.linalg.norm(surface.vertices, axis=1).mean()
    height = radius * (1 - 2 * parts[1] / parts.sum())
    assert height == pytest.approx(4.5, abs=0.4)
    rim = np.intersect1d(*(surface.faces[surface.face_labels == label] for label in (0, 1)))
    assert np.abs(surface.vertices[rim, 0] - 4.5).max() < 0.5


def test_three_labels_meet_in_the_middle_of_a_triangle():
    """A triangle with a label at each corner is shared by the three in equal parts."""
    corner = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]])
    shared = divide(corner, np.array([[0, 1, 2]]), corner, np.eye(3), np.array([5, -1, 2]))
    part = {
        label: area(shared.vertices, shared.faces)[shared.face_labels == label].sum() for label in (5, -1, 2)
    }
    assert part == pytest.approx(dict.fromkeys((5, -1, 2), 0.5 / 3))


def test_a_given_mesh_is_divided_in_place_of_the_voxels():
    """The colours lie on the mesh itself, on the right side of a plane."""
    box = trimesh.creation.box((4.0, 2.0, 2.0)).subdivide().subdivide()
    shape = read((box.vertices, box.faces), spacing=0.25)
    labels = (shape.points[:, 0] > 0.4).astype(int)
    surface = part_surface(shape, labels, mesh=(box.vertices, box.faces))
    assert area(surface.vertices, surface.faces).sum() == pytest.approx(box.area)
    middle = surface.vertices[surface.faces].mean(axis=1)[:, 0]
    assert middle[surface.face_labels == 0].max() < 0.65
    assert middle[surface.face_labels == 1].min() > 0.15


def test_plane_shapes_have_no_surface():
    """A silhouette is refused."""
    with pytest.raises(ShapeError, match="3 dimensions"):
        part_surface(Shape.from_mask(np.ones((3, 3))), np.zeros(9))


def test_faces_have_the_colours_given():
    """Two triangles are drawn each in its colour, without a blend between them."""
    corner = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])
    faces = [[0, 1, 2], [0, 2, 3]]
    picture = render_surface(
        corner, faces, view=np.eye(3), size=(60, 60), face_colours=[[1, 0, 0], [0, 1, 0]]
    )
    solid = picture[picture[..., 3] == 255][:, :3]
    assert {tuple(np.sign(pixel)) for pixel in np.unique(solid, axis=0)} <= {(1, 0, 0), (0, 1, 0), (1, 1, 0)}
    assert picture[50, 40, 1] == 0
    assert picture[20, 10, 0] == 0
    with pytest.raises(ParameterError, match=r"face_colours must be \(2, 3\)"):
        render_surface(corner, faces, face_colours=[[1, 0, 0]])


def read_ply(path):
    """Vertices, faces, labels and colours of a PLY file, as trimesh reads them."""
    mesh = trimesh.load(path, process=False)
    return mesh.vertices, mesh.faces, mesh.metadata["_ply_raw"]["vertex"]["data"]["label"], mesh.visual


def test_a_file_holds_the_mesh_its_labels_and_their_colours(tmp_path):
    """What was written is read back: coordinates to the last bit, labels, colours."""
    rng = np.random.default_rng(1)
    vertices, faces = rng.normal(size=(30, 3)) * 1e5, rng.integers(0, 30, (40, 3))
    labels = rng.integers(-1, 25, 30)
    found = read_ply(write_ply(tmp_path / "a.ply", vertices, faces, labels))
    assert np.array_equal(found[0], vertices)
    assert np.array_equal(found[1], faces)
    assert np.array_equal(np.ravel(found[2]), labels)
    assert np.array_equal(found[3].vertex_colors[:, :3], np.rint(255 * part_colours(labels)))


def test_the_mesh_of_a_file_keeps_its_vertices(tmp_path):
    """Given the mesh that a shape was made of, its vertices and faces come back in order, labelled."""
    box = trimesh.creation.box((4.0, 2.0, 2.0)).subdivide()
    shape = read((box.vertices, box.faces), spacing=0.4)
    labels = (shape.points[:, 0] > 0).astype(int)
    path = write_parts_mesh(tmp_path / "box.ply", shape, labels, mesh=(box.vertices, box.faces))
    vertices, faces, found, _ = read_ply(path)
    assert np.array_equal(vertices, box.vertices)
    assert np.array_equal(faces, box.faces)
    assert np.array_equal(np.ravel(found), vertex_labels(shape, labels, box.vertices, box.faces))


def test_the_surface_of_voxels_has_one_label_a_face(tmp_path):
    """No face of the file has vertices of two labels, so no colours run."""
    shape = ball(5.0)
    path = write_parts_mesh(tmp_path / "ball.ply", shape, (shape.points[:, 1] > 1).astype(int))
    _, faces, labels, _ = read_ply(path)
    of_faces = np.ravel(labels)[faces]
    assert (of_faces == of_faces[:, :1]).all()
    assert np.unique(of_faces).tolist() == [0, 1]


@pytest.mark.parametrize(
    ("faces", "labels", "message"),
    [
        ([[0, 1, 3]], [0, 0, 0], "name some of the 3 vertices"),
        ([[0, 1, 2]], [0, 0], "labelled mesh"),
        ([[0, 1, 2]], [0.5, 0, 0], "whole numbers"),
    ],
)
def test_arrays_that_make_no_mesh_are_refused(tmp_path, faces, labels, message):
    """Nothing is written of a mesh that other programs would stumble over."""
    with pytest.raises(ParameterError, match=message):
        write_ply(tmp_path / "a.ply", np.eye(3), faces, labels)
    assert not list(tmp_path.iterdir())


# Machado, Oliveira and Fernandes 2009, full protanopia, deuteranopia and tritanopia.
EYES = {
    "normal": np.eye(3),
    "protan": [[0.152, 1.053, -0.205], [0.115, 0.786, 0.099], [-0.004, -0.048, 1.052]],
    "deutan": [[0.367, 0.861, -0.228], [0.280, 0.673, 0.047], [-0.012, 0.043, 0.969]],
    "tritan": [[1.256, -0.077, -0.179], [-0.078, 0.931, 0.148], [0.005, 0.691, 0.304]],
}


@pytest.mark.parametrize("eye", EYES)
def test_colours_of_parts_can_be_told_apart(eye):
    """No two colours of the palette, grey included, look alike to any common kind of eye."""
    from skimage.color import deltaE_ciede2000, rgb2lab

    colours = part_colours(np.arange(-1, len(PART_COLOURS)))
    light = np.where(colours <= 0.04045, colours / 12.92, ((colours + 0.055) / 1.055) ** 2.4)
    seen = np.clip(light @ np.transpose(EYES[eye]), 0, 1)
    lab = rgb2lab(np.where(seen <= 0.0031308, 12.92 * seen, 1.055 * seen ** (1 / 2.4) - 0.055)[None])[0]
    apart = deltaE_ciede2000(lab[:, None], lab[None]) + 100 * np.eye(len(lab))
    assert apart.min() > 6
    assert apart[:9, :9].min() > (10 if eye == "normal" else 7)
