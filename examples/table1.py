"""
Table 1: retrieval of SHREC'11
==============================

Every mesh of the collection is a query in turn; all others are ranked by the distance of their descriptions,
for codes the correlation distance. NN, FT, ST, E and DCG say how many of the answers are of the query's class
(5.5). All systems of the table are built from their publications and run on the same copy of the collection,
of 500 faces a mesh; sums of two are sums of their distances, each brought to [0, 1]. A vocabulary is a matter
of chance, so rows of codes are means over seeds of its k-means; one learnt on other shapes than those that
are searched says what a user may expect who keeps a model and asks it about new shapes.
"""

from matplotlib.figure import Figure

from spem.paper.data import Data
from spem.paper.findings import Finding, Picture
from spem.paper.present import present
from spem.paper.systems import JOINED, SPEM, Measured, measure
from spem.paper.table1 import (
    PUBLISHED,
    gain_claim,
    joined_claim,
    notes_table,
    outside_claim,
    row_claim,
    scores_table,
    spem_claim,
)
from spem.plots.style import COLOURS, framed, new_figure
from spem.retrieval.evaluation import MEASURES


def make(data: Data) -> Finding:
    """Score all systems of the table, our codes with three kinds of vocabulary, and the joined code."""
    found = measure(data)
    judgeable = found.real and not data.quick
    absent = data.absent("shrec11") if not found.real else "A reduced size; run it in full."
    order = [*PUBLISHED, *(name for name in found.rows if name not in PUBLISHED)]
    rows = {name: found.rows[name] for name in order}
    claims = [spem_claim(name, found, judgeable, absent) for name in MEASURES]
    claims += [joined_claim(found, judgeable, absent), gain_claim(found, judgeable, absent)]
    if found.real:
        claims.append(outside_claim(found, judgeable, absent))
    claims += [
        row_claim(name, rows[name], judgeable=judgeable, absent=absent) for name in PUBLISHED if name != SPEM
    ]
    scored = {name: row for name, row in rows.items() if row.scored is not None}
    return Finding(
        found.source,
        tuple(claims),
        (Picture("classes", chart(found), "First tier of each class, worst first."),),
        tables=(scores_table(rows, found.seeds), notes_table(rows)),
        numbers={
            name: row.scored.to_json() | {"seconds": row.seconds}
            for name, row in scored.items()
            if row.scored
        }
        | {"paper": {name: list(values) for name, values in PUBLISHED.items()}},
    )


def chart(found: Measured) -> Figure:
    """Draw the first tier of each class, maps alone and joined: what is lost is lost in a few."""
    tiers = {
        name: {str(label): each["FT"] for label, each in scored.scores[0].per_class().items()}
        for name in (SPEM, JOINED)
        if (scored := found.rows[name].scored) is not None
    }
    names = sorted(tiers[SPEM], key=lambda label: tiers[SPEM][label])
    figure = new_figure(8, 2.6)
    ax = figure.add_subplot()
    for shift, (name, values) in enumerate(tiers.items()):
        places = [i + 0.4 * (shift - 0.5) for i in range(len(names))]
        ax.bar(places, [values[label] for label in names], 0.4, color=COLOURS[shift], label=name)
    ax.set_xticks(range(len(names)), names, rotation=60, ha="right", fontsize=7)
    ax.legend(loc="lower right")
    framed(ax, "", "FT, %")
    return figure


if __name__ == "__main__":
    finding = present(make)
