"""The order of rows: cells of the grids of a batch, colour by colour in bricks, and the marked ones numbered.

A brick is a cube of voxels whose red ones, and whose black ones, fill a tile or two. Rows that follow bricks
make tiles compact, so that the rows of a tile share their neighbours.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from spem.fields.solvers.cuda.layout import Layout
from spem.fields.solvers.cuda.runtime import TILE, Runtime

#: Bytes of a cell: its mark, the cumulative sum, and as much again in case that is not made in place.
CELL_BYTES = 1 + 4 + 4


def brick_side(d: int) -> int:
    """Voxels along a side of a brick of d dimensions.

    Examples
    --------
    >>> [brick_side(d) ** d for d in (1, 2, 3, 4)]
    [256, 256, 512, 256]
    """
    return int({1: 2 * TILE, 2: 16, 3: 8, 4: 4}.get(d, 2))


def first_cells(grid: NDArray[Any], wanted: NDArray[np.bool_]) -> NDArray[np.int64]:
    """Return the first red and the first black cell of each system, and the number of all cells.

    Parameters
    ----------
    grid
        ``(n_systems, d)`` voxels along each axis; cells are those of whole bricks, half of each colour.
    wanted
        ``(n_systems,)`` which systems have cells at all.

    Returns
    -------
    NDArray
        ``(2 n_systems + 1,)``.

    Examples
    --------
    >>> first_cells(np.array([[16, 17], [5, 5]]), np.array([True, True]))
    array([  0, 256, 512, 640, 768])
    """
    d = grid.shape[1]
    side = brick_side(d)
    bricks = np.prod(-(-grid.astype(np.int64) // side), axis=1)
    cells = np.where(wanted, bricks * side**d // 2, 0)
    return np.cumsum(np.concatenate([[0], np.repeat(cells, 2)]), dtype=np.int64)


def lay_out(marks: Any, first_cell: NDArray[np.int64], runtime: Runtime) -> tuple[Layout, Any, Any]:
    """Lay out marked cells, numbered within their system and colour.

    Parameters
    ----------
    marks
        int8 on the device, 1 for cells that have a row.
    first_cell
        `first_cells` of the systems.
    runtime
        The device.

    Returns
    -------
    tuple
        The layout; the number of marked cells up to each, int32; and ``(n_systems, 2)`` what to add to it for
        the row of a red and of a black cell. Both are on the device.
    """
    n_marked = runtime.xp.cumsum(marks, dtype=np.int32)
    last = runtime.upload(np.maximum(first_cell - 1, 0))
    before = np.where(first_cell > 0, runtime.download(n_marked[last]), 0).astype(np.int64)
    layout = Layout.of(np.diff(before).reshape(-1, 2), runtime)
    base = layout.first_row - before[:-1].reshape(-1, 2) - 1
    return layout, n_marked, runtime.upload(base)
