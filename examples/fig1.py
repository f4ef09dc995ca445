"""
Figure 1: the field for different ρ
===================================

The field v solves Δv − v/ρ² = 0 inside a shape, with v = 1 on its boundary (1.1). It falls from the
boundary inward, and the screening length ρ says how fast: far from corners like exp(−depth/ρ). A small ρ
sees what is close to the boundary, protrusions and indentations, and knows nothing of the middle; a large
one couples the whole of the shape (2.1).

How far a value looks is measured by taking the boundary apart. v(x) is a sum over boundary points (2.3),
and the share in it of points that lie much farther away than the nearest one, by an inner radius or more,
is what the value knows of the rest of the shape.
"""

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray
from scipy.spatial.distance import cdist

import spem
from spem.paper.data import INNER_RADIUS, Data
from spem.paper.findings import Claim, Finding, Picture, judged
from spem.paper.present import present
from spem.paper.silhouettes import chosen
from spem.plots.figures import figure_fields
from spem.plots.style import COLOURS, DASHES, MUTED, framed, new_figure

RHO = (2.0, 4.0, 8.0, 16.0, 32.0)
# Below this share is nothing; above half of what ρ = ∞ has is most.
LITTLE, MOST = 0.05, 0.5


def make(data: Data) -> Finding:
    """Solve for a few ρ on a cat; measure how deep each reaches and from how far."""
    found = chosen(data, "cat")
    cat = found.shapes[0]
    fields, depth = np.asarray(spem.field(cat, RHO), np.float64), spem.distance_to_boundary(cat)
    grows = float((np.diff(fields, axis=1) > 0).mean())
    middle = fields[depth >= np.quantile(depth, 0.9)].mean(axis=0)
    half = [float(depth[column > 0.5].max(initial=0.0)) for column in fields.T]
    far = far_shares(spem.sources(cat, 200 if data.quick else None), (*RHO, np.inf))
    claims = (
        judged(
            "v grows with ρ at every node: a larger ρ carries the boundary further inward (2.1).",
            "grows",
            f"grows at {100 * grows:.1f} % of the nodes",
            grows == 1.0,
            note="Away from it a value differs by less than the solver resolves.",
        ),
        *reach_claims(middle, half, far),
    )
    panels = figure_fields(cat, fields, [f"ρ² = {rho**2:g}" for rho in RHO], columns=len(RHO))
    pictures = (
        Picture("fields", panels, "v for five ρ (pixels); blue is 0, yellow is 1 on the boundary."),
        Picture(
            "reach",
            figure_reach(depth, fields, far),
            "Left: mean v at each depth; dashed, exp(−depth/ρ), the fall from a straight boundary. Right: "
            "how much of v comes from boundary points that are an inner radius farther away than the "
            "nearest.",
        ),
    )
    numbers = {"rho": RHO, "grows": grows, "middle": middle, "half_depth": half, "far_share": far}
    return Finding(found.source, claims, pictures, numbers=numbers)


def reach_claims(middle: NDArray[np.float64], half: list[float], far: list[float]) -> tuple[Claim, Claim]:
    """Hold the two ends of the range against what the paper says of small and large ρ."""
    small = judged(
        "A small ρ² shows what is close to the boundary and is clueless about the central part (2.1).",
        "clueless about the centre",
        f"at ρ = {RHO[0]:g} v is above 1/2 no deeper than {half[0]:.1f} pixels and {middle[0]:.3f} on "
        f"average in the deepest tenth of the nodes; {100 * far[0]:.2f} % of v comes from far boundary",
        bool(middle[0] < LITTLE and far[0] < LITTLE),
        note=f"The shape is too thin for ρ = {RHO[0]:g} to be small.",
    )
    rising = bool(np.all(np.diff(far) > 0))
    large = judged(
        "A large ρ² captures global interactions within the shape (2.1).",
        "global interactions",
        f"the share of v from far boundary {'rises' if rising else 'does not rise'} with every ρ, to "
        f"{100 * far[-2]:.1f} % at ρ = {RHO[-1]:g}, of {100 * far[-1]:.1f} % that ρ = ∞ has",
        bool(rising and far[-2] > MOST * far[-1]),
        note=f"At ρ = {RHO[-1]:g} screening still cuts off more than half of what comes from afar.",
    )
    return small, large


def far_shares(sources: spem.Sources, several: tuple[float, ...]) -> list[float]:
    """Return the mean share in v of boundary points much farther away than the nearest, for each ρ."""
    away = cdist(sources.position, sources.system.shape.points)
    far = away > away.min(axis=0) + INNER_RADIUS
    slices = (spem.source_fields(sources, rho).values for rho in several)
    return [float(np.mean((values * far).sum(axis=0) / values.sum(axis=0))) for values in slices]


def figure_reach(depth: NDArray[np.float64], fields: NDArray[np.float64], far: list[float]) -> Figure:
    """Draw v against depth for each ρ, and the share of far boundary against ρ."""
    figure = new_figure(7.0, 2.8)
    left, right = figure.subplots(1, 2, width_ratios=(1.5, 1))
    bins = np.arange(np.ceil(depth.max()))
    number = np.digitize(depth, bins) - 1
    for rho, column, colour in zip(RHO, fields.T, COLOURS, strict=False):
        mean = np.bincount(number, column) / np.bincount(number)
        left.plot(np.bincount(number, depth) / np.bincount(number), mean, color=colour, label=f"ρ = {rho:g}")
        left.plot(bins, np.exp(-bins / rho), color=colour, linestyle=DASHES[1], linewidth=0.7)
    framed(left, "depth (pixels)", "v")
    left.legend(fontsize=7, frameon=False, loc="center left", bbox_to_anchor=(1.0, 0.5))
    right.plot(RHO, np.multiply(far[:-1], 100), "o-", color=COLOURS[0])
    right.axhline(100 * far[-1], color=MUTED, linestyle=DASHES[1], linewidth=0.9)
    right.text(RHO[0], 101 * far[-1], "ρ = ∞", fontsize=7, color=MUTED, va="bottom")
    right.set_ylim(0, 112 * far[-1])
    framed(right, "ρ (pixels)", "share of far boundary in v (%)")
    return figure


if __name__ == "__main__":
    finding = present(make)
