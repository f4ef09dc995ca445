"""Node values continued past the surface, so that pictures interpolate right up to it."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from scipy.ndimage import uniform_filter

from spem.plots.values import node_values

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    from spem.shapes.shape import Shape

# Nodes an outside voxel is continued from: those at most one voxel away along each axis.
WINDOW = 3


def extend_values(
    shape: Shape, values: ArrayLike, level: NDArray[np.float64], *, boundary: float | None = None
) -> NDArray[np.float64]:
    """Return node values on the grid, continued to the voxels just outside the shape.

    With a known value on the surface, an outside voxel lies on the line through that value that fits
    the nodes around it, over their depth below the surface; so interpolation gives that value on
    the surface. Otherwise it is the mean of the nodes around it.

    Parameters
    ----------
    shape
        The shape.
    values
        ``(n_nodes,)`` one value a node.
    level
        From `spem.plots.level.surface_level`.
    boundary
        Value on the surface, where it is known.

    Returns
    -------
    extended
        ``(n_0, ..., n_{d-1})`` values, finite everywhere; those of the nodes are kept.

    Raises
    ------
    ParameterError
        If there is not one value for each node.

    Examples
    --------
    >>> from spem.shapes.shape import Shape
    >>> shape = Shape.from_mask([1, 1])
    >>> extend_values(shape, [0.5, 0.5], np.array([-0.5, 0.5, 0.5, -0.5]), boundary=1.0)
    array([1.5, 0.5, 0.5, 1.5])
    """
    nodal = node_values(shape, values)
    inside = shape.mask
    grid = shape.to_grid(nodal, fill=0.0)
    if boundary is None:
        total, share = (uniform_filter(a, WINDOW, mode="constant") for a in (grid, inside.astype(np.float64)))
        around = np.divide(total, share, out=np.full(grid.shape, nodal.mean()), where=share > 1e-9)
    else:
        depth = np.where(inside, level, 0.0)
        rise = uniform_filter((grid - boundary) * depth, WINDOW, mode="constant")
        square = uniform_filter(depth**2, WINDOW, mode="constant")
        slope = np.divide(rise, square, out=np.zeros(grid.shape), where=square > 1e-9)
        around = boundary + slope * np.minimum(level, 0.0)
    extended: NDArray[np.float64] = np.where(inside, grid, around)
    return extended
