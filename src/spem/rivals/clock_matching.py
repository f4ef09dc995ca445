"""Clock matching: the distance of two sets of views, least over the symmetries of the axes they stand on."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from joblib import Parallel, delayed
from numba import njit
from numpy.typing import NDArray

from spem.fields.solvers.team import usable_threads
from spem.rivals.view_sphere import view_permutations


@dataclass(frozen=True, eq=False)
class ViewHistograms:
    """Counts of words in each view of a shape, those that are not zero.

    Parameters
    ----------
    starts
        ``(n_views + 1,)`` where the words of each view start.
    words
        Numbers of words.
    counts
        How often each is in its view.
    """

    starts: NDArray[np.int64]
    words: NDArray[np.int64]
    counts: NDArray[np.float32]


def count_words(words: NDArray[np.int64], starts: NDArray[np.int64]) -> ViewHistograms:
    """Count the words of each view.

    Parameters
    ----------
    words
        ``(n_features,)`` word of each feature, view after view.
    starts
        ``(n_views + 1,)`` where the features of each view start.

    Examples
    --------
    >>> found = count_words(np.array([7, 2, 7, 2]), np.array([0, 3, 4]))
    >>> found.words, found.counts, found.starts
    (array([2, 7, 2]), array([1., 2., 1.], dtype=float32), array([0, 2, 3]))
    """
    n_views = len(starts) - 1
    view = np.repeat(np.arange(n_views), np.diff(starts))
    pairs, counts = np.unique(np.stack([view, words]), axis=1, return_counts=True)
    first = np.searchsorted(pairs[0], np.arange(n_views + 1))
    return ViewHistograms(first, np.ascontiguousarray(pairs[1]), counts.astype(np.float32))


def clock_distances(
    shapes: Sequence[ViewHistograms], mirrored: Sequence[ViewHistograms], n_words: int
) -> NDArray[np.float64]:
    """Compare the views of all pairs of shapes, in the best of the 48 ways to match their axes.

    The distance of two views is 1 − Σ min(h₁, h₂) / max(Σh₁, Σh₂), that of two shapes the mean over their
    views. A reflection matches the views of one shape with mirrored views of the other.

    Parameters
    ----------
    shapes
        Histograms of the views of each shape, views in the order of `geodesic_sphere`.
    mirrored
        The same of its mirrored views.
    n_words
        Number of words.

    Returns
    -------
    numpy.ndarray
        ``(n_shapes, n_shapes)`` in [0, 1], symmetric, zero on the diagonal.

    Examples
    --------
    >>> views = [count_words(np.full(66, word), np.arange(67)) for word in (0, 0, 1)]
    >>> clock_distances(views, views, 2)
    array([[0., 0., 1.],
           [0., 0., 1.],
           [1., 1., 0.]])
    """
    n, permutations = len(shapes), view_permutations()
    plain, other = _join(shapes), _join(mirrored)
    rows = Parallel(n_jobs=usable_threads(), prefer="threads")(
        delayed(_match_row)(row, *plain, *other, permutations, n_words) for row in range(n - 1)
    )
    found = np.zeros((n, n))
    for row, values in enumerate(rows):
        found[row, row + 1 :] = values
    return found + found.T


def _join(
    shapes: Sequence[ViewHistograms],
) -> tuple[NDArray[np.int64], NDArray[np.int32], NDArray[np.float32]]:
    """Return the histograms of all shapes in one: starts ``(n_shapes, n_views + 1)``, words, counts."""
    offsets = np.cumsum([0] + [len(shape.words) for shape in shapes[:-1]])
    starts = np.stack([shape.starts for shape in shapes]) + offsets[:, None]
    words = np.concatenate([shape.words for shape in shapes]).astype(np.int32)
    return starts, words, np.concatenate([shape.counts for shape in shapes])


@njit(cache=True, nogil=True)
def _match_row(  # pragma: no cover
    row: int,
    starts: NDArray[np.int64],
    words: NDArray[np.int32],
    counts: NDArray[np.float32],
    mirror_starts: NDArray[np.int64],
    mirror_words: NDArray[np.int32],
    mirror_counts: NDArray[np.float32],
    permutations: NDArray[np.int64],
    n_words: int,
) -> NDArray[np.float64]:
    """Return the distances of one shape to those after it."""
    n, n_views = starts.shape[0], starts.shape[1] - 1
    dense = np.zeros((n_views, n_words), np.float32)
    total = np.zeros(n_views, np.float32)
    for view in range(n_views):
        for at in range(starts[row, view], starts[row, view + 1]):
            dense[view, words[at]] = counts[at]
            total[view] += counts[at]
    found = np.empty(n - row - 1)
    for other in range(row + 1, n):
        best = float(n_views)
        for symmetry in range(permutations.shape[0]):
            if symmetry < permutations.shape[0] // 2:
                first, word, count = starts[other], words, counts
            else:
                first, word, count = mirror_starts[other], mirror_words, mirror_counts
            distance = 0.0
            for view in range(n_views):
                seen = permutations[symmetry, view]
                common, size = 0.0, 0.0
                for at in range(first[seen], first[seen + 1]):
                    common += min(dense[view, word[at]], count[at])
                    size += count[at]
                size = max(size, float(total[view]))
                if size > 0:
                    distance += 1.0 - common / size
                if distance >= best:
                    break
            best = min(best, distance)
        found[other - row - 1] = best / n_views
    return found
