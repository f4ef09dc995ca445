"""Single walks as lines to draw."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from spem.errors import ParameterError
from spem.fields.walks.estimate import targets
from spem.fields.walks.killed import Walk, require_count, require_node
from spem.fields.walks.steps import step_table, streams, trace


@dataclass(frozen=True, eq=False)
class Path:
    """One walk.

    Parameters
    ----------
    nodes
        ``(n_steps,)`` the nodes that it stepped from, the first being where it started.
    points
        ``(n_steps + 1, d)`` their coordinates, then that of the boundary where it ended; ``(n_steps, d)`` of
        one that was killed.
    arrived
        Whether it ended on the boundary.
    """

    nodes: NDArray[np.int64]
    points: NDArray[np.float64]
    arrived: bool

    @property
    def n_steps(self) -> int:
        """Number of steps, the last of which ended the walk."""
        return self.nodes.size

    def __repr__(self) -> str:
        return f"Path({self.n_steps} steps, {'arrived' if self.arrived else 'killed'})"


def sample_paths(walk: Walk, node: int, n_paths: int, rng: np.random.Generator) -> list[Path]:
    """Let walks start at a node and keep their ways.

    Parameters
    ----------
    walk
        A killed walk or a conditioned one.
    node
        Where they start.
    n_paths
        How many.
    rng
        Randomness.

    Raises
    ------
    ParameterError
        When there is no such node, no walk from it, or the number is no whole one.

    Examples
    --------
    >>> from spem.fields.walks.killed import killed_walk
    >>> from spem.shapes.shape import Shape
    >>> walk = killed_walk(Shape.from_mask(np.ones(9)), np.inf)
    >>> path = sample_paths(walk, 4, 1, np.random.default_rng(0))[0]
    >>> path.arrived, path.points[0].tolist(), abs(path.points[-1] - 4).tolist()
    (True, [4.0], [4.5])
    """
    start = require_node(walk, node)
    require_count("n_paths", n_paths)
    if walk.log_h[start] == -np.inf:
        msg = f"{walk.system.shape.name}: no walk from node {start}: the source does not reach it"
        raise ParameterError(msg)
    table, target = step_table(walk), targets(walk, np.zeros(walk.log_boundary.size, np.int64))
    states = streams(n_paths, rng)
    return [_path(walk, *trace(start, state, table, target)) for state in states]


def _path(walk: Walk, nodes: NDArray[np.int64], edge: int) -> Path:
    """Add coordinates to the nodes and the last edge of a walk."""
    shape, domain = walk.system.shape, walk.system.domain
    points = shape.points[nodes]
    if edge < 0:
        return Path(nodes, points, False)
    node, direction = domain.boundary_edges
    place = int(np.flatnonzero((node == nodes[-1]) & (direction == edge))[0])
    end = points[-1].copy()
    axis = edge // 2
    end[axis] += (1 if edge % 2 else -1) * domain.fraction[place] * shape.spacing[axis]
    return Path(nodes, np.vstack([points, end]), True)
