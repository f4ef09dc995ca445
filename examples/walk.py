"""
The field as a chance: random walks that are killed
===================================================

Let a walker start at x and step from node to node. At each step it dies with a small chance, set by ρ; if it
gets to the boundary first, it has arrived. The field v(x) is the chance that it arrives (3.1): near the
boundary most walkers do, deep inside a shape that is wide compared with ρ hardly any.

Nothing but counting is needed to see that. On ten shapes, in one, two and three dimensions, walkers are let
go and those that arrive are counted; the confidence intervals of the counts must hold what the solver says.
Single boundary points follow: their fields say the chance to arrive just there (2.2).
"""

from functools import partial

import numpy as np

import spem
from spem.fields.walks.estimate import estimate_sources
from spem.fields.walks.killed import killed_walk
from spem.paper.data import Data
from spem.paper.findings import Claim, Finding, Picture, judged
from spem.paper.present import present
from spem.paper.walk import check_walks, coverage, ten_shapes, time_spent
from spem.paper.walk_pictures import figure_intervals, figure_walks

# ρ over the size of a shape.
SHARES = (0.06, 0.2)


def make(data: Data) -> Finding:
    """Count walks on ten shapes, then walks from a hand to each part of its boundary."""
    rng, found = np.random.default_rng(31), ten_shapes(data)
    n_nodes, n_walks = (10, 2000) if data.quick else (100, 10_000)
    total = n_nodes * len(SHARES) * len(found.shapes)
    check = partial(check_walks, n_nodes=n_nodes, n_walks=n_walks, comparisons=total, rng=rng)
    checks = [check(shape, share) for shape in found.shapes for share in SHARES]
    counted = coverage(checks)
    sources = spem.sources(found.shapes[0], 20)
    walk = killed_walk(sources.system, SHARES[1] * found.shapes[0].size)
    nodes = rng.choice(walk.n_nodes, 10, replace=False)
    ends = estimate_sources(walk, sources, nodes=nodes, n_walks=n_walks, rng=rng, comparisons=200)
    held = int(ends.covers(spem.source_fields(sources, walk.rho).values[:, nodes].T).sum())
    spent = time_spent(walk, rng.choice(walk.n_nodes, 60, replace=False))
    pictures = (
        Picture(
            "walks",
            figure_walks(walk, rng),
            "Walkers from one place: those in blue arrive, those in orange are killed where the dot is. "
            "Right: the share that arrives, of ever more walks, and v.",
        ),
        Picture(
            "intervals", figure_intervals(checks), "Each dot is a node: where v lies in its 99 % interval."
        ),
    )
    numbers = {"intervals": counted, "sources held": held, "time spent, greatest over least": spent}
    numbers |= {"steps": {c.shape.name: float(c.estimate.steps.mean()) for c in checks}, "walks": n_walks}
    return Finding(found.source, claims(counted, held, spent), pictures, numbers)


def claims(counted: dict[str, float], held: int, spent: float) -> tuple[Claim, ...]:
    """Judge the counts."""
    n, alone, together = counted["intervals"], counted["held alone"], counted["held together"]
    chance = "One in a hundred such runs misses one of them."
    return (
        judged(
            "The field is the chance of a random walker, killed at the rate 1/ρ², to arrive (3.1).",
            "a random walker stands behind the equation",
            f"{together} of {n} intervals hold the solver's value, all of them on {counted['shapes held']} "
            f"of {counted['shapes']} shapes; with 99 % all should at once",
            together == n,
            note=chance,
        ),
        judged(
            "Each interval by itself holds the solver's value in 99 of 100 cases or more.",
            "99 %",
            f"{alone} of {n}, {100 * alone / n:.1f} %; chance of so few: {counted['chance of so few']:.2f}",
            counted["chance of so few"] > 0.01,
            note="Fewer hold than chance explains.",
        ),
        judged(
            "The field of a boundary source is the chance of the walker to end just there (2.2, 3.1).",
            "probability",
            f"{held} of 200 intervals, of 20 sources at 10 nodes, hold it at once",
            held == 200,
            note=chance,
        ),
        judged(
            "Normalised, the field of a source p at x is the chance that a walker from p arrives at x (3.1).",
            "one normalisation",
            "the field goes with the time that it spends at x; that over the chance to come there differs "
            f"between nodes by a factor of {spent:.1f}",
            spent < 1.05,
            note="The time spent is the chance to come, times how long a walker at x stays about: longer in "
            "the middle than by the boundary. Read backwards, from x to p, the chance is exact.",
        ),
    )


if __name__ == "__main__":
    finding = present(make)
