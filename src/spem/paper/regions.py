"""What maps mark: the boundary, the middle, what sticks out; and how smooth they are."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import ndimage
from scipy.stats import rankdata

from spem.shapes.shape import Shape

# A slice of equal depth says something if it has as many nodes of either kind.
LEAST_NODES = 20


def separation(values: ArrayLike, marked: ArrayLike) -> float:
    """Return how well values tell marked nodes from the others: the area under the ROC curve.

    It is the probability that a marked node has the higher value: 1 or 0 where values tell them apart, one
    half where they say nothing.

    Examples
    --------
    >>> separation([1.0, 2.0, 3.0, 4.0], [False, False, True, True])
    1.0
    """
    inside = np.asarray(marked, bool)
    n_marked, n_other = int(inside.sum()), int((~inside).sum())
    ranks = rankdata(np.asarray(values, np.float64))
    return float((ranks[inside].sum() - n_marked * (n_marked + 1) / 2) / (n_marked * n_other))


def separation_at_depth(values: ArrayLike, marked: ArrayLike, depth: ArrayLike) -> float:
    """Return `separation` among nodes of equal depth, averaged over slices one pixel thick.

    What depends on the depth alone gives one half.

    Parameters
    ----------
    values, marked
        As for `separation`.
    depth
        ``(n_nodes,)`` distance to the boundary in pixels; the outermost two are left out.

    Returns
    -------
    separation
        The mean over the slices that have enough nodes of both kinds; one half where none has.

    Examples
    --------
    >>> depth, marked = np.repeat([2.5, 3.5], 60), np.tile([True, False], 60)
    >>> separation_at_depth(depth, marked, depth), separation_at_depth(marked, marked, depth)
    (0.5, 1.0)
    """
    value, inside = np.asarray(values, np.float64), np.asarray(marked, bool)
    steps = np.floor(np.asarray(depth, np.float64)).astype(np.int64)
    found = []
    for step in range(2, int(steps.max()) + 1):
        here = steps == step
        if min(int(inside[here].sum()), int((~inside[here]).sum())) >= LEAST_NODES:
            found.append(separation(value[here], inside[here]))
    return float(np.mean(found)) if found else 0.5


def roughness(shape: Shape, values: NDArray[np.floating[Any]]) -> NDArray[np.float64]:
    """Return how much maps change from a node to the next: root mean square, in standard deviations.

    Parameters
    ----------
    shape
        The shape.
    values
        ``(n_nodes, n_maps)``.

    Returns
    -------
    roughness
        ``(n_maps,)``, per voxel.

    Examples
    --------
    >>> shape = Shape.from_mask(np.ones(4))
    >>> roughness(shape, np.array([[0.0], [1.0], [0.0], [1.0]]))
    array([2.])
    """
    grid = shape.to_grid(values)
    steps = [np.diff(grid, axis=axis).reshape(-1, values.shape[1]) for axis in range(shape.ndim)]
    square = np.square(np.concatenate(steps))
    return np.asarray(np.sqrt(np.nanmean(square, axis=0)) / values.std(axis=0))


def region_sizes(shape: Shape, inside: ArrayLike, least: float = 0.005) -> list[float]:
    """Return the sizes of the connected pieces of a region, as shares of the shape, largest first.

    Parameters
    ----------
    shape
        The shape.
    inside
        ``(n_nodes,)`` True in the region; nodes that touch at a corner are connected.
    least
        Pieces below this share are left out.

    Examples
    --------
    >>> region_sizes(Shape.from_mask(np.ones(10)), [1, 1, 1, 0, 0, 0, 0, 1, 0, 0])
    [0.3, 0.1]
    """
    grid = np.zeros(shape.mask.shape, bool)
    grid[shape.mask] = np.asarray(inside, bool)
    label, count = ndimage.label(grid, np.ones((3,) * shape.ndim))
    sizes = np.sort(np.bincount(label[grid], minlength=count + 1)[1:])[::-1] / shape.n_nodes
    return [float(size) for size in sizes if size >= least]
