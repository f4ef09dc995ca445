"""Mesh files to vertices and triangles."""

from __future__ import annotations

from itertools import islice
from pathlib import Path

import numpy as np
import trimesh
from numpy.typing import NDArray

from spem.errors import ReadError
from spem.shapes.kinds import MESH_SUFFIXES
from spem.shapes.limits import check_file, printable

# Largest coordinate whose cube, a volume, is a number.
_FARTHEST = 1e100
# The counts of an OFF file stand among its first words, behind comments at most.
_HEADER_LINES = 100
# Bytes of a binary STL file before its faces: a title and their number.
_STL_HEADER = 84


def load_mesh(path: Path) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Read the vertices and triangles of a mesh file; the parts of a scene are put in their places.

    Parameters
    ----------
    path
        OBJ, OFF, PLY, STL or GLB.

    Returns
    -------
    tuple of arrays
        Vertices ``(n_vertices, 3)`` and faces ``(n_faces, 3)``; polygons are cut into triangles.

    Raises
    ------
    ReadError
        When the file is missing, empty, truncated, of another kind or has no faces. An OBJ file
        that ends early cannot be told from a mesh with holes.

    Examples
    --------
    >>> load_mesh(Path("absent.obj"))
    Traceback (most recent call last):
    ...
    spem.errors.ReadError: absent.obj: no such file; check the path
    """
    if path.suffix.lower() not in MESH_SUFFIXES:
        msg = f"{path}: expected a mesh as {', '.join(MESH_SUFFIXES)}, got {path.suffix or 'no suffix'}"
        raise ReadError(msg)
    check_file(path)
    try:
        with path.open("rb") as file:
            kind = path.suffix[1:].lower()
            scene = trimesh.load_scene(file, kind, resolver=_Alone(), process=False, skip_materials=True)
        mesh = scene.to_mesh()
        vertices, faces = np.asarray(mesh.vertices, np.float64), np.asarray(mesh.faces, np.int64)
    except Exception as error:
        # Readers of broken files fail in many ways: with ValueError, IndexError, struct.error, ...;
        # an ImportError comes from one that looks for the character set of what is no text.
        reason = "neither text nor whole" if isinstance(error, ImportError) else printable(error)
        msg = f"{path}: cannot be read as {path.suffix[1:].upper()} ({reason}); the file may be truncated"
        raise ReadError(msg) from error
    if len(faces) and not 0 <= faces.min() <= faces.max() < len(vertices):
        stray = faces.max() if faces.min() >= 0 else faces.min()
        msg = f"{path}: a face names vertex {stray}, counted from 0, of {len(vertices)}; the file is damaged"
        raise ReadError(msg)
    if vertices.size and np.abs(vertices[np.isfinite(vertices)]).max(initial=0) > _FARTHEST:
        msg = f"{path}: coordinates beyond {_FARTHEST:g}, whose volume is no number; the file is damaged"
        raise ReadError(msg)
    if path.suffix.lower() == ".stl":
        _check_stl_count(path, len(faces))
    if not len(faces):
        msg = f"{path}: no faces in it; expected a triangle or polygon mesh"
        raise ReadError(msg)
    if path.suffix.lower() == ".off":
        _check_off_count(path, len(faces))
    return vertices, faces


class _Alone(trimesh.resolvers.Resolver):  # type: ignore[misc]
    """Refuses the other files that a mesh names: pictures, materials, buffers."""

    def __init__(self) -> None:
        """Hold nothing."""

    def get(self, key: str) -> bytes:
        """Refuse a file."""
        msg = "it names another file, and spem opens none but the one that it is given"
        raise ValueError(msg)

    def write(self, name: str, data: object) -> None:
        """Refuse to write."""
        raise ValueError(name)

    def namespaced(self, namespace: str) -> _Alone:
        """Return itself, since there are no folders."""
        return self

    def keys(self) -> tuple[str, ...]:
        """Name no file."""
        return ()


def _check_stl_count(path: Path, n_faces: int) -> None:
    """Refuse a binary STL file with fewer faces than its header announces; an ASCII one has no count."""
    with path.open("rb") as file:
        header = file.read(_STL_HEADER)
    if len(header) == _STL_HEADER and (b"\0" in header or not header.startswith(b"solid")):
        announced = int.from_bytes(header[-4:], "little")
        if n_faces < announced:
            msg = f"{path}: {n_faces} of the {announced} faces of its header are there; the file is truncated"
            raise ReadError(msg)


def _check_off_count(path: Path, n_faces: int) -> None:
    """Refuse an OFF file with fewer faces than its header announces."""
    with path.open(encoding="utf-8", errors="replace") as file:
        lines = (line.partition("#")[0] for line in file)
        words = [word for line in islice(lines, _HEADER_LINES) for word in line.split()]
    numbers = [int(word) for word in words if word.isdecimal()][:2]
    if len(numbers) == 2 and n_faces < numbers[1]:
        msg = f"{path}: {n_faces} of the {numbers[1]} faces of its header are there; the file is truncated"
        raise ReadError(msg)
