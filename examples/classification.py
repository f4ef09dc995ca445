"""
Classification of silhouettes and meshes
========================================

Section 5.4 classifies silhouettes by Hu's moments, a weak description on purpose, and reaches 80 %. What do
the maps know beyond that? Here the same linear support vector machine is given the codes of Section 5.5,
which count how the maps differ from the words of a vocabulary, the moments of nodal domains, and both side by
side. Words and thresholds are learnt on articulated creatures that are in no collection, so that nothing of
a test shape is seen before it is classified. In some rows they are learnt on the collection, as in the paper.

SHREC'11 is classified at the two splits on which mesh networks are compared: ten shapes of each class for
training, or sixteen, and the others for the test.
"""

from dataclasses import replace
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from spem.paper.classes import BOTH, SIXTEEN, SMALL, TEN, classify_meshes, classify_silhouettes
from spem.paper.data import Collection, Data
from spem.paper.findings import Claim, Finding, Picture, Table, judged
from spem.paper.present import present
from spem.plots.fields import draw_outline
from spem.plots.style import TEXT_SIZE, new_figure
from spem.retrieval.classification import Classification
from spem.shapes.shape import Shape

N_HARDEST, N_MISTAKES = 12, 4
# Silhouettes and meshes of the reduced size.
FEW = 18


def make(data: Data) -> Finding:
    """Classify silhouettes and meshes by what is made of their maps."""
    count = 3 if data.quick else None
    plane = data.collection("tari1000", ndim=2, voxels=SMALL, per_class=count)
    solid = data.collection("shrec11", ndim=3, voxels=SMALL, per_class=count)
    if data.quick:
        plane, solid = (replace(c, items=c.items[:FEW], labels=c.labels[:FEW]) for c in (plane, solid))
    shapes, rows = classify_silhouettes(plane, quick=data.quick)
    rows |= classify_meshes(solid, quick=data.quick)
    caption = (
        "The silhouettes most often given another class, by codes and moments; the share of their tests."
    )
    return Finding(
        f"{plane.source} {solid.source}",
        (
            claim(
                rows[BOTH], "Silhouettes", 95.0, data, plane, "80 % by moments of nine projections (Fig. 17)"
            ),
            claim(rows[TEN], "Meshes", 99.0, data, solid, "not in the paper"),
            claim(rows[SIXTEEN], "Meshes", 99.0, data, solid, "not in the paper"),
        ),
        (Picture("hardest", hardest(shapes, plane, rows[BOTH]), caption),),
        {name: to_json(found) for name, found in rows.items()},
        tables=(table(rows),),
    )


def claim(found: Classification, what: str, goal: float, data: Data, shapes: Collection, paper: str) -> Claim:
    """Judge whether an accuracy reaches what is asked of the codes."""
    full = shapes.real and not data.quick
    name = "tari1000" if what == "Silhouettes" else "shrec11"
    note = "Classes that differ in details of their outline alone are taken for each other."
    if not full:
        note = "A reduced size; run it in full." if data.find(name) else data.absent(name)
    return judged(
        f"{what} are classified by their maps, {found.n_train if full else 'some'} of each class for "
        f"training: {goal:g} % or more.",
        paper,
        f"{found.mean:.2f} ± {found.deviation:.2f} %" if full else "not measured",
        found.mean >= goal,
        note=note,
        tested=full,
    )


def to_json(found: Classification) -> dict[str, Any]:
    """Return accuracy, accuracy of each class, and what was taken for what."""
    return {
        "mean": found.mean,
        "deviation": found.deviation,
        "splits": found.accuracies.size,
        "n_train": found.n_train,
        "per_class": found.per_class(),
        "mistaken": found.mistaken()[:20],
    }


def table(rows: dict[str, Classification]) -> Table:
    """Return the accuracy by each kind of vector, and its commonest mistakes."""
    cells = []
    for name, found in rows.items():
        share = f"{found.mean:.2f}", f"{found.deviation:.2f}"
        wrong = [f"{row} for {column} ({count})" for row, column, count in found.mistaken()[:N_MISTAKES]]
        cells.append(
            (name, str(found.n_train), str(found.accuracies.size), *share, ", ".join(wrong) or "none")
        )
    caption = (
        "Accuracy in percent, its standard deviation from split to split, and classes that were taken for "
    )
    caption += "others, with the number of times over all splits."
    head = ("vectors", "training, each class", "splits", "accuracy", "deviation", "commonest mistakes")
    return Table(caption, head, tuple(cells))


def hardest(shapes: list[Shape], collection: Collection, found: Classification) -> Figure:
    """Draw the silhouettes most often given another class."""
    order = np.argsort(-np.nan_to_num(found.errors), kind="stable")[:N_HARDEST]
    figure = new_figure(7.2, 3.2)
    for ax, i in zip(figure.subplots(2, N_HARDEST // 2).flat, order, strict=False):
        draw_outline(shapes[i], ax)
        # Boxes of several heights hang from one line, that of the titles.
        ax.set_anchor("N")
        ax.set_title(f"{collection.labels[i]}, {100 * found.errors[i]:.0f} %", fontsize=TEXT_SIZE)
    return figure


if __name__ == "__main__":
    finding = present(make)
