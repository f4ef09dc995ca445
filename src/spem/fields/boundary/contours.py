"""How the faces of a boundary hang together: their neighbours, contours and true areas.

Each boundary edge crosses one face between voxels. Turning about a ridge of that face, over the cells that
meet there, one comes to exactly one next face; so every face has one neighbour across each of its ridges,
the two sides of a crack have different faces, and in 2-D the faces fall into closed contours.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from spem.fields.domain import Domain

# Slot of `face_neighbours` that goes on with the shape on the left, by direction of the boundary edge (2-D).
_ONWARD = np.array([0, 1, 1, 0])
# Quarter turns of the outward normal from axis 0, by direction (2-D).
_QUARTER = np.array([2, 0, 3, 1])
# Standard deviation, in faces, of the average that makes normals of a staircase: less leaves steps of slope
# 1/8 seen, more rounds the ends of limbs.
_SMOOTHING = 2.0
# A face that lies nearly along the surface still stands for this part of its area: no point stands for none.
_LEAST = 1e-2


def face_neighbours(domain: Domain) -> NDArray[np.int32]:
    """Find the neighbours of the face that each boundary edge crosses.

    Two inside voxels are neighbours across an uncut edge only, so voxels that touch at a corner do not join
    their boundaries.

    Parameters
    ----------
    domain
        Neighbours and boundary edges of a shape.

    Returns
    -------
    neighbours
        ``(n_boundary_edges, 2 (d - 1))`` boundary edge across each ridge: for each of the other axes in turn,
        toward lower and toward higher indices. An edge may stand twice in a row, once in each direction.

    Examples
    --------
    >>> import numpy as np
    >>> from spem.fields.domain import voxel_domain
    >>> from spem.shapes.shape import Shape
    >>> face_neighbours(voxel_domain(Shape.from_mask(np.ones((1, 1)))))
    array([[2, 3],
           [2, 3],
           [0, 1],
           [0, 1]], dtype=int32)
    """
    n, directions = domain.neighbours.shape
    node, direction = domain.boundary_edges
    edge = np.full((n, directions), -1, np.int32)
    edge[node, direction] = np.arange(node.size, dtype=np.int32)
    return np.asarray(_turn(domain.neighbours, edge, node, direction))


def trace_contours(domain: Domain, area: NDArray[np.float64]) -> tuple[NDArray[np.int64], NDArray[np.int32]]:
    """Follow the contours of a 2-D shape over its boundary edges, with the shape on the left.

    Left is seen with axis 0 to the right and axis 1 up, or, just the same, with row 0 on top and column 0 at
    the left. Each contour starts at its first edge in node order.

    Parameters
    ----------
    domain
        Neighbours and boundary edges of a 2-D shape.
    area
        ``(n_boundary_edges,)`` length of the boundary that each edge stands for.

    Returns
    -------
    order
        ``(n_boundary_edges,)`` the boundary edges along the contours, each once.
    contour
        ``(n_boundary_edges,)`` contour of each edge, in edge order: outer ones first, by length, then holes
        and cracks by length.

    Examples
    --------
    >>> import numpy as np
    >>> from spem.fields.domain import voxel_domain
    >>> from spem.shapes.shape import Shape
    >>> order, contour = trace_contours(voxel_domain(Shape.from_mask(np.ones((1, 1)))), np.ones(4))
    >>> order.tolist(), contour.tolist()
    ([0, 2, 1, 3], [0, 0, 0, 0])
    """
    _, direction = domain.boundary_edges
    onward = face_neighbours(domain)[np.arange(direction.size), _ONWARD[direction]]
    order, contour, hole = _follow(onward, _QUARTER[direction])
    length = np.bincount(contour, area)
    rank = np.empty(hole.size, np.int32)
    rank[np.lexsort((-length, hole))] = np.arange(hole.size, dtype=np.int32)
    contour = rank[contour]
    return order[np.argsort(contour[order], kind="stable")], contour


def face_areas(domain: Domain, spacing: tuple[float, ...]) -> NDArray[np.float64]:
    """Estimate the area of the boundary that each boundary edge stands for, in units of spacing^(d-1).

    A face of area f across axis a stands for f |n_a|, n being the normal: summed over a plane this is its
    area, whatever its slope. Normals are averages of the area vectors of faces next to each other, so they
    never see another sheet of the boundary. Smooth boundaries come out right to 1 %; the ends of limbs and
    the edges of boxes are rounded, over two faces or so.

    Parameters
    ----------
    domain
        Neighbours and boundary edges of a shape.
    spacing
        ``(d,)`` distance between voxel centres along each axis.

    Returns
    -------
    area
        ``(n_boundary_edges,)`` areas, all positive: lengths in 2-D, 1 in 1-D.

    Examples
    --------
    >>> from spem.fields.domain import surface_domain
    >>> from spem.shapes.synthetic import disk
    >>> shape = disk(1.0, 0.02)
    >>> round(float(face_areas(surface_domain(shape), shape.spacing).sum() / np.pi), 1)
    2.0
    """
    _, direction = domain.boundary_edges
    face = np.prod(spacing) / np.asarray(spacing)
    own = np.zeros((direction.size, face.size))
    own[np.arange(direction.size), direction // 2] = np.where(direction % 2, 1.0, -1.0) * face[direction // 2]
    neighbours = face_neighbours(domain)
    degree = neighbours.shape[1]
    # one step moves along each of the d - 1 axes of the surface with variance 2 / (degree + 1)
    steps = round(_SMOOTHING**2 * (degree + 1) / 2) if degree else 0
    normal = _smooth(own, neighbours, steps)
    along = np.einsum("ea,ea->e", normal, own) / np.linalg.norm(normal, axis=1)
    return np.asarray(np.maximum(along, _LEAST * face[direction // 2]))


@njit(cache=True, nogil=True)
def _turn(
    neighbours: NDArray[np.int32],
    edge: NDArray[np.int32],
    node: NDArray[np.int64],
    direction: NDArray[np.int64],
) -> NDArray[np.int32]:
    """Turn about each ridge of each face, away from the face, to the first cut edge."""
    n, directions = neighbours.shape
    result = np.empty((node.size, directions - 2), np.int32)
    for e in range(node.size):
        i, k = node[e], direction[e]
        slot = 0
        for side in range(directions):
            if side // 2 == k // 2:
                continue
            # the cells about the ridge, in turn: i, beside it, beside and across, across from i
            beside = neighbours[i, side]
            if beside == n:
                following = edge[i, side]
            else:
                diagonal = neighbours[beside, k]
                if diagonal == n:
                    following = edge[beside, k]
                else:
                    across = neighbours[diagonal, side ^ 1]
                    following = edge[diagonal, side ^ 1] if across == n else edge[across, k ^ 1]
            result[e, slot] = following
            slot += 1
    return result


@njit(cache=True, nogil=True)
def _follow(
    onward: NDArray[np.int32], quarter: NDArray[np.int64]
) -> tuple[NDArray[np.int64], NDArray[np.int32], NDArray[np.bool_]]:
    """Order of the edges along the contours, contour of each edge, and which contours turn the wrong way."""
    n = onward.size
    order, contour, hole = np.empty(n, np.int64), np.full(n, -1, np.int32), np.empty(n, np.bool_)
    at, count = 0, 0
    for start in range(n):
        if contour[start] >= 0:
            continue
        turns, e = 0, start
        while contour[e] < 0:
            contour[e] = count
            order[at] = e
            at += 1
            turn = (quarter[onward[e]] - quarter[e]) % 4
            # a half turn happens at the tip of a crack only, to the right
            turns += turn - 4 if turn >= 2 else turn
            e = onward[e]
        hole[count] = turns < 0
        count += 1
    return order, contour, hole[:count].copy()


@njit(cache=True, nogil=True)
def _smooth(own: NDArray[np.float64], neighbours: NDArray[np.int32], steps: int) -> NDArray[np.float64]:
    """Average over each face and its neighbours, so many times."""
    n, degree = neighbours.shape
    d = own.shape[1]
    old, new = own.copy(), np.empty_like(own)
    for _ in range(steps):
        for e in range(n):
            for a in range(d):
                total = old[e, a]
                for k in range(degree):
                    total += old[neighbours[e, k], a]
                new[e, a] = total / (degree + 1)
        old, new = new, old
    return old
