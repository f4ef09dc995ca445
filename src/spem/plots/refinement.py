"""Triangle meshes made fine enough to carry detail: long edges are halved until none is left."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

# Corners o, p, q of a face, and the middles u, v, w of o-p, p-q and q-o, by which edges are halved:
# none, o-p, o-p and p-q, all.
_PIECES = {
    0: ("opq",),
    1: ("ouq", "upq"),
    2: ("ouq", "uvq", "upv"),
    3: ("ouw", "upv", "wvq", "uvw"),
}


def refine(
    vertices: NDArray[np.float64], faces: NDArray[np.int64], longest: float
) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Halve all edges that are too long; what stands beside the coordinates is interpolated.

    Parameters
    ----------
    vertices
        ``(n_vertices, 3 + q)`` coordinates, and q values more at each vertex.
    faces
        ``(n_faces, 3)`` vertex numbers.
    longest
        Length that edges may have.

    Returns
    -------
    vertices
        The given vertices and then the new ones.
    faces
        The refined faces, turning as before; neighbours stay joined.

    Examples
    --------
    >>> vertices, faces = refine(np.array([[0.0, 0, 0], [2, 0, 0], [0, 1, 0]]), np.array([[0, 1, 2]]), 1.5)
    >>> len(faces), vertices[3].tolist()
    (3, [1.0, 0.0, 0.0])
    """
    while True:
        ends = np.stack(
            [faces, np.roll(faces, -1, axis=1)], axis=2
        )  # (n_faces, 3, 2), edge j leaves corner j
        # as one number each, pairs are told apart ten times faster
        least, most = np.sort(ends.reshape(-1, 2), axis=1).T
        key, number = np.unique(least * len(vertices) + most, return_inverse=True)
        pairs = np.stack([key // len(vertices), key % len(vertices)], axis=1)
        length = np.linalg.norm(np.diff(vertices[pairs, :3], axis=1)[:, 0], axis=1)
        long = length > longest
        if not long.any():
            return vertices, faces
        middle = np.full(len(pairs), -1)
        middle[long] = len(vertices) + np.arange(long.sum())
        vertices = np.concatenate([vertices, vertices[pairs[long]].mean(axis=1)])
        faces = _split(faces, middle[number.reshape(-1, 3)])


def _split(faces: NDArray[np.int64], middle: NDArray[np.int64]) -> NDArray[np.int64]:
    """Split faces at the middles of their edges, -1 where an edge stays whole."""
    halved = middle >= 0
    count = halved.sum(axis=1)
    # turned so that the halved edges come first
    first = np.where(count == 1, halved.argmax(axis=1), 0)
    first = np.where(count == 2, (np.argmin(halved, axis=1) + 1) % 3, first)
    turn = (first[:, None] + np.arange(3)) % 3
    corners, middles = (np.take_along_axis(a, turn, axis=1) for a in (faces, middle))
    letters = dict(zip("opquvw", np.concatenate([corners, middles], axis=1).T, strict=True))
    pieces = [
        np.stack([letters[letter][count == k] for letter in piece], axis=1)
        for k, split in _PIECES.items()
        for piece in split
    ]
    return np.concatenate(pieces)
