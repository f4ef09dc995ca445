"""Surfaces of three-dimensional shapes divided by label: every face has one, borders are smooth and crisp."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from spem.decomposition.transfer import sample_points
from spem.plots.borders import Borders
from spem.plots.raster import vertex_normals
from spem.plots.refinement import refine
from spem.plots.surfaces import shape_surface

if TYPE_CHECKING:
    from typing import TypeAlias

    from numpy.typing import ArrayLike, NDArray

    from spem.shapes.shape import Shape

    Mesh: TypeAlias = tuple[ArrayLike, ArrayLike]

# Edges of a mesh, in voxels, beyond which labels at its vertices alone would miss how a border runs.
_LONGEST = 1.5


@dataclass(frozen=True, eq=False)
class PartSurface:
    """A triangle mesh with a label for each face.

    Parameters
    ----------
    vertices
        ``(n_vertices, 3)`` coordinates, in the shape's own coordinates.
    faces
        ``(n_faces, 3)`` vertex numbers, counter-clockwise seen from outside.
    normals
        ``(n_vertices, 3)`` unit normals.
    face_labels
        ``(n_faces,)`` label of each face.
    """

    vertices: NDArray[np.float64]
    faces: NDArray[np.int64]
    normals: NDArray[np.float64]
    face_labels: NDArray[np.int32]

    def separated(self) -> tuple[PartSurface, NDArray[np.int32]]:
        """Return the surface with vertices of its own for each label, and the label of each vertex.

        So colours given to the vertices do not run into each other where parts meet.

        Examples
        --------
        >>> from spem.shapes.shape import Shape
        >>> whole = part_surface(Shape.from_mask(np.ones((3, 3, 3))), np.arange(27) // 9)
        >>> apart, labels = whole.separated()
        >>> bool((labels[apart.faces] == whole.face_labels[:, None]).all())
        True
        """
        pairs = np.stack([self.faces.reshape(-1), np.repeat(self.face_labels, 3).astype(np.int64)], axis=1)
        distinct, number = np.unique(pairs, axis=0, return_inverse=True)
        vertex = distinct[:, 0]
        faces = number.reshape(self.faces.shape)
        apart = PartSurface(self.vertices[vertex], faces, self.normals[vertex], self.face_labels)
        return apart, distinct[:, 1].astype(np.int32)


def part_surface(shape: Shape, node_labels: ArrayLike, *, mesh: Mesh | None = None) -> PartSurface:
    """Divide the surface of a shape by the labels of the nodes below it.

    Triangles that a border crosses are cut along it; large ones are divided first.

    Parameters
    ----------
    shape
        A three-dimensional shape.
    node_labels
        ``(n_nodes,)`` whole numbers.
    mesh
        Vertices ``(n_vertices, 3)`` and faces ``(n_faces, 3)`` of the mesh that the shape was made of,
        to be divided; by default a surface is made by marching cubes.

    Raises
    ------
    ShapeError
        If the shape is not three-dimensional.
    ParameterError
        If labels or mesh do not fit the shape.

    Examples
    --------
    >>> from spem.shapes.shape import Shape
    >>> surface = part_surface(Shape.from_mask(np.ones((3, 3, 3))), np.arange(27) // 9)
    >>> np.unique(surface.face_labels).tolist()
    [0, 1, 2]
    """
    borders = Borders.of(shape, node_labels)
    if mesh is None:
        surface = shape_surface(shape)
        vertices, faces = surface.vertices, surface.faces
        # Half as deep as values are read: the deeper, the farther borders on slopes seem to move.
        index = (_grid_index(shape, vertices) + surface.samples) / 2
    else:
        merged, _, samples = sample_points(shape, *mesh)
        vertices, faces = merged.vertices, merged.faces
        index = _grid_index(shape, samples)
    rows = np.hstack([vertices, vertex_normals(vertices, faces), index])
    rows, faces = refine(rows, faces, _LONGEST * max(shape.spacing))
    vertices, normals, index = np.split(rows, 3, axis=1)
    return divide(vertices, faces, normals, borders.weigh(index), borders.values)


def _grid_index(shape: Shape, points: NDArray[np.float64]) -> NDArray[np.float64]:
    """Grid indices of points, with fractions."""
    return np.asarray((points - np.asarray(shape.origin)) / np.asarray(shape.spacing))


def divide(
    vertices: NDArray[np.float64],
    faces: NDArray[np.int64],
    normals: NDArray[np.float64],
    weights: NDArray[np.float64],
    values: NDArray[np.int32],
) -> PartSurface:
    """Cut the triangles of a mesh where the heaviest label changes.

    Parameters
    ----------
    vertices, faces, normals
        The mesh.
    weights
        ``(n_vertices, n_labels)`` weight of each label.
    values
        ``(n_labels,)`` the labels.

    Examples
    --------
    >>> square = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]])
    >>> half = divide(square, np.array([[0, 1, 2]]), square, np.eye(2)[[0, 1, 1]], np.array([4, 7]))
    >>> half.face_labels.tolist(), half.vertices[3].tolist()
    ([4, 7, 7], [0.5, 0.0, 0.0])
    """
    label = weights.argmax(axis=1)
    corner = label[faces]  # (n_faces, 3)
    plain = (corner == corner[:, :1]).all(axis=1)
    mixed = faces[~plain]
    pairs, share, of_face = _crossings(mixed, label, weights)
    n, n_edges = len(vertices), len(pairs)
    three = (np.diff(np.sort(label[mixed], axis=1), axis=1) > 0).all(axis=1)
    cut, cut_label = _halves(mixed[~three], label, n + of_face[~three])
    middle = n + n_edges + np.arange(three.sum())
    fan, fan_label = _thirds(mixed[three], label, n + of_face[three], middle)
    points, directions = (
        np.concatenate([a, _between(a, pairs, share), a[mixed[three]].mean(axis=1)])
        for a in (vertices, normals)
    )
    length = np.linalg.norm(directions, axis=1, keepdims=True)
    return PartSurface(
        points,
        np.concatenate([faces[plain], cut, fan]),
        directions / np.maximum(length, 1e-300),
        values[np.concatenate([corner[plain, 0], cut_label, fan_label])],
    )


def _between(
    values: NDArray[np.float64], pairs: NDArray[np.int64], share: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Values on edges, the given share of the way from their first end to their second."""
    start, stop = values[pairs[:, 0]], values[pairs[:, 1]]
    return np.asarray(start + share[:, None] * (stop - start))


def _crossings(
    mixed: NDArray[np.int64], label: NDArray[np.int64], weights: NDArray[np.float64]
) -> tuple[NDArray[np.int64], NDArray[np.float64], NDArray[np.int64]]:
    """Edges where labels change, where on them, and which edge lies between corners j and j + 1 of a face."""
    ends = np.stack([mixed, np.roll(mixed, -1, axis=1)], axis=2).reshape(-1, 2)
    changes = label[ends[:, 0]] != label[ends[:, 1]]
    pairs, number = np.unique(np.sort(ends[changes], axis=1), axis=0, return_inverse=True)
    of_face = np.full(len(ends), -1)
    of_face[changes] = number.reshape(-1)
    one, two = pairs.T
    lead_one = weights[one, label[one]] - weights[one, label[two]]
    lead_two = weights[two, label[two]] - weights[two, label[one]]
    total = lead_one + lead_two
    share = np.divide(lead_one, total, out=np.full(len(pairs), 0.5), where=total > 0)
    return pairs, share, of_face.reshape(-1, 3)


def _halves(
    mixed: NDArray[np.int64], label: NDArray[np.int64], crossing: NDArray[np.int64]
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Cut faces of two labels: a triangle at the corner that is alone, two at the others."""
    corner = label[mixed]
    alone = np.argmax((corner[:, :, None] == corner[:, None, :]).sum(axis=2) == 1, axis=1)
    turn = (alone[:, None] + np.arange(3)) % 3
    o, p, q = np.take_along_axis(mixed, turn, axis=1).T
    op, _, qo = np.take_along_axis(crossing, turn, axis=1).T
    faces = np.concatenate([np.stack(triple, axis=1) for triple in ((o, op, qo), (op, p, q), (op, q, qo))])
    return faces, np.concatenate([label[o], label[p], label[p]])


def _thirds(
    mixed: NDArray[np.int64],
    label: NDArray[np.int64],
    crossing: NDArray[np.int64],
    middle: NDArray[np.int64],
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Cut faces of three labels: two triangles at each corner, about the middle."""
    faces, labels = [], []
    for j in range(3):
        vertex, after, before = mixed[:, j], crossing[:, j], crossing[:, j - 1]
        faces += [np.stack([vertex, after, middle], axis=1), np.stack([vertex, middle, before], axis=1)]
        labels += [label[vertex]] * 2
    return np.concatenate(faces), np.concatenate(labels)
