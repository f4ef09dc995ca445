"""Triangle meshes with a label and a colour for each vertex, as PLY files that other programs read."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from spem.decomposition.transfer import vertex_labels
from spem.errors import ParameterError
from spem.files import write_whole
from spem.plots.part_surface import part_surface
from spem.plots.style import part_colours

if TYPE_CHECKING:
    from os import PathLike

    from numpy.typing import ArrayLike, NDArray

    from spem.plots.part_surface import Mesh
    from spem.shapes.shape import Shape

_VERTEX = np.dtype([("at", "<f8", 3), ("label", "<i4"), ("colour", "u1", 3)])
_FACE = np.dtype([("count", "u1"), ("vertices", "<i4", 3)])


def write_parts_mesh(
    path: str | PathLike[str], shape: Shape, node_labels: ArrayLike, *, mesh: Mesh | None = None
) -> Path:
    """Write the surface of a three-dimensional shape, each vertex with its part, as a PLY file.

    A given mesh keeps its vertices and faces, in their order. The surface made of the voxels is cut where
    parts meet and has vertices of its own for each part there, so colours do not run into each other.

    Parameters
    ----------
    path
        File to write; an existing one is replaced at the end, in one step.
    shape
        A three-dimensional shape.
    node_labels
        ``(n_nodes,)`` part of each node, -1 for none.
    mesh
        Vertices ``(n_vertices, 3)`` and faces ``(n_faces, 3)`` of the mesh that the shape was made of.

    Returns
    -------
    path
        The file written.

    Raises
    ------
    ShapeError
        If the shape is not three-dimensional.
    ParameterError
        If labels or mesh do not fit the shape, or the file cannot be written.

    Examples
    --------
    >>> import tempfile
    >>> from spem.shapes.shape import Shape
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     file = write_parts_mesh(
    ...         f"{folder}/a.ply", Shape.from_mask(np.ones((3, 3, 3))), np.arange(27) // 9
    ...     )
    ...     file.read_bytes()[:3]
    b'ply'
    """
    if mesh is None:
        surface, labels = part_surface(shape, node_labels).separated()
        return write_ply(path, surface.vertices, surface.faces, labels)
    return write_ply(path, *mesh, vertex_labels(shape, node_labels, *mesh))


def write_ply(path: str | PathLike[str], vertices: ArrayLike, faces: ArrayLike, labels: ArrayLike) -> Path:
    r"""Write a triangle mesh with labelled vertices as a binary PLY file.

    Parameters
    ----------
    path
        File to write; an existing one is replaced at the end, in one step.
    vertices
        ``(n_vertices, 3)`` coordinates, kept in double precision.
    faces
        ``(n_faces, 3)`` vertex numbers.
    labels
        ``(n_vertices,)`` whole numbers: the property ``label``, and by it ``red``, ``green``, ``blue``.

    Returns
    -------
    path
        The file written.

    Raises
    ------
    ParameterError
        If the arrays do not make a mesh with a label for each vertex, or the file cannot be written.

    Examples
    --------
    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     file = write_ply(f"{folder}/a.ply", np.eye(3), [[0, 1, 2]], [0, 0, 1])
    ...     len(file.read_bytes().partition(b"end_header\n")[2])
    106
    """
    corner, triangle, label = np.asarray(vertices), np.asarray(faces), np.asarray(labels)
    _check(corner, triangle, label)
    vertex = np.empty(len(corner), _VERTEX)
    vertex["at"], vertex["label"] = corner, label
    vertex["colour"] = np.rint(255 * part_colours(label))
    face = np.empty(len(triangle), _FACE)
    face["count"], face["vertices"] = 3, triangle
    header = (
        "ply\nformat binary_little_endian 1.0\ncomment label: part of the vertex, -1 for none\n"
        f"element vertex {len(vertex)}\nproperty double x\nproperty double y\nproperty double z\n"
        "property int label\nproperty uchar red\nproperty uchar green\nproperty uchar blue\n"
        f"element face {len(face)}\nproperty list uchar int vertex_indices\nend_header\n"
    )
    target = Path(path)
    write_whole(target, lambda file: file.write(header.encode("ascii") + vertex.tobytes() + face.tobytes()))
    return target


def _check(vertices: NDArray[np.generic], faces: NDArray[np.generic], labels: NDArray[np.generic]) -> None:
    """Raise unless the arrays make a mesh with labelled vertices."""
    n = len(vertices)
    if vertices.shape != (n, 3) or faces.ndim != 2 or faces.shape[1] != 3 or labels.shape != (n,):
        msg = "a labelled mesh is (n, 3) vertices, (m, 3) faces and (n,) labels,"
        msg += f" not {vertices.shape}, {faces.shape} and {labels.shape}"
        raise ParameterError(msg)
    if faces.dtype.kind not in "iu" or labels.dtype.kind not in "iu":
        msg = f"faces and labels must be whole numbers, not {faces.dtype} and {labels.dtype}"
        raise ParameterError(msg)
    if faces.size and not 0 <= faces.min() <= faces.max() < n:
        msg = f"faces must name some of the {n} vertices"
        raise ParameterError(msg)
