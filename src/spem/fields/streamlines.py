"""Streamlines along a vector field on the nodes, and those of single-source fields up to their source."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from spem.errors import ParameterError
from spem.fields.boundary.sources import check_source
from spem.fields.gradients import source_gradient, unit_vectors
from spem.fields.operator import System
from spem.fields.stepping import BOUNDARY, LENGTH, SOURCE, STAGNATION, follow
from spem.fields.superposition.fields import SourceFields, require_fields

ENDS = {BOUNDARY: "boundary", STAGNATION: "stagnation", LENGTH: "length", SOURCE: "source"}
# Lines are followed over at most this many times the sum of the sides of the grid.
_DETOUR = 8.0
_STEP = 0.25
# Points of one line that memory is kept for.
_MOST_POINTS = 1_000_000


@dataclass(frozen=True, eq=False)
class Streamlines:
    """Polylines along a vector field; iterating gives one ``(k_i, d)`` array of points a line.

    Parameters
    ----------
    points
        ``(n_points, d)`` points of all lines in turn, in the shape's own coordinates. In a line they are one
        step apart, where it follows the field, and less elsewhere.
    first
        ``(n_lines + 1,)`` number of the first point of each line; the last entry is ``n_points``.
    end
        ``(n_lines,)`` why each line ends, as a key of `ENDS`: at the boundary, where the field has no
        direction or turns back, at the greatest length, at the source.
    """

    points: NDArray[np.float64]
    first: NDArray[np.int64]
    end: NDArray[np.int8]

    def __len__(self) -> int:
        return self.end.size

    def __iter__(self) -> Iterator[NDArray[np.float64]]:
        return (self.points[a:b] for a, b in zip(self.first[:-1], self.first[1:], strict=True))

    def __getitem__(self, line: int) -> NDArray[np.float64]:
        start = range(len(self))[line]
        return self.points[self.first[start] : self.first[start + 1]]

    @property
    def ends(self) -> tuple[str, ...]:
        """Why each line ends, in words."""
        return tuple(ENDS[int(code)] for code in self.end)

    def __repr__(self) -> str:
        count = np.bincount(self.end, minlength=len(ENDS))
        ends = ", ".join(f"{n} at {word}" for n, word in zip(count, ENDS.values(), strict=True) if n)
        return f"Streamlines({len(self)} lines, {len(self.points)} points; ends: {ends or 'none'})"


def trace_streamlines(
    system: System,
    vectors: ArrayLike,
    seeds: ArrayLike,
    *,
    step: float = _STEP,
    max_length: float | None = None,
) -> Streamlines:
    """Follow the directions of a vector field from nodes, by the Runge-Kutta method of fourth order.

    Directions are interpolated linearly along each axis among the nodes around a point that are joined to
    the nearest one by uncut edges, so lines never mix parts that only touch through the grid.

    Parameters
    ----------
    system
        The system whose nodes carry the vectors.
    vectors
        ``(n_nodes, d)`` vectors; only their directions count.
    seeds
        ``(n_lines,)`` nodes to start from; `even_nodes` spreads them.
    step
        Distance between points of a line, in units of the smallest spacing.
    max_length
        Longest line, in the unit of the spacing; eight times the sum of the sides of the grid by default.

    Raises
    ------
    ParameterError
        If the vectors are not finite or not one a node, a seed is no node, or a length is not positive.

    Examples
    --------
    >>> from spem.fields.operator import assemble
    >>> from spem.shapes.shape import Shape
    >>> system = assemble(Shape.from_mask(np.ones((3, 3))), "voxel")
    >>> lines = trace_streamlines(system, np.tile([0.0, 2.0], (9, 1)), [3], step=0.5)
    >>> lines.ends, lines[0].tolist()
    (('boundary',), [[1.0, 0.0], [1.0, 0.5], [1.0, 1.0], [1.0, 1.5], [1.0, 2.0], [1.0, 2.5], [1.0, 3.0]])
    """
    return _trace(system, vectors, seeds, np.zeros(system.n_nodes), step, max_length)


def source_streamlines(
    fields: SourceFields, source: int, seeds: ArrayLike, *, step: float = _STEP
) -> Streamlines:
    """Follow the gradient of the field of one source from nodes up to the source (Fig. 5).

    Lines end at the boundary point of the source that is nearest to where they reach a node beside it; those
    from components that the source does not touch have one point. In parts one or two voxels wide, where
    interpolation can lead out of the shape or in a circle, a line goes on along the edge that leads highest.

    Parameters
    ----------
    fields
        Fields of boundary sources.
    source
        Number of the source.
    seeds
        ``(n_lines,)`` nodes to start from; `even_nodes` spreads them.
    step
        Distance between points of a line, in units of the smallest spacing.

    Raises
    ------
    ParameterError
        If there is no such source or seed, or the step is not positive.

    Examples
    --------
    >>> import spem
    >>> sources = spem.sources(spem.Shape.from_mask(np.ones((3, 9))), boundary="voxel")
    >>> line = source_streamlines(spem.source_fields(sources, np.inf), 0, [26])[0]
    >>> line[0].tolist(), line[-1].tolist() == sources.position[0].tolist()
    ([2.0, 8.0], True)
    """
    require_fields(fields)
    sources, system = fields.sources, fields.sources.system
    check_source(sources, source)
    node, _ = system.domain.boundary_edges
    mine = sources.edge_source == source
    height = fields.log[source].copy()
    height[node[mine]] = np.inf
    lines = _trace(system, source_gradient(fields, source), seeds, height, step, None)
    place = sources.points.position[sources.points.edge_point[mine]]
    points, first = lines.points, lines.first
    arrived = np.flatnonzero(lines.end == SOURCE)
    last = points[first[arrived + 1] - 1]
    nearest = np.square(last[:, None] - place).sum(axis=2).argmin(axis=1)
    shift = np.zeros(len(lines) + 1, np.int64)
    shift[arrived + 1] = 1
    longer = np.insert(points, first[arrived + 1], place[nearest], axis=0)
    return Streamlines(longer, first + np.cumsum(shift), lines.end)


def even_nodes(system: System, count: int) -> NDArray[np.int64]:
    """Return nodes spread evenly over a shape: each the farthest from those before it, in straight lines.

    The first is the one farthest from the centre of the shape, so ends of limbs come first.

    Parameters
    ----------
    system
        The system whose nodes are chosen from.
    count
        Number of nodes; all of them if there are fewer.

    Raises
    ------
    ParameterError
        If `count` is not positive.

    Examples
    --------
    >>> from spem.fields.operator import assemble
    >>> from spem.shapes.shape import Shape
    >>> even_nodes(assemble(Shape.from_mask(np.ones(9))), 3)
    array([0, 8, 4])
    """
    if count < 1:
        msg = f"{system.shape.name}: count={count}: expected one node or more"
        raise ParameterError(msg)
    points = system.shape.points
    chosen = np.empty(min(count, system.n_nodes), np.int64)
    distance = np.square(points - points.mean(axis=0)).sum(axis=1)
    for k in range(chosen.size):
        chosen[k] = distance.argmax()
        away = np.square(points - points[chosen[k]]).sum(axis=1)
        distance = away if k == 0 else np.minimum(distance, away)
    return chosen


def _numbers(seeds: ArrayLike, name: str) -> NDArray[np.int64]:
    """Seeds as a row of whole numbers."""
    numbers = np.atleast_1d(np.asarray(seeds))
    if numbers.ndim > 1 or (numbers.size and numbers.dtype.kind not in "iu"):
        msg = f"{name}: seeds must be the numbers of nodes, (n,), not {numbers.shape} of {numbers.dtype}"
        raise ParameterError(msg)
    return numbers.astype(np.int64)


def _trace(
    system: System,
    vectors: ArrayLike,
    seeds: ArrayLike,
    height: NDArray[np.float64],
    step: float,
    max_length: float | None,
) -> Streamlines:
    """Check the arguments, follow every line and put them into the shape's coordinates."""
    shape, domain = system.shape, system.domain
    given, start = np.asarray(vectors, np.float64), _numbers(seeds, shape.name)
    if given.shape != (system.n_nodes, shape.ndim) or not np.isfinite(given).all():
        msg = f"{shape.name}: vectors must be ({system.n_nodes}, {shape.ndim}) and finite, not {given.shape}"
        raise ParameterError(msg)
    if start.size and not 0 <= start.min() <= start.max() < system.n_nodes:
        stray = start.min() if start.min() < 0 else start.max()
        msg = f"{shape.name}: a seed is node {stray}, expected 0 to {system.n_nodes - 1}"
        raise ParameterError(msg)
    spacing = np.asarray(shape.spacing)
    longest = _DETOUR * float(spacing @ shape.mask.shape) if max_length is None else max_length
    if not (0 < step <= 1 and longest > 0):
        msg = (
            f"{shape.name}: step={step} and max_length={longest}: expected 0 < step <= 1 and a length above 0"
        )
        raise ParameterError(msg)
    most = int(min(longest / (step * spacing.min()), _MOST_POINTS)) + 1
    index = np.stack(np.unravel_index(shape.voxels, shape.mask.shape), axis=1).astype(np.float64)
    edge = np.searchsorted(domain.boundary_edges[0], np.arange(domain.n_nodes + 1))
    per_index = step * spacing.min() / spacing
    tables = (domain.neighbours, edge, domain.fraction)
    unit = unit_vectors(given)
    traced = [follow(int(node), index, unit, tables, height, per_index, most) for node in start]
    count = np.array([0, *(len(line) for line, _ in traced)], np.int64)
    points = np.concatenate([np.empty((0, shape.ndim)), *(line for line, _ in traced)])
    end = np.array([code for _, code in traced], np.int8)
    return Streamlines(np.asarray(shape.origin) + points * spacing, np.cumsum(count), end)
