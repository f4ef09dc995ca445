"""
Figure 19: precision against recall
===================================

Down the list of answers the recall grows, and the precision says how many of them were right so far. The
paper's curves lie so close to 1 that only the last part of the list tells methods apart (5.5). Those of the
other systems are of the distances of Table 1.
"""

import numpy as np

from spem.paper.data import Data
from spem.paper.findings import Finding, Picture, judged
from spem.paper.present import present
from spem.paper.systems import JOINED, PAPER, SPEM, measure
from spem.plots.curves import draw_precision_recall
from spem.plots.style import new_figure
from spem.retrieval.evaluation import precision_recall

DRAWN = (JOINED, SPEM, PAPER, "SD-GDM", "Shape-DNA", "meshSIFT", "MDS-CM-BOF")


def make(data: Data) -> Finding:
    """Draw the curves of our codes and of the best systems of the contest."""
    found = measure(data)
    scored = {name: row for name in DRAWN if (row := found.rows[name].scored) is not None}
    curves = {name: precision_recall(each.distances, found.labels) for name, each in scored.items()}
    figure = new_figure(4.6, 3.6)
    draw_precision_recall(curves, figure.add_subplot())
    best = curves[SPEM]
    at = float(np.interp(0.9, best.recall, best.precision))
    judgeable = found.real and not data.quick
    absent = "A reduced size; run it in full." if found.real else data.absent("shrec11")
    claim = judged(
        "Precision stays close to 1 until nearly all shapes of the class are found (Fig. 19).",
        "above 0.95 at a recall of 0.9, read off the figure",
        f"{at:.3f} at a recall of 0.9" if found.real else "not measured",
        at > 0.95,
        note=f"Hardest classes, FT: {scored[SPEM].hardest()}." if judgeable else absent,
        tested=judgeable,
    )
    numbers = {name: {"recall": c.recall, "precision": c.precision} for name, c in curves.items()}
    caption = "Precision against recall, each shape a query, averaged over all of them."
    return Finding(found.source, (claim,), (Picture("curves", figure, caption),), numbers=numbers)


if __name__ == "__main__":
    finding = present(make)
