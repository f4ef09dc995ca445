"""Parts of a surface that are wound inside out: the hollows of others, or to be turned."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import igl
import numpy as np
from numpy.typing import NDArray

# The winding number of a closed part is one inside it and zero outside, that of one with holes about so.
INSIDE = 0.5
# Points that stand for a face: its middle, and one near each corner, drawn in so that it lies on this
# face alone; and the part of the face's size by which they are moved behind it, so that where parts
# share a wall they are not on it.
_MARKS = np.concatenate([np.full((1, 3), 1 / 3), np.full((3, 3), 0.01) + 0.97 * np.eye(3)])
_BEHIND = 1e-4
# Volumes that agree so far are equal to rounding: of two such parts neither holds the other.
_EQUAL = 1e-9


def part_turns(
    triangles: NDArray[np.float64], part: NDArray[np.integer], volume: NDArray[Any]
) -> NDArray[np.float64]:
    """Tell which parts of a surface must be turned for all to be solids or hollows of solids.

    All are turned if the sum of their volumes is negative. Of the parts whose volume is negative
    then, the largest first, those are hollows that lie wholly within solids, and not wholly within
    the hollows of these; the others are turned.

    Parameters
    ----------
    triangles
        ``(n_faces, 3, 3)`` corner coordinates.
    part
        ``(n_faces,)`` number of the part of each face.
    volume
        ``(n_parts,)`` signed volume of each part.

    Returns
    -------
    numpy.ndarray
        ``(n_parts,)``, -1 for the parts to be turned and 1 for others.

    Examples
    --------
    >>> corners = np.array([[0.0, 0, 0], [3, 0, 0], [0, 3, 0], [0, 0, 3]])
    >>> solid = corners[[[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]]
    >>> hollow, beside = 0.5 * solid[:, ::-1] + 0.2, 0.8 * solid[:, ::-1] + 1.5
    >>> part = np.repeat([0, 1, 2], 4)
    >>> part_turns(np.concatenate([solid, hollow, beside]), part, np.array([4.5, -0.5625, -2.304]))
    array([ 1.,  1., -1.])
    """
    whole = -1.0 if volume.sum() < 0 else 1.0
    volume = whole * volume
    turn = np.full(volume.size, whole)
    backward = np.flatnonzero(volume < 0)
    if not backward.size:
        return turn
    wound = triangles if whole > 0 else triangles[:, ::-1]
    backward = backward[np.argsort(volume[backward], kind="stable")]
    for p, hollow in zip(backward, _are_hollows(wound, part, volume, backward), strict=True):
        turn[p] = whole if hollow else -whole
    return turn


def _are_hollows(
    triangles: NDArray[np.float64],
    part: NDArray[np.integer],
    volume: NDArray[np.float64],
    backward: NDArray[np.integer],
) -> Iterator[bool]:
    """Tell of parts of negative volume, the largest first, whether they are hollows or inside out."""
    rows = np.split(np.argsort(part, kind="stable"), np.cumsum(np.bincount(part, minlength=volume.size))[:-1])
    marks = [_marks(triangles[rows[p], ::-1]) for p in backward]
    # one tree of the solids known from the start serves all; what is found on the way comes on top
    known = _winding(triangles[(volume > 0)[part]], np.concatenate(marks))
    known_of = np.split(known, np.cumsum([len(points) for points in marks])[:-1])

    def among(parts: NDArray[np.bool_], points: NDArray[np.float64]) -> NDArray[np.float64]:
        chosen = np.concatenate([np.empty(0, np.int64), *(rows[q] for q in np.flatnonzero(parts))])
        return _winding(triangles[chosen], points)

    low, high = _boxes(triangles, part, volume.size)
    hollow, turned = np.zeros(volume.size, bool), np.zeros(volume.size, bool)
    for p, points, in_solids in zip(backward, marks, known_of, strict=True):
        near = ((low <= high[p]) & (high >= low[p])).all(axis=1)
        equal = np.abs(np.abs(volume) - abs(volume[p])) <= _EQUAL * abs(volume[p])
        in_solids = (
            in_solids - among(near & equal & (volume > 0), points) - among(near & ~equal & turned, points)
        )
        hollow[p] = (
            in_solids.min() >= INSIDE and (in_solids + among(near & ~equal & hollow, points)).max() > INSIDE
        )
        turned[p] = not hollow[p]
        yield bool(hollow[p])


def _marks(triangles: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return ``(4 n, 3)`` points just behind triangles: within the part that has them counter-clockwise."""
    normal = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    # a length, as twice the area is its square; a face without area has no normal and is not left
    side = np.sqrt(np.maximum(np.linalg.norm(normal, axis=1), np.finfo(np.float64).tiny))
    on_face = np.einsum("mc,ncx->nmx", _MARKS, triangles)
    return np.asarray((on_face - (_BEHIND * normal / side[:, None])[:, None]).reshape(-1, 3))


def _winding(triangles: NDArray[np.float64], points: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the winding number of triangles about points (Barill et al. 2018)."""
    if not len(triangles):
        return np.zeros(len(points))
    faces = np.arange(3 * len(triangles), dtype=np.int64).reshape(-1, 3)
    return np.asarray(igl.fast_winding_number(triangles.reshape(-1, 3), faces, points))


def _boxes(
    triangles: NDArray[np.float64], part: NDArray[np.integer], count: int
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the least and the greatest coordinates of each part; nothing meets the box of an empty one."""
    low, high = np.full((count, 3), np.inf), np.full((count, 3), -np.inf)
    np.minimum.at(low, part, triangles.min(axis=1))
    np.maximum.at(high, part, triangles.max(axis=1))
    return low, high
