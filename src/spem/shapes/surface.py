"""Triangle surfaces: whether they are closed, and the repairs that cost nothing in truth."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from spem.shapes.hollows import part_turns

# A sphere has volume 0.094 area^1.5; rounding of coordinates leaves flat surfaces some 1e-16.
FLAT = 1e-12


@dataclass(frozen=True, eq=False)
class Surface:
    """A triangle surface and what was done to it.

    Parameters
    ----------
    vertices
        ``(n_vertices, 3)`` coordinates.
    faces
        ``(n_faces, 3)`` vertex indices, counter-clockwise seen from outside.
    repairs
        What was changed, one phrase each.

    Examples
    --------
    >>> import numpy as np
    >>> corners = np.array([[0.0, 0, 0], [3, 0, 0], [0, 3, 0], [0, 0, 3]])
    >>> open_tetrahedron = Surface(corners, np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2]]))
    >>> open_tetrahedron.open_edges.tolist(), open_tetrahedron.n_loops
    ([[1, 2], [1, 3], [2, 3]], 1)
    """

    vertices: NDArray[np.float64]
    faces: NDArray[np.int64]
    repairs: tuple[str, ...] = ()

    def __repr__(self) -> str:
        """Give the number of vertices and faces, and what was repaired."""
        done = "; ".join(self.repairs)
        return f"Surface({len(self.vertices)} vertices, {len(self.faces)} faces{', ' * bool(done)}{done})"

    @cached_property
    def open_edges(self) -> NDArray[np.int64]:
        """``(n_open, 2)`` edges not used as often in one direction as in the other."""
        start, stop = self.faces.reshape(-1), np.roll(self.faces, -1, axis=1).reshape(-1)
        n = len(self.vertices)
        key, use = np.unique(np.minimum(start, stop) * n + np.maximum(start, stop), return_inverse=True)
        balance = np.bincount(use, np.sign(stop - start), key.size)
        unbalanced = key[balance != 0]
        return np.stack([unbalanced // n, unbalanced % n], axis=1)

    @property
    def closed(self) -> bool:
        """Whether every edge is used as often in one direction as in the other.

        This is what makes the crossings of every line sum to zero; edges with four faces may be closed.
        """
        return len(self.open_edges) == 0

    @property
    def n_loops(self) -> int:
        """Number of connected sets of open edges."""
        if self.closed:
            return 0
        vertices, end = np.unique(self.open_edges, return_inverse=True)
        count, _ = _connect(end.reshape(-1, 2), vertices.size)
        return count

    @cached_property
    def triangles(self) -> NDArray[np.float64]:
        """``(n_faces, 3, 3)`` corner coordinates, from the middle of the bounding box."""
        middle = (self.vertices.min(axis=0) + self.vertices.max(axis=0)) / 2
        return np.asarray((self.vertices - middle)[self.faces])

    @cached_property
    def face_volumes(self) -> NDArray[np.float64]:
        """``(n_faces,)`` signed volume between each face and the middle of the bounding box."""
        a, b, c = self.triangles.transpose(1, 0, 2)
        return np.asarray(np.einsum("ni,ni->n", a, np.cross(b, c)) / 6)

    @cached_property
    def volume(self) -> float:
        """Signed volume; overlapping parts count twice, and for an open surface it is an estimate."""
        return float(self.face_volumes.sum())

    @cached_property
    def face_areas(self) -> NDArray[np.float64]:
        """``(n_faces,)`` area of each face."""
        a, b, c = self.triangles.transpose(1, 0, 2)
        return np.asarray(np.linalg.norm(np.cross(b - a, c - a), axis=1) / 2)

    @cached_property
    def vertex_areas(self) -> NDArray[np.float64]:
        """``(n_vertices,)`` a third of the area of the faces at each vertex."""
        thirds = np.repeat(self.face_areas / 3, 3)
        return np.asarray(np.bincount(self.faces.ravel(), thirds, len(self.vertices)), np.float64)

    @cached_property
    def area(self) -> float:
        """Area of all faces."""
        return float(self.face_areas.sum())

    @property
    def flat(self) -> bool:
        """Whether it encloses no volume, to rounding."""
        return bool(abs(self.volume) <= FLAT * self.area**1.5)

    def with_faces(self, faces: NDArray[np.int64], *repairs: str) -> Surface:
        """Return the surface with other faces, and further phrases added to `repairs`."""
        return Surface(self.vertices, faces, self.repairs + repairs)


def merge_vertices(surface: Surface) -> Surface:
    """Merge vertices at the same place: formats such as STL repeat them for each face.

    Parameters
    ----------
    surface
        As read.

    Returns
    -------
    Surface
        The same set of points, so no repair is noted.

    Examples
    --------
    >>> import numpy as np
    >>> corners = np.array([[0.0, 0, 0], [3, 0, 0], [0, 3, 0], [0, 0, 3]])
    >>> soup = corners[[[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]].reshape(-1, 3)
    >>> surface = Surface(soup, np.arange(12).reshape(4, 3))
    >>> surface.closed, merge_vertices(surface).closed
    (False, True)
    """
    first, index = _distinct_rows(surface.vertices)
    return Surface(surface.vertices[first], index[surface.faces], surface.repairs)


def mend(surface: Surface) -> Surface:
    """Return the surface with repeated faces dropped and its orientation made consistent.

    On surfaces that are not closed, or that have each face from both sides, degenerate and
    repeated faces are dropped and faces turned to agree with most of their patch. Then, on all,
    parts wound inside out are turned, unless they lie wholly within others, as hollows. Holes are
    left open. No vertex moves.

    Parameters
    ----------
    surface
        As read.

    Returns
    -------
    Surface
        With what was done in `repairs`.

    Examples
    --------
    >>> import numpy as np
    >>> corners = np.array([[0.0, 0, 0], [3, 0, 0], [0, 3, 0], [0, 0, 3]])
    >>> flipped = np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 3, 2]])
    >>> mend(Surface(corners, flipped)).repairs
    ('flipped 1 of 4 faces to agree with their neighbours',)
    """
    if not surface.closed or surface.flat:
        surface = _agree(_drop_faces(surface))
    return _turn_parts(surface)


def count_of(n: int, noun: str) -> str:
    """Return a number with its noun, in the plural where it must be.

    Examples
    --------
    >>> count_of(1, "loop"), count_of(2, "loop")
    ('1 loop', '2 loops')
    """
    return f"{n} {noun}" if n == 1 else f"{n} {noun}s"


def _distinct_rows(rows: NDArray[Any]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return the first place of each distinct row, and which of them each row is."""
    order = np.lexsort(rows.T)
    ordered = rows[order]
    new = np.ones(len(rows), bool)
    new[1:] = (ordered[1:] != ordered[:-1]).any(axis=1)
    index = np.empty(len(rows), np.int64)
    index[order] = np.cumsum(new) - 1
    return order[new], index


def _connect(edges: NDArray[np.int64], n: int) -> tuple[int, NDArray[np.int64]]:
    """Return the number of connected components of a graph and the component of each node."""
    graph = coo_array((np.ones(len(edges), bool), (edges[:, 0], edges[:, 1])), shape=(n, n))
    count, label = connected_components(graph, directed=False)
    return int(count), label


def _drop_faces(surface: Surface) -> Surface:
    """Drop faces with a repeated corner, and all but one of the faces with the same corners."""
    ordered = np.sort(surface.faces, axis=1)
    proper = np.flatnonzero((ordered[:, 0] != ordered[:, 1]) & (ordered[:, 1] != ordered[:, 2]))
    first, _ = _distinct_rows(ordered[proper])
    repairs = []
    if n := len(surface.faces) - proper.size:
        repairs.append(f"dropped {count_of(n, 'degenerate face')}")
    if n := proper.size - first.size:
        repairs.append(f"dropped {count_of(n, 'repeated face')}")
    return surface.with_faces(surface.faces[proper[np.sort(first)]], *repairs) if repairs else surface


def _agree(surface: Surface) -> Surface:
    """Turn faces to agree across edges of two faces, in each patch the fewest that do it.

    Each face is two nodes of a graph, as it is and turned. Faces at an edge join side by side
    where they agree and crosswise where not; a patch that can be oriented is then two components.
    """
    n = len(surface.faces)
    start, stop = surface.faces.reshape(-1), np.roll(surface.faces, -1, axis=1).reshape(-1)
    key = np.minimum(start, stop) * len(surface.vertices) + np.maximum(start, stop)
    order = np.argsort(key, kind="stable")
    _, first, count = np.unique(key[order], return_index=True, return_counts=True)
    one, two = order[first[count == 2]], order[first[count == 2] + 1]
    clash = (start[one] == start[two]).astype(np.int64)
    if not clash.any():
        return surface
    one, two = one // 3, two // 3
    first_sides = np.stack([one, two + n * clash], axis=1)
    other_sides = np.stack([one + n, two + n * (1 - clash)], axis=1)
    n_labels, label = _connect(np.concatenate([first_sides, other_sides]), 2 * n)
    as_is, turned = label[:n], label[n:]
    size = np.bincount(as_is, minlength=n_labels)
    flip = (size[turned] > size[as_is]) | ((size[turned] == size[as_is]) & (turned < as_is))
    if not flip.any():
        return surface
    faces = np.where(flip[:, None], surface.faces[:, ::-1], surface.faces)
    return surface.with_faces(
        faces, f"flipped {np.count_nonzero(flip)} of {n} faces to agree with their neighbours"
    )


def _turn_parts(surface: Surface) -> Surface:
    """Turn parts wound inside out: all if the volume is negative, then those that are no hollows."""
    edges = np.concatenate([surface.faces[:, :2], surface.faces[:, 1:]])
    count, label = _connect(edges, len(surface.vertices))
    part = label[surface.faces[:, 0]]
    turn = part_turns(surface.triangles, part, np.bincount(part, surface.face_volumes, count))
    if not (turn < 0).any():
        return surface
    turned = (turn < 0)[part]
    faces = np.where(turned[:, None], surface.faces[:, ::-1], surface.faces)
    n, used = np.unique(part[turned]).size, np.unique(part).size
    what = "the surface" if n == used else f"{n} of {used} parts"
    return surface.with_faces(faces, f"turned {what} right side out")
