"""
Figure 12: the same boundary parts in three poses
=================================================

Divide the boundary of a cat into eight parts, as in Figure 11, in each of three poses: head, front and back of
the body, tail and four legs. Each pose is divided by itself, as in the paper; then parts are put in
correspondence, so that a colour means one part. Below, all poses are divided together and share their
components: then nothing is to be matched.

Legs and tail are found by an opening of the silhouette and told by their order along the outline. A pose is
divided well if each of the five has a segment of its own; a division is consistent if each keeps its number.
"""

from collections.abc import Sequence

import numpy as np

import spem
from spem.decomposition.division import boundary_parts
from spem.decomposition.joint import joint_parts
from spem.decomposition.matching import match_parts
from spem.decomposition.parts import Parts
from spem.paper.data import Data
from spem.paper.findings import Claim, Finding, Picture, Table, judged
from spem.paper.limbs import legs_and_tail, main_labels
from spem.paper.present import present
from spem.paper.silhouettes import chosen
from spem.plots.parts import figure_parts

N_PARTS, PATCHES, LIMBS = 8, 200, 5
# All cats of the collection of which opening finds five limbs or more.
MORE = (1, 2, 3, 4, 6, 8, 10, 15, 16)


def make(data: Data) -> Finding:
    """Divide three cats each by itself and all together; then all cats whose limbs are known."""
    found = chosen(data, "cat")
    more = chosen(data, "cat", MORE) if found.real and not data.quick else found
    fields = [spem.source_fields(spem.sources(cat, PATCHES, boundary="voxel")) for cat in more.shapes]
    first = [more.shapes.index(cat) for cat in more.shapes if cat.name in {one.name for one in found.shapes}]
    starts = 2 if data.quick else 8
    apart = [boundary_parts(of, N_PARTS, n_init=starts) for of in fields]
    three = match_parts([apart[i] for i in first]).parts
    together = joint_parts(fields, N_PARTS, over="boundary", n_init=starts // 2).parts
    numbers = {
        "apart": [own_segments(parts) for parts in apart],
        "trunk": [N_PARTS - count for count in (own_segments(parts) for parts in apart)],
        "matched": [limb_labels(parts) for parts in three],
        "together": [limb_labels(parts) for parts in together],
        "weak": [int(np.count_nonzero(parts.intensity * N_PARTS < 0.1)) for parts in together],
        "least": [float(parts.intensity.min() * N_PARTS) for parts in together],
        "odd": odd_segments(together),
    }
    pictures = (
        Picture("apart", figure_parts(three), "Each pose divided by itself; equal parts matched afterwards."),
        Picture(
            "together",
            figure_parts([parts.without_weak() for parts in together]),
            "Poses divided together, without segments of less than a tenth of the mean intensity.",
        ),
    )
    head = (
        "cat",
        "limbs with a segment of their own",
        "other segments",
        "divided together: number of each limb",
    )
    rows = tuple(
        (cat.name, f"{own} of {LIMBS}", str(rest), " ".join(map(str, labels)))
        for cat, own, rest, labels in zip(
            more.shapes, numbers["apart"], numbers["trunk"], numbers["together"], strict=True
        )
    )
    caption = (
        "Boundary segments of each cat, divided by itself; and the numbers of its limbs, divided together."
    )
    return Finding(
        found.source,
        pose_claims(numbers, len(first)),
        pictures,
        tables=(Table(caption, head, rows),),
        numbers=numbers,
    )


def pose_claims(numbers: dict[str, object], count: int) -> tuple[Claim, ...]:
    """Judge the segments of three poses and of all, and how weak the odd ones are."""
    own, matched, joint = numbers["apart"], numbers["matched"], numbers["together"]
    kept = agreement(matched)
    kept_joint = agreement(joint)
    odd = numbers["odd"]
    return (
        judged(
            "Eight boundary segments reveal the head, front and rear of the body, the tail and four legs, in three "
            "highly different poses (5.2).",
            "8 segments: 5 limbs and 3 others in each pose",
            f"limbs with a segment of their own: {', '.join(map(str, own[:count]))} of {LIMBS}; in all poses "
            f"measured {sum(own)} of {LIMBS * len(own)}",
            min(own[:count]) == LIMBS,
            note="A limb shares its segment with the trunk or with another.",
        ),
        judged(
            "The structures are very coherent: each keeps its number (5.2).",
            "coherent",
            f"{100 * kept:.0f} % of the limbs have one number in all {count} poses, divided apart and matched; "
            f"{100 * kept_joint:.0f} % in {len(joint)} poses, divided together",
            kept == 1 or kept_joint == 1,
            note="Matching afterwards has to tell like legs apart; divided together they keep their numbers.",
        ),
        judged(
            "An additional segment, in a leg of one pose only, can be detected by its low intensity (5.2).",
            "low intensity",
            f"divided together, {len(odd)} segments lie on another limb than elsewhere; "
            + (f"the strongest of them has {max(odd):.2f} of the mean intensity" if odd else "none is odd")
            + f"; {sum(numbers['weak'])} segments have less than a tenth and are dropped",
            all(value < 0.5 for value in odd),
            note="An inconsistent segment is as strong as others.",
        ),
    )


def limb_labels(parts: Parts) -> list[int]:
    """Return the part of legs and tail, in their order along the outline."""
    return main_labels(parts.source_labels, legs_and_tail(parts.shape).touched(parts.sources))


def own_segments(parts: Parts) -> int:
    """Return how many limbs have a part most of which they hold themselves."""
    limbs = legs_and_tail(parts.shape).touched(parts.sources)
    labels = main_labels(parts.source_labels, limbs)
    held = [np.mean(limb[parts.source_labels == j]) > 0.5 for j, limb in zip(labels, limbs, strict=True)]
    return len({label for label, mine in zip(labels, held, strict=True) if mine})


def agreement(labels: Sequence[Sequence[int]]) -> float:
    """Return the share of limbs that have the number that most poses give them, over all poses."""
    table = np.array(labels)
    most = [np.bincount(column + 1).argmax() - 1 for column in table.T]
    return float(np.mean(table == most))


def odd_segments(several: Sequence[Parts]) -> list[float]:
    """Return the intensity, in units of the mean, of segments that lie elsewhere than in most poses."""
    places = np.full((len(several), several[0].n_parts), -2)
    for row, parts in zip(places, several, strict=True):
        limbs = legs_and_tail(parts.shape).touched(parts.sources)
        where = np.where(limbs.any(axis=0), limbs.argmax(axis=0), -1)
        for part in np.unique(parts.source_labels[parts.source_labels >= 0]):
            row[part] = np.bincount(where[parts.source_labels == part] + 1).argmax() - 1
    usual = [np.bincount(column[column > -2] + 1).argmax() - 1 for column in places.T]
    strange = (places != usual) & (places > -2)
    return [float(several[i].intensity[j] * several[i].n_parts) for i, j in np.argwhere(strange)]


if __name__ == "__main__":
    finding = present(make)
