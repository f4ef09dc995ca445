"""Boundary sources (2.2): which part of the boundary data each single-source field has."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
import scipy.sparse
from numpy.typing import ArrayLike, NDArray
from scipy.spatial import KDTree

from spem.errors import ParameterError
from spem.fields.boundary.points import BoundaryPoints, boundary_points
from spem.fields.operator import System
from spem.shapes.shape import Shape

# A click on a picture may miss the boundary by this many voxels; farther off, the wrong place was meant.
_TOLERANCE = 3.0
_HUGE = 1e6


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

    @cached_property
    def n_sources(self) -> int:
        """Number of sources."""
        return int(self.group.max()) + 1

    @cached_property
    def position(self) -> NDArray[np.float64]:
        """``(n_sources, d)`` mean position of the points of each source, in the shape's own coordinates."""
        inside = self.group >= 0
        group, points = self.group[inside], self.points.position[inside]
        count = np.bincount(group, minlength=self.n_sources)
        sums = [np.bincount(group, column, self.n_sources) for column in points.T]
        return np.stack(sums, axis=1) / count[:, None]

    @cached_property
    def measure(self) -> NDArray[np.float64]:
        """``(n_sources,)`` length, area ... of the boundary of each source, in units of spacing^(d-1)."""
        inside = self.group >= 0
        total = np.bincount(self.group[inside], self.points.measure[inside], self.n_sources)
        return total.astype(np.float64)

    @cached_property
    def contour(self) -> NDArray[np.int32]:
        """``(n_sources,)`` contour, or connected piece of boundary, of each source: of its first point."""
        group, first = np.unique(self.group, return_index=True)
        return self.points.contour[first[group >= 0]]

    @cached_property
    def edge_source(self) -> NDArray[np.int32]:
        """``(n_boundary_edges,)`` source at the end of each boundary edge, -1 for none."""
        return np.asarray(self.group[self.points.edge_point])

    @cached_property
    def rhs(self) -> scipy.sparse.csc_array:
        """``(n_nodes, n_sources)`` right-hand sides: 1/(θ h²) of each edge, in its source's column."""
        domain = self.system.domain
        node, direction = domain.boundary_edges
        source = self.edge_source
        value = self.system.weights[direction // 2] / domain.fraction
        used = source >= 0
        shape = (domain.n_nodes, self.n_sources)
        return scipy.sparse.coo_array((value[used], (node[used], source[used])), shape=shape).tocsc()

    @cached_property
    def reach(self) -> scipy.sparse.csr_array:
        """``(n_sources, n_components)`` True where a source touches a connected component of nodes.

        Components are those of `Domain.component`. An outside voxel between two components touches both; in
        all others the field of a source is zero.
        """
        node, _ = self.system.domain.boundary_edges
        source, component = self.edge_source, self.system.domain.component
        used = source >= 0
        shape = (self.n_sources, int(component.max()) + 1)
        touching = (np.ones(np.count_nonzero(used), bool), (source[used], component[node[used]]))
        reach = scipy.sparse.coo_array(touching, shape=shape).tocsr()
        return reach.astype(bool)

    def select(self, sources: ArrayLike) -> Sources:
        """Keep the sources with these numbers, renumbered in the order given.

        Raises
        ------
        ParameterError
            When a number is not that of a source, is no whole number or stands twice, or none is given.
        """
        chosen = _checked_numbers(sources, self.n_sources, self.system.shape.name)
        number = np.full(self.n_sources + 1, -1, np.int32)  # the last entry serves group -1
        number[chosen] = np.arange(chosen.size, dtype=np.int32)
        return replace(self, group=number[self.group])

    def nearest(
        self, positions: ArrayLike, *, tolerance: float | None = None, distinct: bool = True
    ) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
        """Find the source that holds the nearest boundary point of each given point.

        Parameters
        ----------
        positions
            ``(k, d)`` coordinates, in the shape's own coordinates; ``(d,)`` for one point.
        tolerance
            Greatest distance from the boundary, in the unit of the spacing; three voxels by default.
        distinct
            Whether two points that fall on one source are refused.

        Returns
        -------
        source
            ``(k,)`` numbers of the sources.
        distance
            ``(k,)`` distance of each point from its boundary point, in the unit of the spacing.

        Raises
        ------
        ParameterError
            When a point is too far from the boundary, two fall on one source, they are no points of d finite
            coordinates, or the tolerance is no positive number.

        Examples
        --------
        >>> import numpy as np
        >>> from spem.fields.operator import assemble
        >>> from spem.shapes.shape import Shape
        >>> sources = point_sources(assemble(Shape.from_mask(np.ones((1, 3))), "voxel"))
        >>> source, distance = sources.nearest([(0.0, 3.5)])
        >>> sources.position[source].tolist(), distance.tolist()
        ([[0.0, 3.0]], [0.5])
        """
        shape = self.system.shape
        asked = _checked_positions(positions, shape.ndim, shape.name)
        limit = _checked_tolerance(tolerance, shape)
        used = np.flatnonzero(self.group >= 0)
        known = self.points.position[used]
        # squares of huge coordinates would overflow; from the rim of this box the same point is nearest
        rim = _HUGE * (np.abs(known).max() + max(shape.spacing))
        distance, hit = KDTree(known).query(np.clip(asked, -rim, rim))
        far = np.flatnonzero(distance > limit)
        if far.size:
            point, near = asked[far[0]], known[hit[far[0]]]
            msg = (
                f"{shape.name}: the point {_text(point)} is {math.dist(point, near):.4g} from the boundary, "
                f"more than {limit:.4g}; the nearest boundary node is {_text(near)}"
            )
            raise ParameterError(msg)
        source = self.group[used[hit]].astype(np.int64)
        if distinct:
            _refuse_twins(source, asked, shape.name)
        return source, np.asarray(distance)

    def __repr__(self) -> str:
        points = np.count_nonzero(self.group >= 0)
        kind = f"{self.n_sources} sources" if self.n_sources != 1 else "1 source"
        return (
            f"Sources({self.system.shape.name!r}, {self.system.boundary}, {kind} of {points} of "
            f"{self.points.n_points} boundary points, {self.points.n_contours} contours)"
        )


def point_sources(system: System) -> Sources:
    """Make every boundary point a source of its own, in the order of `boundary_points`.

    Examples
    --------
    >>> import numpy as np
    >>> from spem.fields.operator import assemble
    >>> from spem.shapes.shape import Shape
    >>> point_sources(assemble(Shape.from_mask(np.ones((2, 3))), "voxel"))
    Sources('shape', voxel, 10 sources of 10 of 10 boundary points, 1 contours)
    """
    points = boundary_points(system)
    return Sources(system, points, np.arange(points.n_points, dtype=np.int32))


def restore_sources(system: System, edge_source: NDArray[np.integer]) -> Sources:
    """Make sources again of their `Sources.edge_source`, which is in the order of the grid.

    Examples
    --------
    >>> import numpy as np
    >>> from spem.fields.operator import assemble
    >>> from spem.shapes.shape import Shape
    >>> restore_sources(assemble(Shape.from_mask(np.ones(3))), np.array([0, -1])).position
    array([[-0.5]])
    """
    points = boundary_points(system)
    group = np.full(points.n_points, -1, np.int32)
    group[points.edge_point] = edge_source
    return Sources(system, points, group)


def check_source(sources: Sources, source: Any) -> None:
    """Raise a `ParameterError` unless the number is that of a source.

    Examples
    --------
    >>> from spem.fields.operator import assemble
    >>> from spem.shapes.shape import Shape
    >>> check_source(point_sources(assemble(Shape.from_mask(np.ones(3)))), 1)
    """
    if not isinstance(source, int | np.integer) or not 0 <= source < sources.n_sources:
        msg = f"{sources.system.shape.name}: source {source}, expected 0 to {sources.n_sources - 1}"
        raise ParameterError(msg)


def _checked_numbers(sources: ArrayLike, n: int, name: str) -> NDArray[np.int64]:
    """Return source numbers, each between 0 and n - 1 and given once."""
    numbers = np.atleast_1d(np.asarray(sources))
    if numbers.ndim != 1 or not numbers.size or numbers.dtype.kind not in "iu":
        msg = f"{name}: sources are chosen by whole numbers from 0 to {n - 1}, got {sources!r}"
        raise ParameterError(msg)
    stray = numbers[(numbers < 0) | (numbers >= n)]
    if stray.size:
        msg = f"{name}: there is no source {stray[0]}, expected 0 to {n - 1}"
        raise ParameterError(msg)
    value, count = np.unique(numbers, return_counts=True)
    if value.size < numbers.size:
        msg = f"{name}: source {value[np.argmax(count > 1)]} is chosen twice; give each source once"
        raise ParameterError(msg)
    return numbers.astype(np.int64)


def _checked_positions(positions: ArrayLike, d: int, name: str) -> NDArray[np.float64]:
    """Return finite points, one a row."""
    try:
        asked = np.atleast_2d(np.asarray(positions, np.float64))
    except (TypeError, ValueError):
        asked = np.empty((0, 0))
    if asked.ndim != 2 or asked.shape[1] != d or not len(asked) or not np.isfinite(asked).all():
        msg = f"{name}: a point has {d} finite coordinates, got {positions!r}"
        raise ParameterError(msg)
    return asked


def _checked_tolerance(tolerance: Any, shape: Shape) -> float:
    """Return a positive distance; infinity is allowed."""
    if tolerance is None:
        return _TOLERANCE * max(shape.spacing)
    if not isinstance(tolerance, int | float | np.number) or not tolerance > 0:
        msg = f"{shape.name}: tolerance={tolerance!r} must be a positive distance"
        raise ParameterError(msg)
    return float(tolerance)


def _refuse_twins(source: NDArray[np.int64], asked: NDArray[np.float64], name: str) -> None:
    """Refuse two points on one source."""
    order = np.argsort(source, kind="stable")
    twins = np.flatnonzero(np.diff(source[order]) == 0)
    if twins.size:
        first, second = order[twins[0]], order[twins[0] + 1]
        msg = (
            f"{name}: the points {_text(asked[first])} and {_text(asked[second])} fall on one source, "
            f"{source[first]}; give each source once"
        )
        raise ParameterError(msg)


def _text(point: NDArray[np.float64]) -> str:
    """Coordinates as they are given on the command line."""
    return ",".join(f"{x:.6g}" for x in point)
