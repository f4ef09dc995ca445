"""Parts as the explorer shows them: their number chosen where it is not given, and the work bounded."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import KDTree

from spem.api.parts import part_sources
from spem.decomposition.choice import ErrorCurve, error_curve
from spem.decomposition.division import SPARSITY, limit_of, region_parts
from spem.decomposition.measurements import measurements
from spem.decomposition.parts import Parts
from spem.fields.superposition.fields import SourceFields, solve_sources
from spem.server.views.options import Options, coarser_shape, shown_shape, whole_option
from spem.shapes.shape import Shape

MOST_PARTS = 12
# Parts of larger shapes are found on a coarser grid: the time grows in proportion to the nodes.
_DIVIDED_NODES = 16_000
# The elbow of the error is where all nodes have it, on twelve of twelve shapes, for a fifth of the time.
_CHOICE_NODES = 2_000


@dataclass(frozen=True, eq=False)
class Division:
    """The parts of a shape.

    Parameters
    ----------
    shape
        The shape that the views show.
    parts
        Its parts; of a coarser grid where `node` is not the nodes in order.
    node
        ``(n_nodes,)`` node of `parts` that each node of the shape takes its part from.
    penalty
        λ of (4.3) itself, where `SPARSITY` is relative.
    curve
        The error against the number of parts, where this was chosen.
    """

    shape: Shape
    parts: Parts
    node: NDArray[np.int64]
    penalty: float
    curve: ErrorCurve | None

    @property
    def labels(self) -> NDArray[np.int32]:
        """``(n_nodes,)`` part of each node, -1 for none."""
        return np.asarray(self.parts.node_labels[self.node])


def divide(shape: Shape, options: Options) -> Division:
    """Divide the region of a shape into parts, with the defaults of `spem.parts`.

    Parameters
    ----------
    shape
        Any shape.
    options
        ``k``, the number of parts from 1 to 12, chosen by the elbow of the error where it is None;
        ``max_nodes``, as for the view of the geometry.

    Raises
    ------
    ParameterError
        When `k` is out of its range, or the shape cannot be divided.

    Examples
    --------
    >>> bone = np.pad(np.ones((3, 20)), ((4, 4), (0, 0)))
    >>> bone[:, :8] = bone[:, -8:] = 1
    >>> divide(Shape.from_mask(bone), {"k": 2}).parts.sizes.round(2).tolist()
    [0.5, 0.5]
    """
    count = whole_option(options, "k", 0, 1, MOST_PARTS)
    shown = shown_shape(shape, options)
    divided = coarser_shape(shown, _DIVIDED_NODES)
    fields = solve_sources(part_sources(divided), np.inf)
    curve = None if count else _curve(fields)
    parts = region_parts(fields, curve.suggested if curve is not None else count)
    penalty = SPARSITY * limit_of(np.ascontiguousarray(measurements(fields).T), fields)
    node = np.arange(shown.n_nodes)
    if divided is not shown:
        node = KDTree(divided.points).query(shown.points)[1]
    return Division(shown, parts, node, penalty, curve)


def on_shape(division: Division) -> Parts:
    """Return parts whose nodes are those of the shape that the views show, whatever grid they come from.

    Examples
    --------
    >>> division = divide(Shape.from_mask(np.ones((4, 12))), {"k": 2})
    >>> on_shape(division) is division.parts
    True
    """
    parts, node = division.parts, division.node
    if parts.shape is division.shape:
        return parts
    sources = part_sources(division.shape, parts.sources.n_sources)
    nearest = KDTree(parts.sources.position).query(sources.position)[1]
    return replace(
        parts,
        sources=sources,
        components=parts.components[:, node],
        basis=parts.basis[:, nearest],
        node_labels=parts.node_labels[node],
        source_labels=parts.source_labels[nearest],
    )


def _curve(fields: SourceFields) -> ErrorCurve:
    """Return the error of up to the most parts, on every so manieth node."""
    step = -(-fields.log.shape[1] // _CHOICE_NODES)
    return error_curve(replace(fields, log=fields.log[:, ::step]), MOST_PARTS)
