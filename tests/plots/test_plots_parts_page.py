"""The page on which parts of shapes can be turned."""

from __future__ import annotations

import json
import re
from base64 import b64decode, b64encode
from hashlib import sha256
from types import SimpleNamespace

import numpy as np
import pytest
import trimesh

from spem.errors import ParameterError, ShapeError
from spem.plots.part_surface import part_surface
from spem.plots.parts_page import write_parts_page
from spem.plots.style import PART_COLOURS
from spem.shapes.read import read
from spem.shapes.shape import Shape


def toy(name: str = "block", *, nobody: bool = False) -> SimpleNamespace:
    """Make a block of three slabs, each a part; the first in none on request."""
    shape = Shape.from_mask(np.ones((4, 5, 9)), (1.0, 1.0, 0.5), origin=(10.0, -3.0, 2.0), name=name)
    labels = np.arange(shape.n_nodes) % 9 // 3
    return SimpleNamespace(shape=shape, node_labels=np.where(labels, labels, -1 if nobody else 0))


def written(path, parts, **options):
    """The text of a page and the data in it."""
    page = write_parts_page(path / "page.html", parts, **options).read_text(encoding="utf-8")
    [data] = re.findall(r'<script type="application/json" id="data">(.*)</script>', page)
    return page, json.loads(data)


def array(text: str, kind: str, columns: int) -> np.ndarray:
    """Rows of an array in base 64."""
    return np.frombuffer(b64decode(text), kind).reshape(-1, columns)


def test_data_are_the_surface_with_its_labels(tmp_path):
    """Places, normals, faces and labels of the page are those of the divided surface, to a 65535th."""
    part = toy()
    _, data = written(tmp_path, [part])
    [shape] = data["shapes"]
    apart, labels = part_surface(part.shape, part.node_labels).separated()
    places = array(shape["places"], "<u2", 4)
    longest = np.ptp(apart.vertices, axis=0).max()
    back = places[:, :3] / 65535 * longest + apart.vertices.min(axis=0)
    assert np.abs(back - apart.vertices).max() < longest / 65535
    assert np.array_equal(places[:, 3], labels)
    assert np.abs(array(shape["normals"], "i1", 4)[:, :3] / 127 - apart.normals).max() < 0.01
    assert np.array_equal(array(shape["faces"], "<u4", 3), apart.faces)
    assert data["colours"][1] == [int(PART_COLOURS[1][k : k + 2], 16) for k in (1, 3, 5)]


def test_page_needs_nothing_else(tmp_path):
    """No address is named, nothing may be fetched, and the only script that may run is the page's own."""
    page, _ = written(tmp_path, [toy()])
    assert "http" not in page.replace("http-equiv", "")
    assert "src=" not in re.sub(r'src="data:', "", page)
    [policy] = re.findall(r'Content-Security-Policy" content="([^"]*)"', page)
    script = page.rpartition("<script>")[2].partition("</script>")[0]
    digest = b64encode(sha256(script.encode()).digest()).decode()
    assert f"script-src 'sha256-{digest}'" in policy
    assert policy.startswith("default-src 'none'")


def test_every_part_has_a_box_with_its_name(tmp_path):
    """Boxes in order of the labels, what is in no part last; sizes of a single shape only."""
    page, _ = written(tmp_path, [toy(nobody=True)])
    assert re.findall(r'class="name">([^<]*)<', page) == ["part 1", "part 2", "no part"]
    assert page.count("<small>33 %</small>") == 3
    page, data = written(tmp_path, [toy("a"), toy("b", nobody=True)])
    assert [shape["name"] for shape in data["shapes"]] == ["a", "b"]
    assert page.count('type="checkbox"') == 4
    assert "<small>" not in page
    assert "2 shapes in 3 parts" in page


def test_names_and_titles_are_text(tmp_path):
    """What looks like markup in a name or a title is shown as it is, and ends no script."""
    evil = "<!--<script></script><b>&\"'"
    page, data = written(tmp_path, [toy(evil)], title=evil)
    assert data["shapes"][0]["name"] == evil
    assert page.count("</script>") == page.count("<script") == 2
    assert "<b>" not in page
    assert "<!--" not in page


def test_pictures_stand_in_where_nothing_can_be_drawn(tmp_path):
    """Each shape has a picture with words, for browsers without scripts or WebGL."""
    page, _ = written(tmp_path, [toy("a"), toy("b")])
    assert re.findall(r'alt="([^"]*)"', page) == ["a, coloured by part", "b, coloured by part"]


def test_views_can_be_given(tmp_path):
    """By default the broad side is seen; a view is that of all shapes."""
    _, data = written(tmp_path, [toy(), toy()], view=(90, -90))
    for shape in data["shapes"]:
        assert np.allclose(np.reshape(shape["rotation"], (3, 3)), np.eye(3), atol=1e-12)


def test_given_meshes_are_shown(tmp_path):
    """The mesh that a shape was made of takes the place of its voxels."""
    box = trimesh.creation.box((4.0, 2.0, 2.0))
    shape = read((box.vertices, box.faces), spacing=0.5)
    part = SimpleNamespace(shape=shape, node_labels=np.zeros(shape.n_nodes, int))
    _, data = written(tmp_path, [part], meshes=[(box.vertices, box.faces)])
    shown = part_surface(shape, part.node_labels, mesh=(box.vertices, box.faces))
    assert np.allclose(np.ptp(shown.vertices, axis=0), (4, 2, 2))
    assert array(data["shapes"][0]["places"], "<u2", 4).shape == (len(shown.vertices), 4)


@pytest.mark.parametrize(
    ("parts", "options", "error", "message"),
    [
        ([], {}, ParameterError, "at least one shape"),
        ([toy()], {"meshes": []}, ParameterError, "1 shapes need as many meshes, not 0"),
        (
            [SimpleNamespace(shape=Shape.from_mask(np.ones((2, 2))), node_labels=np.zeros(4))],
            {},
            ShapeError,
            "3 dimensions, this one has 2; draw it with figure_parts",
        ),
        (
            [SimpleNamespace(shape=Shape.from_mask(np.ones((7, 7, 7))), node_labels=np.arange(343))],
            {},
            ParameterError,
            "up to 256 parts, not 343",
        ),
    ],
)
def test_what_cannot_be_shown_is_refused(tmp_path, parts, options, error, message):
    """Nothing is written, and the message says what to do."""
    with pytest.raises(error, match=message):
        write_parts_page(tmp_path / "page.html", parts, **options)
    assert not list(tmp_path.iterdir())
