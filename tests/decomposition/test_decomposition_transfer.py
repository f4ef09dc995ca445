"""Labels of nodes on the vertices of meshes and on other points."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st

from spem.decomposition.transfer import sample_points, vertex_labels
from spem.errors import ParameterError
from spem.shapes.read import read
from spem.shapes.shape import Shape


def stack() -> tuple[Shape, np.ndarray, np.ndarray, np.ndarray]:
    """Two blocks a tenth of a voxel apart, the nodes' blocks, and the mesh of the lower one."""
    shape = Shape.from_mask(np.ones((5, 5, 6)))
    labels = np.where(shape.points[:, 2] < 2.5, 4, 7)
    low, high = np.array([-0.4, -0.4, -0.4]), np.array([4.4, 4.4, 2.55])
    box = trimesh.creation.box(high - low)
    return shape, labels, box.vertices + (low + high) / 2, box.faces


@settings(max_examples=20, deadline=None)
@given(st.integers(1, 4), st.integers(0, 2**32 - 1))
def test_points_at_nodes_have_the_labels_of_the_nodes(ndim, seed):
    """In any dimension and with any spacing, the place of a node gets its label."""
    rng = np.random.default_rng(seed)
    mask = rng.random((4,) * ndim) < 0.6
    mask.flat[0] = True
    shape = Shape.from_mask(mask, tuple(rng.uniform(0.1, 3, ndim)))
    labels = rng.integers(-1, 5, shape.n_nodes)
    assert np.array_equal(vertex_labels(shape, labels, shape.points), labels)


@pytest.mark.parametrize(("labels", "wanted"), [([3, 5, 5, 0], 5), ([3, 5, 3, 5], 3), ([-1, -1, 9, 8], -1)])
def test_ties_go_to_the_majority(labels, wanted):
    """Half way between four nodes the most frequent label wins, and the least of equals."""
    assert vertex_labels(Shape.from_mask(np.ones((2, 2))), labels, [[0.5, 0.5]]).tolist() == [wanted]


def test_labels_do_not_jump_across_a_narrow_gap():
    """The top of the lower block is nearer to the upper one's nodes; its faces tell which side it is on."""
    shape, labels, vertices, faces = stack()
    assert 7 in vertex_labels(shape, labels, vertices)
    assert np.unique(vertex_labels(shape, labels, vertices, faces)).tolist() == [4]


def test_orientation_and_merging_of_the_mesh_do_not_matter():
    """Faces turned inside out and a soup of triangles get the same labels."""
    shape, labels, vertices, faces = stack()
    assert np.unique(vertex_labels(shape, labels, vertices, faces[:, ::-1])).tolist() == [4]
    soup = vertices[faces].reshape(-1, 3)
    assert np.unique(vertex_labels(shape, labels, soup, np.arange(len(soup)).reshape(-1, 3))).tolist() == [4]


def test_tips_without_nodes_take_the_label_along_the_edges():
    """A thin flap that bends over another part keeps the label of where it grows from."""
    shape = Shape.from_mask(np.ones((10, 1, 1)))
    labels = np.where(shape.points[:, 0] < 5, 0, 1)
    path = np.array([[0, 0, 0.5], [0, 0, 1], [0, 0, 3], [4, 0, 3], [9, 0, 3]])
    vertices = np.concatenate([path, path + np.array([0, 0.2, 0])])
    faces = np.concatenate([[[i, i + 1, i + 6], [i, i + 6, i + 5]] for i in range(4)])
    assert vertex_labels(shape, labels, vertices)[4] == 1
    assert not vertex_labels(shape, labels, vertices, faces).any()


def test_vertices_that_no_edge_leads_to_take_the_nearest_node():
    """A vertex of no face, and one of a stray piece far away, are labelled as bare points are."""
    shape, labels, vertices, faces = stack()
    stray = np.array([[20.0, 0, 5], [21, 0, 5], [20, 1, 5], [0, 0, 5]])
    faces = np.concatenate([faces, [[8, 9, 10]]])
    assert vertex_labels(shape, labels, np.concatenate([vertices, stray]), faces)[8:].tolist() == [7] * 4


def test_samples_lie_inside():
    """Half a voxel below the middle of the flat faces of a box, and nowhere outside."""
    box = trimesh.creation.box((2.0, 2.0, 2.0)).subdivide()
    shape = read((box.vertices, box.faces), spacing=0.2)
    surface, place, samples = sample_points(shape, box.vertices, box.faces)
    assert np.allclose(surface.vertices[place], box.vertices)
    middle = (surface.vertices == 0).sum(axis=1) == 2
    assert np.abs(samples[middle]).max(axis=1) == pytest.approx([0.9] * 6)
    assert np.abs(samples).max() < 1


def test_caller_keeps_his_arrays():
    """Nothing that is passed in changes."""
    shape, labels, vertices, faces = stack()
    before = vertices.copy(), faces.copy()
    vertex_labels(shape, labels, vertices, faces)
    assert np.array_equal(vertices, before[0])
    assert np.array_equal(faces, before[1])


def test_no_vertices_have_no_labels():
    """An empty list of points is answered by one."""
    assert vertex_labels(Shape.from_mask([1]), [0], np.zeros((0, 1))).shape == (0,)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"node_labels": [1]}, r"node_labels must be \(150,\) whole numbers"),
        ({"node_labels": np.zeros(150)}, "not .* of float64"),
        ({"vertices": [[0.0, 1]]}, r"finite \(n, 3\) coordinates, not \(1, 2\)"),
        ({"vertices": [[0.0, 1, np.nan]]}, "some are NaN or inf"),
        ({"faces": [[0, 1, 8]]}, "name some of the 8 vertices"),
        ({"faces": [[0, 1]]}, "faces must be"),
    ],
)
def test_arguments_that_do_not_fit_are_refused(change, message):
    """The message says which argument, what was expected and what came."""
    shape, labels, vertices, faces = stack()
    arguments = {"node_labels": labels, "vertices": vertices, "faces": faces} | change
    with pytest.raises(ParameterError, match=message):
        vertex_labels(shape, **arguments)


@pytest.mark.parametrize("faces", [np.zeros((0, 3), int), [[0, 0, 0]]])
def test_a_mesh_without_faces_or_area(faces):
    """Vertices of no face, or of one that is a point, have no inside: they take the nearest label."""
    cube = Shape.from_mask(np.ones((2, 2, 2)))
    assert vertex_labels(cube, [3, 3, 3, 3, 5, 5, 5, 5], [[-0.1, 0.1, 0]], faces).tolist() == [3]


def test_faces_of_a_plane_shape_are_refused():
    """Only shapes in space have meshes of triangles."""
    with pytest.raises(ParameterError, match="a shape of 2 dimensions"):
        vertex_labels(Shape.from_mask(np.ones((2, 2))), [0] * 4, [[0.0, 0]], [[0, 0, 0]])


@pytest.mark.data
def test_slabs_of_a_horse_reach_its_vertices(data_dir):
    """Labels that follow one coordinate are those of the vertices, but within a voxel of a border."""
    mesh = trimesh.load(data_dir / "horse_poses" / "1.obj", process=False)
    shape = read((mesh.vertices, mesh.faces), voxels=8000)
    step = np.ptp(shape.points[:, 2]) / 4
    labels = np.floor((shape.points[:, 2] - shape.points[:, 2].min()) / step).astype(int)
    at = (mesh.vertices[:, 2] - shape.points[:, 2].min()) / step
    wanted = np.clip(np.floor(at), 0, 3)
    found = vertex_labels(shape, labels, mesh.vertices, mesh.faces)
    inner = np.abs(at - np.rint(at)) * step > shape.spacing[2]
    assert (found == wanted)[inner].mean() > 0.995
