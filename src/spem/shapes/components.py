"""The connected components of a shape: the largest is the shape, the rest are usually specks."""

from __future__ import annotations

from dataclasses import replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from spem.errors import ParameterError
from spem.shapes.shape import Cuts, Shape


def keep_components(shape: Shape, which: Literal["largest", "all"] = "largest") -> Shape:
    """Count the components of a shape, and keep the largest or all of them.

    Inside voxels that share a face belong together, unless the edge between them is cut: there two
    surfaces pass between them.

    Parameters
    ----------
    shape
        Any shape; it is not changed.
    which
        "largest" by volume (the first in C order of equals), or "all".

    Returns
    -------
    Shape
        Its report has `components`, `volume_kept` and, if any was dropped, a phrase about it.

    Raises
    ------
    ParameterError
        When `which` is neither word.

    Examples
    --------
    >>> two = Shape.from_mask([[1, 1, 1, 0, 1]])
    >>> keep_components(two).report.repairs
    ('kept the largest of 2 components (75 % of the volume)',)
    """
    if which not in ("largest", "all"):
        msg = f"{shape.name}: components={which!r}: expected 'largest' or 'all'"
        raise ParameterError(msg)
    labels, count = _label(shape)
    report = replace(shape.report, components=count)
    if count == 1 or which == "all":
        return replace(shape, report=report)
    sizes = np.bincount(labels.ravel())
    sizes[0] = 0
    largest = int(np.argmax(sizes))
    kept = float(sizes[largest] / shape.n_nodes)
    inside = labels == largest
    hold = inside.ravel()[shape.cuts.voxel]
    percent = min(100 * kept, 99.9) if kept > 0.99 else round(100 * kept)
    phrase = f"kept the largest of {count} components ({percent:.3g} % of the volume)"
    return Shape.from_mask(
        inside,
        shape.spacing,
        origin=shape.origin,
        name=shape.name,
        cuts=Cuts(shape.cuts.voxel[hold], shape.cuts.direction[hold], shape.cuts.fraction[hold]),
        report=replace(report, volume_kept=report.volume_kept * kept).with_repair(phrase),
        affine=shape.affine,
        surface=shape.surface,
    )


def _label(shape: Shape) -> tuple[NDArray[np.int32], int]:
    """Label the components from 1 on the grid of the shape, and count them."""
    mask = shape.mask
    steps = np.array([int(np.prod(mask.shape[axis + 1 :])) for axis in range(mask.ndim)])
    signed = np.stack([-steps, steps], axis=1).ravel()  # by direction
    flat = mask.ravel()
    other = shape.cuts.voxel + signed[shape.cuts.direction]
    between = flat[other]
    if not between.any():
        labels, count = ndimage.label(mask)
        return labels, int(count)
    # Cuts between inside voxels are few: the voxels at them become vertices of a graph, the
    # components of all others become its other vertices, and only edges at the former are listed.
    touched = np.unique(np.concatenate([shape.cuts.voxel[between], other[between]]))
    rest = mask.copy()
    rest.ravel()[touched] = False
    labels, count = ndimage.label(rest)
    labels.ravel()[touched] = count + 1 + np.arange(touched.size)
    start = np.repeat(touched, signed.size)
    direction = np.tile(np.arange(signed.size), touched.size)
    end = start + signed[direction]
    cut = np.isin(start * signed.size + direction, shape.cuts.voxel * signed.size + shape.cuts.direction)
    joins = flat[end] & ~cut
    pair = (labels.ravel()[start[joins]] - 1, labels.ravel()[end[joins]] - 1)
    total = count + touched.size
    graph = coo_array((np.ones(pair[0].size, bool), pair), shape=(total, total))
    number, merged = connected_components(graph, directed=False)
    table = np.concatenate([[0], merged + 1]).astype(np.int32)
    return table[labels], int(number)
