"""Walks on ten shapes beside the solver, and how many intervals hold (3.1)."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.stats import binomtest

from spem.fields.operator import assemble
from spem.fields.solvers.direct import Direct
from spem.fields.walks.estimate import estimate_field
from spem.fields.walks.intervals import Estimate
from spem.fields.walks.killed import Walk
from spem.paper.data import INNER_RADIUS, Data, Shapes
from spem.paper.silhouettes import chosen
from spem.shapes.creatures import creature
from spem.shapes.read import read
from spem.shapes.shape import Shape
from spem.shapes.synthetic import annulus, ball, interval, star_polygon

_MESHES = ("ants", "hand")
_CREATURES = ("elephant", "ant", "hand")


@dataclass(frozen=True, eq=False)
class Check:
    """Walks on one shape at one ρ beside the solver.

    Parameters
    ----------
    shape
        The shape.
    share
        ρ over `Shape.size`.
    values
        ``(n,)`` v of the solver at the nodes.
    estimate
        Share of the walks that arrived.
    """

    shape: Shape
    share: float
    values: NDArray[np.float64]
    estimate: Estimate


def ten_shapes(data: Data) -> Shapes:
    """Return shapes of one to three dimensions: real silhouettes and meshes where there are some.

    Examples
    --------
    >>> sorted({shape.ndim for shape in ten_shapes(Data(quick=True)).shapes})
    [1, 2, 3]
    """
    depth = 8.0 if data.quick else INNER_RADIUS
    flat = (
        chosen(data, "hand", inner_radius=depth),
        chosen(data, "cat", (1,), inner_radius=depth),
        chosen(data, "human", inner_radius=depth),
    )
    fine = 2.0 if data.quick else 1.0
    made = (
        interval(length=40.0, spacing=fine / 2, offset=0.1),
        star_polygon(9, radius=30.0, spacing=fine),
        annulus(inner=8.0, outer=24.0, spacing=fine),
        ball(radius=12.0, spacing=fine),
    )
    solids, real = _solids(data, 600 if data.quick else 6000)
    origin = "meshes of horse_poses and SHREC'11" if real else "creatures made here"
    source = (
        "Three silhouettes, three solids, an interval, a star, a ring and a ball. "
        f"{flat[0].source} Solids: {origin}."
    )
    named = (
        replace(found.shapes[0], name=kind)
        for found, kind in zip(flat, ("hand", "cat", "human"), strict=True)
    )
    return Shapes((*named, *solids, *made), source, flat[0].real and real)


def check_walks(
    shape: Shape, share: float, n_nodes: int, n_walks: int, comparisons: int, rng: np.random.Generator
) -> Check:
    """Walk from nodes drawn at random and solve for v there; ρ is a share of the shape's size.

    Parameters
    ----------
    shape
        The shape.
    share
        ρ over `Shape.size`; infinite for the free walk.
    n_nodes, n_walks
        How many nodes, and walks from each.
    comparisons
        How many intervals are to hold at once.
    rng
        Randomness of nodes and walks.

    Examples
    --------
    >>> found = check_walks(ball(2.0, 1.0), 0.5, 3, 50, 3, np.random.default_rng(0))
    >>> found.estimate.nodes.size, found.values.size
    (3, 3)
    """
    system, rho = assemble(shape), share * shape.size
    nodes = rng.choice(shape.n_nodes, min(n_nodes, shape.n_nodes), replace=False)
    values = Direct().solve(system, np.array([rho])).values[nodes, 0]
    found = estimate_field(system, rho, nodes=nodes, n_walks=n_walks, rng=rng, comparisons=comparisons)
    return Check(shape, share, values, found)


def coverage(checks: list[Check]) -> dict[str, float]:
    """Count the intervals that hold the solver's value: each by itself, and all at once.

    Returns
    -------
    counts
        Number of intervals, how many hold each by itself, the chance of as few or fewer if 99 % of such
        intervals held; how many hold at the simultaneous level, and on how many shapes all do.

    Examples
    --------
    >>> found = check_walks(ball(2.0, 1.0), 0.5, 3, 50, 3, np.random.default_rng(0))
    >>> coverage([found])["intervals"]
    3
    """
    alone = [check.estimate.alone().covers(check.values) for check in checks]
    together = [check.estimate.covers(check.values) for check in checks]
    total, held = sum(c.size for c in alone), int(sum(c.sum() for c in alone))
    names = {check.shape.name for check in checks}
    failed = {check.shape.name for check, c in zip(checks, together, strict=True) if not c.all()}
    return {
        "intervals": total,
        "held alone": held,
        "chance of so few": float(binomtest(held, total, 0.99, alternative="less").pvalue),
        "held together": int(sum(c.sum() for c in together)),
        "shapes": len(names),
        "shapes held": len(names - failed),
    }


def time_spent(walk: Walk, nodes: NDArray[np.int64]) -> float:
    """Return how much longer a walk stays about some nodes than about others, once it is there.

    The field of a source p at x is, but for a constant, the time that a walk from p spends there. Over
    this time it is the chance that it comes to x at all.

    Parameters
    ----------
    walk
        A killed walk.
    nodes
        ``(n,)`` nodes to compare.

    Returns
    -------
    ratio
        Greatest over least mean time at a node, in all visits of a walk that starts there.

    Examples
    --------
    >>> from spem.fields.walks.killed import killed_walk
    >>> walk = killed_walk(ball(2.0, 1.0), np.inf, boundary="voxel")
    >>> time_spent(walk, np.arange(walk.n_nodes)) > 1
    True
    """
    starts = np.zeros((walk.n_nodes, nodes.size))
    starts[nodes, np.arange(nodes.size)] = 1.0
    green = Direct().prepare(walk.system, walk.rho**-2.0).solve(starts)
    time = green[nodes, np.arange(nodes.size)]
    return float(time.max() / time.min())


def _solids(data: Data, voxels: int) -> tuple[tuple[Shape, ...], bool]:
    """Return three solids, and whether they are real ones."""
    horses = data.find("horse_poses")
    if horses is not None and data.find("shrec11") is not None:
        found = data.collection("shrec11", ndim=3, per_class=1)
        files = dict(zip(found.labels, found.items, strict=True))
        paths = {"horse": horses / "1.obj"} | {name: files[name] for name in _MESHES}
        return tuple(read(path, voxels=voxels, name=f"solid {name}") for name, path in paths.items()), True
    rng = np.random.default_rng(1)
    made = (creature(kind, rng=rng, voxels=voxels, ndim=3, name=f"solid {kind}") for kind in _CREATURES)
    return tuple(made), False
