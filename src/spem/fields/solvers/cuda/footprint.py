"""Device memory that the levels of a batch take, before they are made."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from spem.fields.operator import System
from spem.fields.solvers.cuda.bricks import CELL_BYTES, first_cells
from spem.fields.solvers.cuda.runtime import TILE
from spem.fields.solvers.multigrid import COARSEST


class Footprint(NamedTuple):
    """Device memory in bytes.

    Parameters
    ----------
    peak
        While a hierarchy is made.
    held
        By the hierarchy afterwards.
    """

    peak: int
    held: int


def hierarchy_bytes(systems: Sequence[System]) -> Footprint:
    """Upper bounds of the memory that the hierarchy of systems of one dimension takes.

    A block that the shape does not fill touches a boundary edge, so there are no more blocks than boundary
    edges and full blocks together; this is close for solid shapes, and no count of the nodes is needed.
    """
    d = systems[0].shape.ndim
    nodes = np.array([system.n_nodes for system in systems], np.int64)
    edges = np.minimum(nodes, [system.domain.fraction.size for system in systems])
    grid = np.array([system.shape.mask.shape for system in systems], np.int64)
    n, rows = int(nodes.sum()), int((nodes + 2 * (TILE - 1)).sum())
    # rows of nodes, the table, and the diagonals in both precisions
    held = 4 * n + rows * (8 * d + 24)
    cells = int(first_cells(grid, np.ones(len(grid), np.bool_))[-1])
    numbered = 8 * n + max(CELL_BYTES * cells, 4 * cells + 4 * n + 8 * rows)
    peak = max(numbered, (4 + 8 * d) * n + (8 + 8 * d) * rows, 8 * n + 8 * rows + held)
    level, large = 0, nodes > COARSEST
    while large.any():
        level, grid = level + 1, (grid + 1) // 2
        cells = int(first_cells(grid, large)[-1])
        counts = np.minimum(np.prod(grid, axis=1), edges + (nodes - edges) // 2 ** (level * d))
        coarse = int((counts + 2 * (TILE - 1))[large].sum())
        held += 4 * rows  # parents
        joined, graph = coarse * (4 * 2**d + 8), coarse * (16 * d + 8)
        peak = max(peak, held + 8 * rows + max(CELL_BYTES * cells, 4 * cells + joined, joined + graph))
        held += joined - 8 * coarse + graph
        rows, large = coarse, large & (counts > COARSEST)
    return Footprint(peak, held)
