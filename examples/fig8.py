"""
Figure 8: parts of a hand
=========================

Arrange the measurements of Figure 7 in a matrix Y, a column for each node, and factor it, Y ≈ A S with A
and S not negative and S sparse (4.3). The rows of S are components in the region, one in each panel; the
columns of A are the same on the boundary, drawn along the outline. No one has said what a finger is.

The paper shows two settings: a strong penalty λ and few components, five in the caption and six in the
text; and a weak penalty and twelve. The fingers remain, and more components stand for their roots and
pieces of the palm. Fingers are checked against what an opening of the silhouette takes away, which knows
nothing of fields.
"""

from typing import Any

import numpy as np

import spem
from spem.decomposition.division import region_parts
from spem.decomposition.parts import Parts
from spem.paper.data import INNER_RADIUS, Data
from spem.paper.findings import Claim, Finding, Picture, Table, judged
from spem.paper.limbs import core_labels, fingers, main_labels
from spem.paper.present import present
from spem.paper.silhouettes import SMALL, chosen
from spem.plots.part_components import figure_components

# The paper gives no λ; these are shares of the λ at which all codes vanish.
STRONG, WEAK = 0.3, 0.02
SETTINGS = {"k5": (5, STRONG), "k6": (6, STRONG), "k12": (12, WEAK)}
PALM_PIECES = 3
FINGERS = ("little", "ring", "middle", "index", "thumb")


def make(data: Data) -> Finding:
    """Divide a hand three times, and find the fingers among the parts."""
    found = chosen(data, "hand", inner_radius=SMALL if data.quick else INNER_RADIUS)
    hand = found.shapes[0]
    limbs = fingers(hand)
    fields = spem.source_fields(spem.sources(hand, boundary="voxel"))
    parts = {name: region_parts(fields, k, sparsity=share) for name, (k, share) in SETTINGS.items()}
    own = {name: main_labels(several.node_labels, limbs.inside) for name, several in parts.items()}
    palm = {name: core_labels(several.node_labels, limbs) for name, several in parts.items()}
    numbers: dict[str, Any] = {
        "finger_parts": own,
        "own": {name: len(set(labels) - {-1, *palm[name]}) for name, labels in own.items()},
        "in_palm": palm,
        "overlap": [
            overlap(parts["k6"], a, parts["k12"], b) for a, b in zip(own["k6"], own["k12"], strict=True)
        ],
    }
    pictures = tuple(
        Picture(
            name,
            figure_components(parts[name], columns=6),
            f"{k} components, λ = {share:g} of the largest; numbered by size, with their share of all codes.",
        )
        for name, (k, share) in SETTINGS.items()
    )
    rows = tuple(
        (finger, f"{100 * both:.0f} %", f"{100 * within:.0f} %")
        for finger, (both, within) in zip(FINGERS, numbers["overlap"], strict=True)
    )
    head = ("finger", "shared by both, of either", "of the later, within the earlier")
    caption = "Nodes of each finger's component among six and among twelve."
    table = Table(caption, head, rows)
    return Finding(found.source, part_claims(numbers), pictures, tables=(table,), numbers=numbers)


def part_claims(numbers: dict[str, Any]) -> tuple[Claim, ...]:
    """Judge separation, preservation and what the further components are."""
    own, palm = numbers["own"], numbers["in_palm"]
    within = float(np.mean([later for _, later in numbers["overlap"]]))
    both = float(np.mean([either for either, _ in numbers["overlap"]]))
    extra = SETTINGS["k12"][0] - own["k12"] - len(palm["k12"])
    return (
        judged(
            "With a larger λ and six components, the fingers and the central part come apart (4.1, text).",
            "5 fingers and the central part",
            f"{own['k6']} fingers have a component of their own, {len(palm['k6'])} lies in the palm",
            own["k6"] == 5 and len(palm["k6"]) == 1,
            note="A finger shares its component with another or with the palm.",
        ),
        judged(
            "Five components do as well (caption of Figure 8a).",
            "k = 5",
            f"{own['k5']} fingers have a component of their own, {len(palm['k5'])} lies in the palm",
            own["k5"] == 5 and len(palm["k5"]) == 1,
            note="Five fingers and a palm are six parts, as the text says: with five, one of them is "
            "missing.",
        ),
        judged(
            "With twelve components and a low λ, those of the fingers are preserved (4.1).",
            "preserved",
            f"{own['k12']} fingers still have a component of their own, {100 * within:.0f} % of it within "
            f"that of six; shared by both, of either: {100 * both:.0f} %, for the roots have split off",
            own["k12"] == 5 and within > 0.5,
            note="Fingers are divided further.",
        ),
        judged(
            "The others stand for roots of fingers and for three parts of the palm (4.1).",
            f"{PALM_PIECES} parts of the palm, others at roots",
            f"{len(palm['k12'])} components lie in the palm, {extra} more in fingers, at their roots",
            len(palm["k12"]) == PALM_PIECES and extra > 0,
            note="Not all fingers have a root of their own among twelve; the palm takes what they leave. "
            "Which it is depends on the hand.",
        ),
    )


def overlap(earlier: Parts, a: int, later: Parts, b: int) -> tuple[float, float]:
    """Return the nodes that two parts share, as a share of those of either and of the later."""
    first, second = earlier.node_labels == a, later.node_labels == b
    shared = np.count_nonzero(first & second)
    return shared / np.count_nonzero(first | second), shared / np.count_nonzero(second)


if __name__ == "__main__":
    finding = present(make)
