"""Left and right: limbs that only a mirror tells apart keep their sides from pose to pose."""

from __future__ import annotations

import itertools
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from spem.decomposition.part_graph import part_graph
from spem.decomposition.parts import Parts

Array = NDArray[np.float64]

# Two parts are a pair when the roots of their sizes, and their distances to all other parts, differ by no
# more than these shares. Legs of one animal differ by a tenth, and legs from a tail by a third.
_SIZES = 0.2
_DISTANCES = 0.2
# A pair is exchanged when its side differs this clearly; the sides of two poses correlate by 0.6 and more.
_CLEAR = 0.3


def settle_hands(parts: Sequence[Parts], reference: int) -> tuple[Parts, ...]:
    """Exchange the numbers of paired parts that lie on the other side than in the reference.

    Interactions do not tell a body from its mirror image, so left and right limbs may have been exchanged. In
    three dimensions and more a body is never its own mirror image: the volumes that a pair spans with other
    parts change sign when it is exchanged. Silhouettes are left alone, for they may be seen from either side.

    Parameters
    ----------
    parts
        Parts of each shape, under one numbering.
    reference
        The shape whose sides count.

    Returns
    -------
    Parts of each shape, the reference's unchanged.
    """
    own = parts[reference]
    if own.shape.ndim < 3 or len(parts) < 2:
        return tuple(parts)
    pairs = _pairs(own)
    marks = [_marks(p, pairs) for p in parts]
    return tuple(_settled(p, pairs, marks[reference], m) for p, m in zip(parts, marks, strict=True))


def _pairs(parts: Parts) -> list[tuple[int, int]]:
    """Pairs of parts that are alike in size and in their distances to all others; most alike first."""
    graph, k = part_graph(parts), parts.n_parts
    root = graph.traits[:, 0]
    found = []
    for i, j in itertools.combinations(np.flatnonzero(root > 0).tolist(), 2):
        rest = np.setdiff1d(np.arange(k), (i, j))
        if not rest.size or abs(root[i] - root[j]) > _SIZES * max(root[i], root[j]):
            continue
        both = graph.distances[[i, j]][:, rest]
        difference = np.sqrt(np.mean(np.square(both[0] - both[1])) / np.mean(np.square(both)))
        if difference <= _DISTANCES:
            found.append((float(difference), i, j))
    pairs: list[tuple[int, int]] = []
    for _, i, j in sorted(found):
        if not {i, j} & set(itertools.chain(*pairs)):
            pairs.append((i, j))
    return pairs


def _marks(parts: Parts, pairs: list[tuple[int, int]]) -> Array:
    """Volumes ``(n_pairs, n_tuples)`` spanned by each pair and landmarks: lone parts and middles of pairs."""
    points, d = parts.shape.points / parts.shape.size, parts.shape.ndim
    centre = np.full((parts.n_parts, d), np.nan)
    for j in np.unique(parts.node_labels[parts.node_labels >= 0]):
        centre[j] = points[parts.node_labels == j].mean(axis=0)
    lone = np.setdiff1d(np.arange(parts.n_parts), np.ravel(pairs).astype(int))
    landmarks = np.vstack([centre[lone], *((centre[i] + centre[j])[None] / 2 for i, j in pairs)])
    tuples = np.array(list(itertools.combinations(range(len(landmarks)), d)), int).reshape(-1, d)
    spans = landmarks[tuples[:, 1:]] - landmarks[tuples[:, :1]]  # (n_tuples, d - 1, d)
    volumes = np.empty((len(pairs), len(tuples)))
    for row, (i, j) in zip(volumes, pairs, strict=True):
        across = np.broadcast_to(centre[i] - centre[j], (len(tuples), 1, d))
        with np.errstate(invalid="ignore"):  # of parts that this shape does not have
            row[:] = np.linalg.det(np.concatenate([spans, across], axis=1))
    return np.nan_to_num(volumes)


def _settled(parts: Parts, pairs: list[tuple[int, int]], wanted: Array, marks: Array) -> Parts:
    """Exchange the pairs whose volumes have the sign opposite to those wanted."""
    order = np.arange(parts.n_parts)
    for (i, j), a, b in zip(pairs, wanted, marks, strict=True):
        if a @ b < -_CLEAR * np.linalg.norm(a) * np.linalg.norm(b):
            order[[i, j]] = order[[j, i]]
    return parts if np.array_equal(order, np.arange(order.size)) else parts.relabelled(order)
