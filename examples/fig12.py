"""
Figure 12: the same boundary parts in three poses
=================================================

Divide the boundary of a cat into eight parts, as in Figure 11, in each of three poses: head, front and back
of the body, tail and four legs. Each pose is divided by itself, as in the paper; then parts are put in
correspondence, so that a colour means one part. Below, all poses are divided together and share their
components: then nothing is to be matched.

Legs and tail are found by an opening of the silhouette and told by their order along the outline. A pose is
divided well if each of the five has a segment of its own; a division is consistent if each keeps its
number.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np

import spem
from spem.decomposition.division import boundary_parts
from spem.decomposition.joint import joint_parts
from spem.decomposition.matching import match_parts
from spem.paper.data import INNER_RADIUS, Data
from spem.paper.findings import Claim, Finding, Picture, Table, judged
from spem.paper.present import present
from spem.paper.segments import Segments, agreement, odd_segments
from spem.paper.silhouettes import SMALL, chosen
from spem.plots.parts import figure_parts

N_PARTS, PATCHES, LIMBS, STARTS = 8, 200, 5, 4
# Parts below this share of the mean intensity are weak, as for `Parts.without_weak`.
WEAK = 0.1
# All cats of the collection of which opening finds five limbs or more.
MORE = (1, 2, 3, 4, 6, 8, 10, 15, 16)


def make(data: Data) -> Finding:
    """Divide cats each by itself and all together."""
    found = chosen(data, "cat", inner_radius=SMALL if data.quick else INNER_RADIUS)
    cats = chosen(data, "cat", MORE).shapes if found.real and not data.quick else found.shapes
    fields = [spem.source_fields(spem.sources(cat, PATCHES, boundary="voxel")) for cat in cats]
    apart = [boundary_parts(of, N_PARTS, n_init=STARTS) for of in fields]
    three = match_parts(apart[: len(found.shapes)]).parts
    joint = joint_parts(fields, N_PARTS, over="boundary", n_init=STARTS).parts
    alone, matched, together = (
        [Segments.of(parts) for parts in several] for several in (apart, three, joint)
    )
    kept = [parts.without_weak(WEAK) for parts in joint]
    pictures = (
        Picture("apart", figure_parts(three), "Each pose divided by itself; parts matched afterwards."),
        Picture("together", figure_parts(kept), "Poses divided together, without weak segments."),
    )
    numbers = {
        "own": [one.own for one in alone],
        "on_trunk": [one.on_trunk for one in alone],
        "matched": [one.labels for one in matched],
        "together": [one.labels for one in together],
        "agreement": {"matched": agreement(matched), "together": agreement(together)},
        "odd": odd_segments(together),
        "weak": [int(np.count_nonzero(one.intensity < WEAK)) for one in together],
    }
    claims, table = pose_claims(numbers, len(three)), table_segments(cats, alone, together)
    return Finding(found.source, claims, pictures, tables=(table,), numbers=numbers)


def table_segments(cats: Sequence[spem.Shape], alone: list[Segments], together: list[Segments]) -> Table:
    """Return what each cat's segments are."""
    rows = tuple(
        (cat.name, f"{one.own} of {LIMBS}", str(one.on_trunk), " ".join(map(str, joint.labels)))
        for cat, one, joint in zip(cats, alone, together, strict=True)
    )
    return Table(
        "Boundary segments of each cat, divided by itself; numbers of its limbs, all divided together.",
        ("cat", "limbs with a segment of their own", "others", "limbs, divided together"),
        rows,
    )


def pose_claims(numbers: dict[str, Any], count: int) -> tuple[Claim, ...]:
    """Judge the segments of three poses and of all, and how weak the odd ones are."""
    own, trunk, kept, odd = (numbers[key] for key in ("own", "on_trunk", "agreement", "odd"))
    poses = len(own)
    return (
        judged(
            "Eight boundary segments reveal the head, front and rear of the body, the tail and four legs, in "
            "three highly different poses (5.2).",
            "5 limbs, and 3 others, in each pose",
            f"divided by themselves, {', '.join(map(str, own[:count]))} limbs with a segment of their own "
            f"and {', '.join(map(str, trunk[:count]))} others; in {poses} poses {sum(own)} of "
            f"{LIMBS * poses} limbs",
            set(own[:count]) == {LIMBS} and set(trunk[:count]) == {N_PARTS - LIMBS},
            note="A limb shares its segment with the trunk, or has more than one.",
        ),
        judged(
            "The structures after decomposition are very coherent (5.2).",
            "very coherent",
            f"{100 * kept['matched']:.0f} % of the limbs of {count} poses have one number when the poses are "
            f"divided apart and matched, {100 * kept['together']:.0f} % of those of {poses} divided together",
            kept["matched"] == 1,
            note="Of parts divided apart, as in the paper, a leg is matched with another leg.",
        ),
        judged(
            "An additional segment, in a leg of one pose only, can be detected by its low intensity (5.2).",
            "low intensity",
            f"divided together, {len(odd)} of {N_PARTS * poses} segments lie elsewhere than in most poses, "
            f"with at most {max(odd, default=0.0):.2f} of the mean intensity; {sum(numbers['weak'])} have "
            f"less than {WEAK:g} and are dropped",
            max(odd, default=0.0) < WEAK,
            note="It is the weakest of its pose, but not by an order of magnitude: a threshold that drops it "
            "depends on the poses."
            if odd
            else "No segment lies elsewhere than in the other poses.",
            tested=bool(odd),
        ),
    )


if __name__ == "__main__":
    finding = present(make)
