"""Files of a shape: they open elsewhere, and hold what is shown."""

from __future__ import annotations

import io

import numpy as np
import pandas as pd
import pytest
import trimesh

import spem
from spem.errors import ParameterError, ShapeError
from spem.server.views import VIEWS
from spem.server.views.downloads import DOWNLOADS
from spem.server.views.outline import mesh_of
from spem.server.views.surface_file import vertex_values

HAND = spem.Shape.from_mask(np.ones((9, 14)), 0.5, origin=(3.0, 4.0), name="left/hand: α?")


@pytest.fixture(scope="module")
def dumbbell():
    """Return two boxes joined by a bar."""
    mask = np.ones((5, 5, 24), bool)
    mask[:, [0, 1, 3, 4], 10:14] = False
    return spem.Shape.from_mask(mask, 2.0, origin=(1.0, 0.0, 0.0), name="dumbbell")


def load(name, shape, **options):
    """Return the arrays of an npz download."""
    content, media_type, _ = DOWNLOADS[name](shape, options)
    assert media_type == "application/x-npz"
    with np.load(io.BytesIO(content), allow_pickle=False) as file:
        return dict(file)


def test_fields_are_those_of_the_sweep():
    """Rows are nodes, columns the sampled rho, and nodes lie where the shape has them."""
    arrays = load("field.npz", HAND)
    sweep = spem.sweep(HAND)
    np.testing.assert_array_equal(arrays["fields"], sweep.fields())
    np.testing.assert_array_equal(arrays["rho"], sweep.rho)
    np.testing.assert_allclose(arrays["origin"] + arrays["node"] * arrays["spacing"], HAND.points)
    assert str(arrays["name"]) == HAND.name


def test_maps_are_those_of_the_library():
    """Maps, their basis and their shares of the variance."""
    arrays, maps = load("maps.npz", HAND), spem.maps(HAND, 8)
    np.testing.assert_array_equal(arrays["maps"], maps.values)
    np.testing.assert_array_equal(arrays["basis"], maps.basis)
    np.testing.assert_array_equal(arrays["explained"], maps.explained)


def test_parts_load_as_parts(tmp_path):
    """The file of parts is one that `Parts.load` reads."""
    content, _, _ = DOWNLOADS["parts.npz"](HAND, {"k": 2})
    (tmp_path / "parts.npz").write_bytes(content)
    parts = spem.Parts.load(tmp_path / "parts.npz")
    np.testing.assert_array_equal(parts.node_labels, VIEWS["parts"](HAND, {"k": 2})[1]["node_part"])


def test_profile_of_a_node_stands_beside_the_population():
    """A table of one row a rho: the field of the node, and quantiles in ascending order."""
    content, media_type, name = DOWNLOADS["node.csv"](HAND, {"node": 17})
    table = pd.read_csv(io.BytesIO(content))
    assert (media_type, name) == ("text/csv; charset=utf-8", "left_hand-node-17.csv")
    np.testing.assert_allclose(table["v"], spem.sweep(HAND).fields()[17], rtol=1e-5)
    np.testing.assert_allclose(table["rho"] / HAND.size, table["rho_relative"], rtol=1e-5)
    assert (np.diff(table.filter(like="v_q"), axis=1) >= 0).all()


@pytest.mark.parametrize("node", [None, -1, 126, "3"])
def test_nodes_that_are_none_are_refused(node):
    """Nodes are numbered from 0 to one below their number."""
    with pytest.raises(ParameterError, match=r"node=.*: expected a whole number from 0 to 125"):
        DOWNLOADS["node.csv"](HAND, {"node": node})


def read_ply(content):
    """Return a mesh as trimesh reads it, in its order."""
    return trimesh.load(io.BytesIO(content), file_type="ply", process=False)


def test_surface_has_all_maps_and_colours_of_one(dumbbell):
    """Another reader finds the vertices in coordinates, maps as properties, and colours of both signs."""
    content, media_type, name = DOWNLOADS["surface.ply"](dumbbell, {"show": "map", "map": 2})
    mesh = read_ply(content)
    assert (media_type, name) == ("model/ply", "dumbbell-surface.ply")
    found = mesh_of(dumbbell)
    np.testing.assert_allclose(mesh.vertices, np.array(dumbbell.origin) + found.position * dumbbell.spacing)
    np.testing.assert_array_equal(mesh.faces, found.faces)
    values = mesh.metadata["_ply_raw"]["vertex"]["data"]["map_2"].ravel()
    expected = vertex_values(dumbbell, found, spem.maps(dumbbell, 8).values)[:, 1]
    np.testing.assert_allclose(values, expected, rtol=1e-5)
    red, blue = mesh.visual.vertex_colors[:, 0].astype(int), mesh.visual.vertex_colors[:, 2].astype(int)
    bright = np.abs(values) > 0.5 * np.abs(values).max()
    assert ((red > blue) == (values > 0))[bright].all()


def test_surface_shows_field_or_parts(dumbbell):
    """Its values are v at a rho, or numbers of parts."""
    mesh = read_ply(DOWNLOADS["surface.ply"](dumbbell, {"show": "field", "rho": 2.5})[0])
    v = mesh.metadata["_ply_raw"]["vertex"]["data"]["v"].ravel()
    expected = vertex_values(dumbbell, mesh_of(dumbbell), spem.field(dumbbell, [2.5]))[:, 0]
    np.testing.assert_allclose(v, expected, atol=1e-5)
    mesh = read_ply(DOWNLOADS["surface.ply"](dumbbell, {"show": "part", "k": 2})[0])
    part = mesh.metadata["_ply_raw"]["vertex"]["data"]["part"].ravel()
    np.testing.assert_array_equal(part, VIEWS["parts"](dumbbell, {"k": 2})[1]["vertex_part"])


def test_colours_of_a_ball_are_nearly_one():
    """A field of a ball depends on the depth alone, which all vertices share, wherever nodes lie."""
    ball = spem.synthetic.ball(12.0, 1.0)
    mesh = mesh_of(ball)
    v = spem.field(ball, [4.0])
    interpolated, nearest = vertex_values(ball, mesh, v)[:, 0], v[mesh.node, 0]
    assert np.std(interpolated) < 0.35 * np.std(nearest)
    exact = 12 / 11 * np.sinh(11 / 4) / np.sinh(12 / 4)
    assert np.mean(interpolated) == pytest.approx(exact, abs=0.02)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"show": "heat"}, "show='heat': expected one of map, field, part"),
        ({"map": 9}, "map=9: expected a whole number from 1 to 8"),
        ({"show": "field", "rho": 1e6}, "this hyperfield of dumbbell covers"),
    ],
)
def test_what_a_surface_cannot_show_is_refused(dumbbell, options, message):
    """Unknown kinds, maps and rho out of range are named."""
    with pytest.raises(ParameterError, match=message):
        DOWNLOADS["surface.ply"](dumbbell, options)


def test_silhouettes_have_no_surface():
    """A shape of two dimensions has no mesh."""
    with pytest.raises(ShapeError, match="a surface is of shapes of 3 dimensions, this one has 2"):
        DOWNLOADS["surface.ply"](HAND, {})


@pytest.mark.parametrize("name", ["field.npz", "maps.npz", "parts.npz"])
@pytest.mark.parametrize("extent", [(30,), (4, 4, 4, 4)])
def test_shapes_without_a_picture_have_files(name, extent):
    """Fields, maps and parts of shapes of one and four dimensions can be had."""
    assert load(name, spem.Shape.from_mask(np.ones(extent)), k=2)


def test_files_are_a_view():
    """The view has the same bytes, their type and a plain name."""
    header, arrays = VIEWS["download"](HAND, {"file": "node.csv", "node": 3})
    content, media_type, name = DOWNLOADS["node.csv"](HAND, {"node": 3})
    assert header == {"file": name, "media_type": media_type}
    assert arrays["body"].tobytes() == content
    with pytest.raises(ParameterError, match=r"file='passwd': expected one of field\.npz, maps\.npz"):
        VIEWS["download"](HAND, {"file": "passwd"})
