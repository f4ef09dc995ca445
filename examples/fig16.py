"""
Figure 16: nodal domains of cats
================================

A projection is negative in some places of a shape and positive in others. Where it is clearly so, its
intensity beyond a threshold, are its nodal domains. The thresholds of a projection are the same for all
shapes (5.4): the intensities at nodes of all of them are put into three clusters by k-means, and the means
of the lowest and the highest are taken. The domains of a projection then lie in the same places of every
cat, whatever its pose: the inside of the body, head and legs, their ends.

One threshold for all shapes needs one scale, so every projection is first brought to root-mean-square one
over its shape. The first projection has one sign, since the fields are not centred before the PCA: its
domains are where it is lowest, deep inside, and where it is highest.
"""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from spem.codes.normalise import unit_rms
from spem.embedding.maps import Maps
from spem.embedding.nodal import nodal_clusters
from spem.paper.data import Data
from spem.paper.findings import Claim, Finding, Picture, judged
from spem.paper.moments import hyperfields, maps_over
from spem.paper.present import present
from spem.plots.domains import figure_domains

N_CATS, N_SHOWN = 7, 5
# Means nearer to zero than this part of the distance of the outer ones are very close to it; clusters of
# single shapes that deviate by less from shape to shape are very similar.
NEAR, SIMILAR = 0.1, 0.1


def make(data: Data) -> Finding:
    """Cut the maps of seven cats at thresholds learnt on silhouettes of all classes."""
    found = data.silhouettes("cat", N_CATS)
    cats = scaled(maps_over(hyperfields(found.shapes)))
    count = 1 if data.quick else 4
    others = data.collection("tari1000", ndim=2, per_class=count)
    maps = scaled(maps_over(hyperfields(others.items)))
    clusters = nodal_clusters([each.values for each in maps])
    own = np.stack([nodal_clusters([each.values], nodes_per_shape=1000) for each in maps])
    middle, spread = figures(clusters, own)
    names = [f"cat {number + 1}" if found.real else cats[number].shape.name for number in range(N_CATS)]
    figure = figure_domains(cats, clusters[:N_SHOWN, [0, 2]], names)
    caption = (
        f"Blue: negative, red: positive nodal domain, at thresholds learnt on {len(maps)} silhouettes "
        f"of {len(set(others.labels))} classes."
    )
    return Finding(
        f"{found.source} Thresholds: {others.source}",
        claims(middle, spread),
        (Picture("domains", figure, caption),),
        {"clusters": clusters, "middle": middle, "spread": spread},
    )


def scaled(several: list[Maps]) -> list[Maps]:
    """Bring projections to one scale."""
    return [replace(maps, values=unit_rms(maps.values)) for maps in several]


def figures(
    clusters: NDArray[np.float64], own: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return how far from zero the middle mean is, and how the outer ones deviate from shape to shape.

    Both in units of the distance of the outer means; of projections 2 and on, which have two signs.
    """
    between = (clusters[:, 2] - clusters[:, 0])[1:]
    deviation = own[:, 1:, [0, 2]].std(axis=0, ddof=1).mean(axis=1)
    return np.abs(clusters[1:, 1]) / between, deviation / between


def claims(middle: NDArray[np.float64], spread: NDArray[np.float64]) -> tuple[Claim, ...]:
    """Judge what 5.4 says on the clusters of intensities."""
    near, alike = int((middle < NEAR).sum()), int((spread < SIMILAR).sum())
    return (
        judged(
            "One of the three cluster means is very close to zero, the others are those of negative and of "
            "positive nodes (5.4).",
            "very close to zero",
            f"within {100 * middle.max():.0f} % of the distance of the outer means, for projections 2 to 9; "
            f"within {100 * NEAR:.0f} % for {near} of {len(middle)}",
            bool((middle < NEAR).all()),
            note="A projection that is strong in a small part has its middle cluster off zero, where its "
            "many weak nodes are.",
        ),
        judged(
            "Clustered shape by shape, the cluster centres are very similar (5.4).",
            "very similar",
            f"the outer means deviate by {100 * spread.min():.0f} to {100 * spread.max():.0f} % of their "
            f"distance from shape to shape; by less than {100 * SIMILAR:.0f} % for {alike} of {len(spread)}",
            bool((spread < SIMILAR).all()),
            note="Shapes of different classes differ in how much of them is thin; their means follow. Common "
            "thresholds are what makes domains comparable.",
        ),
    )


if __name__ == "__main__":
    finding = present(make)
