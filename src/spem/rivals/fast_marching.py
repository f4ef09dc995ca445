"""Geodesic distances around a vertex of a triangle surface, by fast marching.

Hundreds of small disks are wanted of each surface: the heat method of potpourri3d, which factors it at each
scale and covers all of it, took five times longer.
"""

from __future__ import annotations

import heapq
from dataclasses import dataclass
from typing import Self

import numpy as np
from numba import njit
from numpy.typing import NDArray


@dataclass(frozen=True, eq=False)
class Fans:
    """The faces around each vertex.

    Parameters
    ----------
    first
        ``(n_vertices + 1,)`` where the faces of each vertex start in `others`.
    others
        ``(3 n_faces, 2)`` the two other corners of each face.
    """

    first: NDArray[np.int64]
    others: NDArray[np.int64]

    @classmethod
    def of(cls, faces: NDArray[np.int64], n_vertices: int) -> Self:
        """Sort the faces of a surface by their vertices."""
        turned = np.concatenate([np.roll(faces, -shift, axis=1) for shift in range(3)])
        order = np.argsort(turned[:, 0], kind="stable")
        first = np.concatenate([[0], np.cumsum(np.bincount(turned[:, 0], minlength=n_vertices))])
        return cls(first, np.ascontiguousarray(turned[order, 1:]).astype(np.int64))


def geodesic_disk(
    vertices: NDArray[np.float64], fans: Fans, source: int, radius: float
) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Find the vertices within a geodesic radius of a vertex, and their distances.

    Fronts cross a face as circles about a virtual source (Novotni and Klein, "Computing geodesic distances on
    triangular meshes", WSCG 2002): exact on a plane, but too long where they come to an obtuse corner.

    Parameters
    ----------
    vertices
        ``(n_vertices, 3)`` coordinates.
    fans
        The faces around each vertex.
    source
        The vertex at distance zero.
    radius
        The largest distance.

    Returns
    -------
    vertices, distances : numpy.ndarray
        ``(n_near,)`` each, nearest first; the source is the first.

    Examples
    --------
    >>> corners = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])
    >>> square = np.array([[0, 1, 3], [1, 2, 3]])
    >>> near, distances = geodesic_disk(corners, Fans.of(square, 4), 0, 1.2)
    >>> near.tolist(), distances.tolist()
    ([0, 1, 3], [0.0, 1.0, 1.0])
    """
    points = np.ascontiguousarray(vertices, np.float64)
    near, distances = _march(points, fans.first, fans.others, source, radius)
    return np.asarray(near), np.asarray(distances)


@njit(cache=True, nogil=True)
def _across(a: float, b: float, ab: float, ac: float, bc: float) -> float:
    """Return the distance of C from that of A and B, by the source in their plane that has both."""
    along_edges = min(a + ac, b + bc)
    if ab == 0.0:
        return along_edges
    x = (a * a - b * b + ab * ab) / (2 * ab)
    p = (ac * ac - bc * bc + ab * ab) / (2 * ab)
    depth, height = a * a - x * x, ac * ac - p * p
    if depth <= 0.0 or height <= 0.0:
        return along_edges
    below, above = np.sqrt(depth), np.sqrt(height)
    crossing = x + (p - x) * below / (below + above)
    if crossing < 0.0 or crossing > ab:
        return along_edges
    return min(along_edges, float(np.hypot(p - x, below + above)))


@njit(cache=True, nogil=True)
def _length(points: NDArray[np.float64], i: int, j: int) -> float:
    """Return the length of an edge."""
    x, y, z = points[i, 0] - points[j, 0], points[i, 1] - points[j, 1], points[i, 2] - points[j, 2]
    return float(np.sqrt(x * x + y * y + z * z))


@njit(cache=True, nogil=True)
def _march(
    points: NDArray[np.float64],
    first: NDArray[np.int64],
    others: NDArray[np.int64],
    source: int,
    radius: float,
) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Settle vertices in order of their distance, until the radius."""
    n = len(points)
    distance, settled = np.full(n, np.inf), np.zeros(n, np.bool_)
    near, n_near = np.empty(n, np.int64), 0
    distance[source] = 0.0
    heap = [(0.0, source)]
    while heap:
        reached, v = heapq.heappop(heap)
        if settled[v]:
            continue
        settled[v] = True
        near[n_near] = v
        n_near += 1
        for k in range(first[v], first[v + 1]):
            for side in range(2):
                c, b = others[k, side], others[k, 1 - side]
                if settled[c]:
                    continue
                vc = _length(points, v, c)
                found = reached + vc
                if settled[b]:
                    found = _across(reached, distance[b], _length(points, v, b), vc, _length(points, b, c))
                if found < distance[c] and found <= radius:
                    distance[c] = found
                    heapq.heappush(heap, (found, c))
    return near[:n_near], distance[near[:n_near]]
