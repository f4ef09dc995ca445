"""
Figure 11: parts of a boundary, and the regions that go with them
=================================================================

Turn the matrix of Figure 8 round. Now boundary points are what is divided, each by the whole of its field:
two of them belong together when they matter to the same region (5.2). Each of the eight components is a
stretch of boundary, drawn along the outline, and has a region, drawn inside: a row of S and a column of A
of (4.3).

The paper takes Y "without normalization". Here the logarithm of each field is measured from its own mean,
so that all are non-negative and no field counts for more because its boundary point is stronger.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

import spem
from spem.decomposition.division import boundary_parts
from spem.decomposition.measurements import measurements
from spem.decomposition.parts import Parts
from spem.paper.data import INNER_RADIUS, Data
from spem.paper.findings import Claim, Finding, Picture, judged
from spem.paper.limbs import Limbs, find_limbs, main_labels
from spem.paper.present import present
from spem.paper.silhouettes import SMALL, chosen
from spem.plots.part_components import figure_components

N_PARTS = 8


def make(data: Data) -> Finding:
    """Divide the boundary of a human, and look where the regions of its parts lie."""
    found = chosen(data, "human", inner_radius=SMALL if data.quick else INNER_RADIUS)
    human = found.shapes[0]
    limbs = find_limbs(human)
    fields = spem.source_fields(spem.sources(human, boundary="voxel"))
    parts = boundary_parts(fields, N_PARTS)
    likeness = alike(measurements(fields, over="boundary"), parts.source_labels)
    own = main_labels(parts.source_labels, limbs.touched(parts.sources))
    regions = main_labels(parts.node_labels, limbs.inside)
    numbers = {
        "limbs": len(limbs.inside),
        "limb_parts": own,
        "limb_regions": regions,
        "alike_within": likeness[0],
        "alike_between": likeness[1],
        "stretches": stretches(parts),
        "share_in_limb": [
            share_in(parts, label, limb) for label, limb in zip(own, limbs.inside, strict=True)
        ],
    }
    caption = (
        f"The {N_PARTS} components: along the outline what is divided, inside the region that goes with it; "
        "numbered by size, with their share of all codes."
    )
    return Finding(
        found.source,
        region_claims(numbers, limbs),
        (Picture("parts", figure_components(parts, columns=4), caption),),
        numbers=numbers,
    )


def region_claims(numbers: dict[str, Any], limbs: Limbs) -> tuple[Claim, ...]:
    """Judge whether boundary parts are those of regions."""
    own, regions, count = numbers["limb_parts"], numbers["limb_regions"], len(limbs.inside)
    within, between = numbers["alike_within"], numbers["alike_between"]
    apart, same = len(set(own)), sum(a == b for a, b in zip(own, regions, strict=True))
    return (
        judged(
            "Boundary nodes that relate to similar regions are more likely to belong to the same part (5.2).",
            "more likely",
            f"measurements of two boundary points have a mean cosine of {within:.2f} within a part and of "
            f"{between:.2f} between parts",
            within > 2 * between,
            note="Parts of the boundary overlap in their regions.",
        ),
        judged(
            "The parts of the boundary of a human depend on a partition of its region: each goes with a "
            "part of the body (5.2, Figure 11).",
            "parts and corresponding regions",
            f"of {count} limbs, {apart} have a boundary part of their own, and the region of {same} is "
            "that of the same part",
            apart == count and same == count,
            note="A limb shares its part of the boundary with another or with the trunk.",
        ),
    )


def alike(measured: NDArray[np.float64], labels: NDArray[np.int32]) -> tuple[float, float]:
    """Return the mean cosine between measurements of two sources of one part, and of different ones."""
    unit = measured / np.maximum(np.linalg.norm(measured, axis=1, keepdims=True), 1e-300)
    cosine = unit @ unit.T
    same = labels[:, None] == labels
    other = ~np.eye(labels.size, dtype=bool)
    return float(cosine[same & other].mean()), float(cosine[~same].mean())


def stretches(parts: Parts) -> list[int]:
    """Return of how many connected stretches of the outer contour each part consists."""
    labels = parts.source_labels[parts.sources.contour == 0]
    begins = labels != np.roll(labels, 1)
    return [int(np.count_nonzero(begins & (labels == part))) for part in range(parts.n_parts)]


def share_in(parts: Parts, label: int, limb: NDArray[np.bool_]) -> float:
    """Return the share of a limb's nodes that one part owns."""
    return float(np.mean(parts.node_labels[limb] == label))


if __name__ == "__main__":
    finding = present(make)
