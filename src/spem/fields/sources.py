"""Boundary sources (2.2): which part of the boundary data each single-source field has."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import scipy.sparse
from numpy.typing import ArrayLike, NDArray

from spem.fields.boundary_points import BoundaryPoints, boundary_points
from spem.fields.operator import System


@dataclass(frozen=True, eq=False)
class Sources:
    """Disjoint groups of boundary points of one system; each is the source of one field.

    The field v^{p_i} of source i is 1 on its points and 0 on the rest of the boundary (2.2). If every point
    is in a source, the fields sum to v (2.3).

    Parameters
    ----------
    system
        The system whose boundary data are divided.
    points
        Its boundary points.
    group
        ``(n_points,)`` number of the source that each point belongs to; -1 for none.
    """

    system: System
    points: BoundaryPoints
    group: NDArray[np.int32]

    @property
    def n_sources(self) -> int:
        """Number of sources."""
        return int(self.group.max()) + 1

    @cached_property
    def position(self) -> NDArray[np.float64]:
        """``(n_sources, d)`` mean position of the points of each source."""
        inside = self.group >= 0
        group, points = self.group[inside], self.points.position[inside]
        count = np.bincount(group, minlength=self.n_sources)
        sums = [np.bincount(group, column, self.n_sources) for column in points.T]
        return np.stack(sums, axis=1) / count[:, None]

    @cached_property
    def rhs(self) -> scipy.sparse.csc_array:
        """``(n_nodes, n_sources)`` right-hand sides: 1/(θ h²) of each boundary edge, in its source's column."""
        domain = self.system.domain
        node, direction = np.nonzero(domain.neighbours == domain.n_nodes)
        source = self.group[self.points.edge_point]
        value = self.system.weights[direction // 2] / domain.fraction
        used = source >= 0
        shape = (domain.n_nodes, self.n_sources)
        return scipy.sparse.coo_array((value[used], (node[used], source[used])), shape=shape).tocsc()

    def select(self, sources: ArrayLike) -> Sources:
        """Keep the sources with these numbers, renumbered in the order given."""
        chosen = np.asarray(sources, np.int64)
        number = np.full(self.n_sources + 1, -1, np.int32)  # the last entry serves group -1
        number[chosen] = np.arange(chosen.size, dtype=np.int32)
        return replace(self, group=number[self.group])


def point_sources(system: System) -> Sources:
    """Every boundary point as a source of its own."""
    points = boundary_points(system)
    return Sources(system, points, np.arange(points.n_points, dtype=np.int32))
