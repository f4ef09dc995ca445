"""
Figure 13: the first five maps of six cats
==========================================

The maps P₁ to P₅ (4.4) of a cat in six poses, one pose a row; a column has one colour scale, red above zero
and blue below. P₁ is highest along the boundary, P₂ tells the middle from the periphery, P₃ marks what sticks
out: head, legs and tail (5.3). Nobody says which node of one cat is which of another: consistency is how near
the distributions of the values of a map are from pose to pose, beside those of other kinds of silhouettes.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.stats import spearmanr

import spem
from spem.paper.consistency import (
    PAPER_RHO,
    RTOL,
    basis_cosines,
    distribution_distances,
    judge_poses,
    pairs,
)
from spem.paper.data import Data
from spem.paper.findings import Claim, Finding, Picture, judged
from spem.paper.perturbations import limbs
from spem.paper.present import present
from spem.paper.regions import roughness, separation, separation_at_depth
from spem.plots.map_grid import figure_map_grid

N_MAPS = 5


def make(data: Data) -> Finding:
    """Compare the maps of cats with each other, and with those of humans and hands."""
    found = data.silhouettes("cat", 6)
    others = [*data.silhouettes("human", 3).shapes, *data.silhouettes("hand", 3).shapes]
    several = [spem.maps(shape, N_MAPS, rho=PAPER_RHO, rtol=RTOL) for shape in (*found.shapes, *others)]
    cats, n = several[: len(found.shapes)], len(found.shapes)
    distances = distribution_distances(several)
    marks = list(map(character, cats))
    table = {name: np.array([mark[name] for mark in marks]) for name in marks[0]}
    numbers = {
        "within_cats": pairs(distances[:n, :n]).mean(axis=0),
        "cats_to_others": distances[:n, n:].mean(axis=(0, 1)),
        "least_cosine": pairs(basis_cosines(cats)).min(axis=0),
        **table,
    }
    statement = "Projections are consistent across deformations of the cat (5.3, Fig. 13)."
    figure = figure_map_grid(cats, [f"pose {i + 1}" for i in range(n)])
    return Finding(
        f"{found.source} Cats are compared with humans and hands of the same source.",
        (judge_poses(statement, distances, n, "humans and hands"), *claims(table)),
        (Picture("maps", figure, "P₁ to P₅ of a cat in six poses."),),
        numbers,
    )


def character(maps: spem.Maps) -> dict[str, Any]:
    """Measure what the maps of one cat mark."""
    mask, values = maps.shape.mask, maps.values
    depth, limb = spem.distance_to_boundary(maps.shape), np.any(limbs(mask), axis=0)[mask]
    return {
        "rank_correlation_p1_depth": float(spearmanr(values[:, 0], depth).statistic),
        "p1_positive": float((values[:, 0] > 0).mean()),
        "p2_positive": float((values[:, 1] > 0).mean()),
        "p2_sign_by_depth": separation(depth, values[:, 1] > 0),
        "limbs_at_equal_depth": [separation_at_depth(-column, limb, depth) for column in values.T],
        "limbs_by_depth": separation(-depth, limb),
        "roughness": roughness(maps.shape, values),
    }


def claims(table: dict[str, NDArray[np.float64]]) -> tuple[Claim, ...]:
    """Judge what is said of the single maps."""
    rank, rough, limb = table["rank_correlation_p1_depth"], table["roughness"], table["limbs_at_equal_depth"]
    share, sign = table["p2_positive"], table["p2_sign_by_depth"]
    smooth, rest, third = rough[:, :2].max(), rough[:, 2:].min(), limb[:, 2]
    return (
        judged(
            "The first two projections are much smoother than the others (5.3).",
            "much smoother",
            f"change from node to node, in standard deviations: P₁, P₂ at most {smooth:.2f}, "
            f"P₃ to P₅ at least {rest:.2f}",
            bool(smooth < rest),
            note="Measured over all nodes, the layer along the boundary among them.",
        ),
        judged(
            "In P₁, nodes near the boundary have highly positive values (5.3).",
            "highest near the boundary",
            f"rank correlation with depth {rank.min():.2f} to {rank.max():.2f}; "
            f"positive at {100 * table['p1_positive'].min():.0f} % of the nodes",
            bool(rank.max() < -0.9),
            note="Depth is the distance to the boundary; a correlation below −0.9 was asked for.",
        ),
        judged(
            "P₂ exhibits a much stronger central/peripheral separation (5.3).",
            "stronger than that of P₁",
            f"P₁ has one sign; P₂ is positive at {100 * share.min():.0f} to {100 * share.max():.0f} % of the "
            f"nodes, and its sign follows depth (area under the ROC curve {sign.min():.3f} or more)",
            bool((table["p1_positive"] == 1).all() and (share > 0.2).all() and (share < 0.8).all())
            and bool(sign.min() > 0.95),
            note="Its sign does not tell deep nodes from shallow ones in every pose.",
        ),
        judged(
            "P₃ reveals ears, head, legs and tail (5.3).",
            "revealed",
            f"at equal depth, P₃ is lower in what sticks out than elsewhere with probability "
            f"{third.min():.2f} to {third.max():.2f}",
            bool(third.min() > 0.8),
            note="What sticks out is what an opening by half the inner radius removes; 0.8 was asked for.",
        ),
    )


if __name__ == "__main__":
    finding = present(make)
