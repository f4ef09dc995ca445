"""
Figure 7: non-negative measurements
===================================

Parts are found in the logarithms of the fields of single boundary points, for the Laplace equation, ρ = ∞.
At each node the mean over all points is taken off (4.1), the same as dividing the fields by their geometric
mean (4.2), and what is negative is set to zero. What is left of the field of one point, here on the tip of
the little finger as in Figure 5, is where this point matters more than the others do.

The median in place of the mean makes half of all values positive at every node; the two pictures hardly
differ.
"""

import numpy as np
from numpy.typing import NDArray

import spem
from spem.decomposition.measurements import centred_logs, measurements
from spem.paper.data import Data
from spem.paper.findings import Claim, Finding, Picture, judged
from spem.paper.limbs import Limbs, fingers
from spem.paper.present import present
from spem.paper.silhouettes import chosen
from spem.plots.sources import figure_measurements

ROUNDING = 1e-12
LITTLE = 0


def make(data: Data) -> Finding:
    """Measure the field of the tip of the little finger by mean and by median."""
    found = chosen(data, "hand")
    hand = found.shapes[0]
    limbs = fingers(hand)
    sources = spem.sources(hand, boundary="voxel")
    (tip,), _ = sources.nearest(hand.points[limbs.tip(LITTLE)])
    fields = spem.source_fields(sources)
    centred = centred_logs(fields)
    ratio = np.log(fields.values / np.exp(fields.log.mean(axis=0)))
    by_mean, by_median = (measurements(fields, centre) for centre in ("mean", "median"))
    away = np.linalg.norm(hand.points - sources.position[tip], axis=1)
    equal = claim_equal(float(np.abs(ratio - centred).max()), float(np.abs(centred.mean(axis=0)).max()))
    caption = (
        "The measurement of the source of Figure 5, from the median over all sources and from their mean."
    )
    numbers = {
        "positive": {"mean": float(np.mean(by_mean > 0)), "median": float(np.mean(by_median > 0))},
        "largest_mean": np.abs(centred.mean(axis=0)).max(),
        "ratio_minus_centred": np.abs(ratio - centred).max(),
        "positive_in_fingers": in_fingers(by_mean[tip], limbs),
        "correlation": np.corrcoef(by_mean[tip], by_median[tip])[0, 1],
    }
    return Finding(
        found.source,
        (equal, claim_ignored(by_mean[tip], away), claim_parts(by_mean[tip], limbs)),
        (Picture("measurements", figure_measurements(fields, int(tip)), caption),),
        numbers=numbers,
    )


def claim_equal(difference: float, mean: float) -> Claim:
    """Judge the two ways of writing the normalisation."""
    return judged(
        "Taking off the mean of the logarithms is dividing by the geometric mean of the fields, and leaves "
        "zero mean at each node (4.1, 4.2).",
        "equal",
        f"the two differ by at most {difference:.0e}; the largest mean is {mean:.0e}",
        difference < ROUNDING and mean < ROUNDING,
        note="Fields below the range of floating-point numbers have no ratio; their logarithms have a mean.",
    )


def claim_ignored(y: NDArray[np.float64], away: NDArray[np.float64]) -> Claim:
    """Judge which region has no measurement."""
    zeros, others = float(away[y == 0].mean()), float(away[y > 0].mean())
    return judged(
        "Setting to zero what is below the mean ignores a region within a certain proximity to the "
        "boundary node of interest (4.1).",
        "what is ignored is near",
        f"{100 * np.mean(y == 0):.0f} % of the nodes have zero; their mean distance from the source is "
        f"{zeros:.0f} pixels, that of the others {others:.0f}; the largest value is {away[y.argmax()]:.0f} "
        "pixel away",
        zeros < others,
        note="By (4.1) values near the source are the largest and stay; what is ignored lies beyond a "
        "certain proximity. The sentence fits the picture with 'outside' in place of 'within'.",
    )


def claim_parts(y: NDArray[np.float64], limbs: Limbs) -> Claim:
    """Judge whether a prominent part can be told by its measurements."""
    share = in_fingers(y, limbs)
    return judged(
        "What remains allows distinction of prominent parts (4.1).",
        "distinguishes prominent parts",
        f"of the source on the little finger, {100 * share[LITTLE]:.0f} % of this finger's nodes have a "
        f"positive measurement, of any other finger's at most {100 * max(share[1:]):.0f} %",
        share[LITTLE] > 0.5 and max(share[1:]) < 0.05,
        note="The measurement does not keep to the finger that its source is on.",
    )


def in_fingers(y: NDArray[np.float64], limbs: Limbs) -> list[float]:
    """Share of nodes with a positive measurement in each finger."""
    return [float(np.mean(y[limb] > 0)) for limb in limbs.inside]


if __name__ == "__main__":
    finding = present(make)
