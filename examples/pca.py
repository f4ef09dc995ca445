"""
Which reduction gives consistent maps
=====================================

A map is of use for matching if it takes the same value at the same point of a body in all its poses. Section
4.2 prefers linear PCA of the fields over ρ to independent component analysis (ICA), locally linear embedding
(LLE), diffusion maps and probabilistic PCA, and gives no figures. Here each method reduces the fields at the
nodes of each pose to six numbers, each pose by itself. Then component k of one pose is correlated with
component k of another over points of the volume that are known to correspond: in the order in which a method
gives its components, in the best order for the pair, and allowing for any mixture of them. What is lost in
the first but not in the last is a matter of order and rotation alone; what is lost in all is information.

The neighbours of LLE and the width ε of the kernel of diffusion maps are free; two of each are shown. ICA and
probabilistic PCA start from chance: from the same numbers in all poses, and from numbers of their own.
"""

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from spem.paper.agreement import Agreement
from spem.paper.data import Data
from spem.paper.findings import Finding, Picture
from spem.paper.pca import judge, measure
from spem.paper.poses import absences, load_poses
from spem.paper.present import present
from spem.plots.style import COLOURS, INK, MARKERS, TEXT_SIZE, TITLE_SIZE, framed, new_figure

N_COMPONENTS = 6
# What is claimed of a rival, its variants, and why it could differ.
RIVALS = (
    (
        "Independent component analysis forms inconsistent mappings (4.2).",
        ("ICA", "ICA, own starts"),
        "From one start in all poses its components come in one order, and are as consistent.",
    ),
    (
        "Locally linear embedding leads to fewer features and less consistency (4.2).",
        ("LLE, 12 neighbours", "LLE, 60 neighbours"),
        "With few neighbours it does; with many it averages more, and comes up to PCA.",
    ),
    (
        "Diffusion maps overlearn the ρ-space: fewer features and less consistency (4.2).",
        ("diffusion maps, ε", "diffusion maps, ε/1000"),
        "They fall apart where the kernel is so narrow that it follows the single rows. A wide kernel makes "
        "them smooth functions of the rows, as consistent as PCA.",
    ),
    (
        "Linear PCA outperforms probabilistic PCA solved by maximum likelihood (4.2).",
        ("probabilistic PCA", "probabilistic PCA, own starts"),
        "Its components happen to be turned alike.",
    ),
)
CURVES = ("PCA (SPEM)", "ICA", "LLE, 12 neighbours", "diffusion maps, ε", "probabilistic PCA")


def make(data: Data) -> Finding:
    """Reduce the fields of all poses by all methods and compare at corresponding points."""
    sets = load_poses(data, n_inside=500 if data.quick else 1500, n_marks=2)
    found = {poses.name: measure(poses, N_COMPONENTS, 32 if data.quick else 64) for poses in sets}
    missing = absences(data, sets)
    return Finding(
        " ".join(poses.source for poses in sets),
        tuple(judge(statement, names, found, why, missing) for statement, names, why in RIVALS),
        (
            Picture(
                "consistency",
                draw(found),
                "Left: mean correlation of six components between poses. Right: that of each component, in "
                "the order that its method gives.",
            ),
        ),
        {name: {method: told(a) for method, a in by.items()} for name, by in found.items()},
    )


def told(a: Agreement) -> dict[str, Any]:
    """Return the figures of one method."""
    means = dict(zip(("own order", "best order", "any mixture"), a.means, strict=True))
    return {"mean": means, "above 0.9": a.n_same, "each": a.ordered.mean(axis=0)}


def draw(found: dict[str, dict[str, Agreement]]) -> Figure:
    """Draw means as bars and single components as curves, a row for each set of poses."""
    figure = new_figure(9.4, 0.5 + 3.2 * len(found))
    axes = figure.subplots(len(found), 2, squeeze=False, width_ratios=(1.2, 1))
    for (bars, lines), (name, by) in zip(axes, found.items(), strict=True):
        at = np.arange(len(by))
        for j, kind in enumerate(("own order", "best order", "any mixture")):
            means = [a.means[j] for a in by.values()]
            bars.barh(at + 0.27 * (j - 1), means, 0.25, color=COLOURS[j], label=kind)
        framed(bars, f"{name}: mean correlation between poses", "")
        bars.set_yticks(at, list(by), fontsize=TEXT_SIZE)
        bars.invert_yaxis()
        bars.set(xlim=(0, 1))
        curves(lines, by)
        lines.set_title(f"{name}: each component, own order", fontsize=TITLE_SIZE, color=INK)
    bars, lines = axes[0]
    bars.legend(fontsize=TEXT_SIZE, frameon=False, ncols=3, loc="lower center", bbox_to_anchor=(0.5, 1.0))
    lines.legend(fontsize=TEXT_SIZE, frameon=False, loc="lower left")
    return figure


def curves(ax: Axes, by: dict[str, Agreement]) -> None:
    """Draw the correlation of each component."""
    at = np.arange(1, N_COMPONENTS + 1)
    for method, colour, marker in zip(CURVES, COLOURS, MARKERS, strict=False):
        ax.plot(at, by[method].ordered.mean(axis=0), color=colour, marker=marker, markersize=4, label=method)
    framed(ax, "component", "correlation")
    ax.set(ylim=(0, 1.02))


if __name__ == "__main__":
    finding = present(make)
