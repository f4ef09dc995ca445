"""
Figure 2: what a value knows beyond its distance to the boundary
================================================================

At a fixed node, v as a function of ρ is a curve from 0 to 1, its profile. Nodes of distinct character have
distinct profiles (2.2): one in the middle of a hand, one in a finger, some near the side of the palm. Two
of them, one in a finger and one in the palm, are equally far from the boundary. A distance transform gives
both the same number; their profiles differ, because in the finger the boundary is near on two sides.

The nodes are chosen by rule: the deepest one; nodes of the palm at two thirds and one third of its depth;
the deepest one in the middle of the longest finger; and the node of the palm as deep as that.
"""

from itertools import combinations
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

import spem
from spem.fields.hyperfield import Hyperfield
from spem.paper.data import Data
from spem.paper.equidistance import distinct_nodes
from spem.paper.findings import Claim, Finding, Picture, Table, judged
from spem.paper.present import present
from spem.paper.silhouettes import chosen
from spem.plots.profiles import draw_profiles
from spem.plots.style import TEXT_SIZE, new_figure

RHO = np.linspace(2, 30, 281)
NAMES = ("centre", "palm, ⅔ deep", "palm, ⅓ deep", "finger", "palm, as deep as finger")
FINGER, TWIN = 3, 4

Array = NDArray[np.floating[Any]]


def make(data: Data) -> Finding:
    """Draw the profiles of five nodes of a hand, and compare two that are equally deep."""
    found = chosen(data, "hand")
    hand = found.shapes[0]
    nodes, depth = distinct_nodes(hand), spem.distance_to_boundary(hand)
    hyperfield = spem.sweep(hand, RHO)
    profiles = hyperfield.fields()[nodes]
    apart = {pair: np.abs(profiles[pair[0]] - profiles[pair[1]]) for pair in combinations(range(5), 2)}
    nearest = min(apart, key=lambda pair: float(apart[pair].mean()))
    pair = apart[FINGER, TWIN]
    others = np.array([apart[other, FINGER].mean() for other in range(FINGER)])
    # What the little that is left between their distances could bring about at a straight boundary.
    deep = depth[nodes[[FINGER, TWIN]]]
    ratio = float(pair.max() / (abs(deep[0] - deep[1]) / RHO * profiles[TWIN])[pair.argmax()])
    closest = f"{NAMES[nearest[0]]!r} and {NAMES[nearest[1]]!r} are the closest ({apart[nearest].mean():.3f})"
    rows = tuple(
        (name, f"{depth[node]:.2f}", *(f"{profile[np.abs(RHO - r).argmin()]:.3f}" for r in (2, 5, 10, 30)))
        for name, node, profile in zip(NAMES, nodes, profiles, strict=True)
    )
    head = ("node", "depth (pixels)", "v at ρ = 2", "ρ = 5", "ρ = 10", "ρ = 30")
    return Finding(
        found.source,
        twin_claims(deep, pair, others, ratio, closest),
        (Picture("profiles", figure_nodes(hyperfield, nodes), "v against ρ at five nodes of a hand."),),
        tables=(Table("Profiles of the five nodes.", head, rows),),
        numbers={
            "depth": depth[nodes],
            "finger_against_palm": pair,
            "largest": pair.max(),
            "times_what_distance_explains": ratio,
            "mean_difference": {f"{NAMES[i]} - {NAMES[j]}": apart[i, j].mean() for i, j in apart},
        },
    )


def twin_claims(
    deep: NDArray[np.float64],
    pair: NDArray[np.float64],
    others: NDArray[np.float64],
    ratio: float,
    closest: str,
) -> tuple[Claim, Claim]:
    """Judge two profiles of equal depth against each other and against the others."""
    return (
        judged(
            "Two nodes, in a finger and in the palm, that are about equally far from the boundary have "
            "profiles that are close yet not identical, because the finger is thin (2.2).",
            "not nearly identical",
            f"{deep[0]:.2f} and {deep[1]:.2f} pixels deep, their profiles differ by up to {pair.max():.2f} "
            f"(at ρ = {RHO[pair.argmax()]:.1f}), {ratio:.0f} times what the difference in distance explains",
            bool(pair.max() > 0.05 and ratio > 10),
            note="The profiles differ by no more than their distances.",
        ),
        judged(
            "The two have closer profiles, for their comparable distance (2.2): of the others, the twin's is "
            "nearest to the finger's.",
            "closer profiles",
            f"mean difference of the finger's profile from that of its twin {pair.mean():.3f}, from the "
            f"others at least {others.min():.3f}; of all pairs, {closest}",
            bool(pair.mean() < others.min()),
            note="A thin part changes a profile by more than a difference in distance does.",
        ),
    )


def figure_nodes(hyperfield: Hyperfield, nodes: NDArray[np.int64]) -> Figure:
    """Draw the nodes on the hand beside their profiles."""
    figure = new_figure(7.0, 3.2)
    left, right = figure.subplots(1, 2, width_ratios=(1, 1.5))
    lines = draw_profiles(hyperfield, nodes, right, shape_ax=left)
    right.legend(lines, NAMES, fontsize=TEXT_SIZE - 1, frameon=False, loc="lower right")
    right.set_xlabel("ρ (pixels)")
    return figure


if __name__ == "__main__":
    finding = present(make)
