"""
SPEM beside signatures of heat and waves
========================================

The heat kernel signature of a node is the heat that stays there, p_t(x, x), as a function of time t. With
(3.5) it follows from eigenvalues and eigenvectors of the Laplacian, here of the shape's interior with a
boundary that lets nothing pass, as in the volumetric signature that the paper cites. The scale-invariant
signature (SI-HKS) takes scale out of it by a Fourier transform over log t; the wave kernel signature (WKS)
asks for energies in place of times. SPEM varies ρ instead, and takes principal components over it.

All four are functions on the same nodes of the same shapes. So each goes through the same code (5.5), of the
same length, and the same search, and its scores say what it is worth.
"""

from matplotlib.figure import Figure

from spem.embedding.signatures import shared_times, shared_values
from spem.paper.data import Data
from spem.paper.findings import Claim, Finding, Picture, judged
from spem.paper.present import present
from spem.paper.spectra import KindScores, score_kinds, signature_bands
from spem.paper.spectra_pictures import NAMES, figure_features, figure_scores, table_scores

COUNTS = (2, 4, 8)
# Collection, dimension, voxels of a shape: with more, scores change little.
FULL = (("tari1000", 2, 2000), ("shrec11", 3, 5000))
QUICK = (("tari1000", 2, 300),)
SHOWN = (0, 2, 5, 7)


def make(data: Data) -> Finding:
    """Score codes of four kinds of features on two collections."""
    seeds, per_class = (1, 3) if data.quick else (3, None)
    sizes = {"n_pairs": 30, "n_centers": 16} if data.quick else {}
    found, claims = [], []
    for name, ndim, voxels in QUICK if data.quick else FULL:
        shapes = data.collection(name, ndim=ndim, per_class=per_class, voxels=voxels)
        found.append(score_kinds(shapes, COUNTS, seeds, voxels=voxels, **sizes))
        absent = "A reduced size; run it in full." if data.find(name) else data.absent(name)
        claims += claims_of(found[-1], name, absent, tested=shapes.real and not data.quick)
    caption = f"Scores of codes of {max(COUNTS)} features a node, and the first tier with fewer."
    return Finding(
        " ".join(each.collection.source for each in found) + " The same voxels for all kinds.",
        (family_claim(found), *claims),
        (
            Picture(
                "signatures", signatures(data), "Four of eight features of each kind, each on its own scale."
            ),
            Picture("scores", figure_scores(found), caption),
        ),
        tables=tuple(table_scores(each, seeds) for each in found),
        numbers={each.collection.name: each.to_json() for each in found},
    )


def family_claim(found: list[KindScores]) -> Claim:
    """Judge whether the two families hold much of each other."""
    words = "; ".join(f"{e.collection.name} {e.shared[0]:.2f} and {e.shared[1]:.2f}" for e in found)
    return judged(
        "The family of heat kernels over t is similar in spirit to that of fields over ρ (3.3).",
        "similar in spirit",
        f"shares of the variance of HKS that are linear in SPEM, and of fields in HKS: {words}",
        min(min(each.shared) for each in found) > 0.5,
        note="Less than half of one is a linear function of the other: alike in idea, not in values.",
    )


def claims_of(found: KindScores, name: str, absent: str, *, tested: bool) -> list[Claim]:
    """Judge power by the first tier, and compactness by that of few features."""
    rivals = [(count, found.tiers["spem"][count], *found.rival(count)) for count in COUNTS]
    ahead = [round(ours, 1) >= round(best, 1) for _, ours, _, best in rivals]
    words = [f"{n} features: SPEM {ours:.1f}, {NAMES[k]} {best:.1f}" for n, ours, k, best in rivals]
    every = ", ".join(f"{NAMES[kind]} {tier[max(COUNTS)]:.1f}" for kind, tier in found.tiers.items())
    label, ours, theirs = found.most_apart(rivals[-1][2])
    behind = (
        f"{NAMES[rivals[-1][2]]} is ahead, most on class {label} ({theirs:.0f} against {ours:.0f}). The "
        "paper compares with heat kernels of surfaces in their own codes; its code serves volumes too."
    )
    power = judged(
        f"The embedding has representation power (3.3); read as: on {name} no volumetric signature has a "
        "higher FT in the same code.",
        "verified experimentally",
        every if tested else "not measured",
        ahead[-1],
        note=behind if tested else absent,
        tested=tested,
    )
    compact = judged(
        f"The embedding is compact (3.3); read as: on {name} no volumetric signature has a higher FT with "
        "few features a node.",
        "verified experimentally",
        "; ".join(words[:-1]) if tested else "not measured",
        all(ahead[:-1]),
        note="Another signature tells more with as few." if tested else absent,
        tested=tested,
    )
    return [power, compact]


def signatures(data: Data) -> Figure:
    """Draw features of each kind on a hand."""
    hand = data.silhouettes("hand", 1, inner_radius=10 if data.quick else 20).shapes[0]
    made = signature_bands(hand, max(COUNTS), n_pairs=40 if data.quick else 100)
    size = hand.size**2
    times, energies = (
        shared_times(hand.size, 2, 100, 8) / size,
        shared_values(hand.size, 2, 100, 10)[1:-1] * size,
    )
    titles = {
        "spem": [f"P{j + 1}" for j in SHOWN],
        "hks": [f"t = {times[j]:.2g} L²" for j in SHOWN],
        "si-hks": [f"frequency {j}" for j in SHOWN],
        "wks": [f"e = {energies[j]:.3g}/L²" for j in SHOWN],
    }
    return figure_features(hand, {kind: bands[0][:, SHOWN] for kind, bands in made.items()}, titles)


if __name__ == "__main__":
    finding = present(make)
