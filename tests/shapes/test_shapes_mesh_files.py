"""Mesh files: what is read, and what is refused in one line."""

from __future__ import annotations

import json
import struct
from pathlib import Path

import numpy as np
import pytest
import trimesh

from spem.errors import ReadError
from spem.shapes.mesh_files import load_mesh
from spem.shapes.surface import Surface, merge_vertices


def write(path: Path, mesh: trimesh.Trimesh | trimesh.Scene) -> Path:
    """Write a mesh in the format of its suffix."""
    data = mesh.export(file_type=path.suffix[1:])
    path.write_bytes(data.encode() if isinstance(data, str) else data)
    return path


@pytest.mark.parametrize("suffix", [".obj", ".off", ".ply", ".stl", ".glb", ".STL"])
def test_formats_give_the_same_closed_surface(tmp_path: Path, suffix: str) -> None:
    """Each format gives the surface that was written, to single precision."""
    ball = trimesh.creation.icosphere(2)
    path = write(tmp_path / f"ball{suffix.lower()}", ball).rename(tmp_path / f"ball{suffix}")
    surface = merge_vertices(Surface(*load_mesh(path)))
    assert surface.closed
    assert np.isclose(surface.volume, ball.volume, rtol=1e-5)


def test_polygons_are_cut_into_triangles(tmp_path: Path) -> None:
    """A cube of quadrilaterals becomes twelve triangles of its volume."""
    corners = "\n".join(f"v {x} {y} {z}" for x in (0, 1) for y in (0, 1) for z in (0, 1))
    quads = "f 1 2 4 3\nf 5 7 8 6\nf 1 5 6 2\nf 3 4 8 7\nf 1 3 7 5\nf 2 6 8 4\n"
    path = tmp_path / "cube.obj"
    path.write_text(f"{corners}\n{quads}")
    surface = Surface(*load_mesh(path))
    assert len(surface.faces) == 12
    assert surface.closed
    assert np.isclose(surface.volume, 1)


def test_parts_of_a_scene_stand_in_their_places(tmp_path: Path) -> None:
    """Transforms of a GLB scene are applied, also where one mesh stands twice."""
    box = trimesh.creation.box()
    scene = trimesh.Scene()
    scene.add_geometry(box, geom_name="box", transform=trimesh.transformations.scale_matrix(2))
    scene.add_geometry(box, geom_name="box", transform=trimesh.transformations.translation_matrix([5, 0, 0]))
    surface = Surface(*load_mesh(write(tmp_path / "two.glb", scene)))
    assert np.isclose(surface.volume, 9)
    assert np.allclose([surface.vertices.min(axis=0), surface.vertices.max(axis=0)], [[-1] * 3, [5.5, 1, 1]])


@pytest.mark.parametrize("suffix", [".off", ".ply", ".stl", ".glb"])
@pytest.mark.parametrize("part", [0.1, 0.5, 0.95])
def test_truncated_files_are_refused(tmp_path: Path, suffix: str, part: float) -> None:
    """A file cut short is a ReadError in one line that names the file."""
    path = write(tmp_path / f"cut{suffix}", trimesh.creation.icosphere(2))
    path.write_bytes(path.read_bytes()[: int(part * path.stat().st_size)])
    with pytest.raises(ReadError, match=rf"^.*cut\{suffix}.*truncated$"):
        load_mesh(path)


@pytest.mark.parametrize(
    ("name", "content", "message"),
    [
        ("empty.obj", "", "the file is empty"),
        ("words.obj", "hello world\n", "no faces in it"),
        ("points.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\n", "no faces in it"),
        ("far.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9\n", "cannot be read as OBJ"),
        ("words.off", "hello world\n", "cannot be read as OFF"),
        ("words.ply", "hello world\n", "cannot be read as PLY"),
        ("words.glb", "hello world\n", "cannot be read as GLB"),
        ("mesh.step", "hello world\n", "expected a mesh as .obj, .off, .ply, .stl, .glb, got .step"),
    ],
)
def test_what_is_no_mesh_is_refused(tmp_path: Path, name: str, content: str, message: str) -> None:
    """Empty files, other files and faces without vertices are ReadErrors that say so."""
    path = tmp_path / name
    path.write_text(content)
    with pytest.raises(ReadError, match=message):
        load_mesh(path)


def test_missing_file_is_refused(tmp_path: Path) -> None:
    """A path without a file is a ReadError."""
    with pytest.raises(ReadError, match=r"absent\.obj: no such file; check the path"):
        load_mesh(tmp_path / "absent.obj")


@pytest.mark.parametrize("where", ["beside.bin", "../beside.bin", "file:///beside.bin"])
def test_a_scene_that_names_another_file_is_refused(tmp_path: Path, where: str) -> None:
    """A buffer outside the file is not opened, whether it is there or not."""
    folder = tmp_path / "inner"
    folder.mkdir()
    for place in (tmp_path, folder):
        (place / "beside.bin").write_bytes(bytes(36))
    view = {"buffer": 0, "byteLength": 36}
    tree = {
        "asset": {"version": "2.0"},
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
        "accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"}],
        "bufferViews": [view],
        "buffers": [{"byteLength": 36, "uri": where}],
    }
    text = json.dumps(tree).encode()
    text += b" " * (-len(text) % 4)
    head = struct.pack("<4sIII4s", b"glTF", 2, 20 + len(text), len(text), b"JSON")
    (folder / "scene.glb").write_bytes(head + text)
    with pytest.raises(ReadError, match="names another file"):
        load_mesh(folder / "scene.glb")


def test_coordinates_without_a_volume_are_refused(tmp_path: Path) -> None:
    """Coordinates whose extent overflows are a ReadError, not a grid of NaN."""
    path = tmp_path / "far.obj"
    path.write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nv -1e308 1e308 0\nf 1 2 3\nf 1 3 4\nf 1 4 2\nf 2 4 3\n")
    with pytest.raises(ReadError, match=r"coordinates beyond 1e\+100"):
        load_mesh(path)
