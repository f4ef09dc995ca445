"""
The ingredients of a code (5.5)
===============================

The paper drops the nodes next to the boundary, brings each projection to unit length and weights it by its
deviation over the collection, and takes a power of the residuals. Each is said to help. Here each is left
out in turn, and the rest kept as it is.
"""

import numpy as np
from matplotlib.figure import Figure

from spem.codes.settings import Settings
from spem.paper.ablation import WHOLE, leave_out
from spem.paper.data import Data
from spem.paper.findings import Claim, Finding, Picture, Table, judged
from spem.paper.present import present
from spem.paper.scoring import Repeated
from spem.plots.style import COLOURS, framed, new_figure
from spem.retrieval.evaluation import MEASURES

COLLECTIONS = {"shrec11": (3, 15_000), "tari1000": (2, 2_000)}
STATED = {
    "boundary layer kept": "Leaving out the nodes next to the boundary helps",
    "intensities as they are": "Unit length times the deviation of each projection helps",
    "unit length, no deviation": "Weighting by the deviation helps",
    "no power law": "The power law, α = 0.25, helps",
}


def make(data: Data) -> Finding:
    """Leave out one ingredient after the other."""
    seeds = 2 if data.quick else 5
    claims: list[Claim] = []
    tables, results = [], {}
    for name, (ndim, voxels) in COLLECTIONS.items():
        per_class = 3 if data.quick else None
        # Thin meshes have no node off the boundary with so few.
        voxels = 1200 if data.quick and data.find(name) is None else voxels
        found = data.collection(name, ndim=ndim, per_class=per_class, voxels=voxels)
        rows = leave_out(found, Settings.paper(voxels=voxels), seeds)
        results[found.name if found.real else f"creatures, {ndim}-D"] = rows
        cells = tuple((what, *row.row(), f"{row.deviation['FT']:.2f}") for what, row in rows.items())
        caption = f"{name if found.real else f'Creatures, {ndim}-D'}: means over {seeds} seeds, in percent."
        tables.append(Table(caption, ("code", *MEASURES, "FT, seeds"), cells))
        tested = found.real and not data.quick
        why = "A reduced size; run it in full." if found.real else data.absent(name)
        claims += [claim(name, what, rows, tested, why) for what in STATED]
    return Finding(
        "SHREC'11 (simplified copy) and the 1000-shape database, creatures where absent; v = 1 on voxels.",
        tuple(claims),
        (
            Picture(
                "ingredients", chart(results), "First tier of each code; bars show ± one deviation of seeds."
            ),
        ),
        tables=tuple(tables),
        numbers={name: {what: row.to_json() for what, row in rows.items()} for name, rows in results.items()},
    )


def claim(name: str, what: str, rows: dict[str, Repeated], tested: bool, why: str) -> Claim:
    """Judge one ingredient by the change of FT, against what seeds change."""
    whole, without = rows[WHOLE], rows[what]
    gain = whole.mean["FT"] - without.mean["FT"]
    error = float(np.hypot(whole.deviation["FT"], without.deviation["FT"]) / np.sqrt(len(whole.scores)))
    helps = gain > 2 * error
    note = (
        f"A gain has to exceed two standard errors, {2 * error:.2f}; here it {'is' if gain > 0 else 'was'} "
    )
    note += f"{'too small to tell' if abs(gain) <= 2 * error else 'a loss on this collection'}."
    return judged(
        f"{STATED[what]} (5.5), on {name}.",
        "helps",
        f"FT {without.mean['FT']:.1f} → {whole.mean['FT']:.1f} ({gain:+.1f})" if tested else "not measured",
        helps,
        note=note if tested else why,
        tested=tested,
    )


def chart(results: dict[str, dict[str, Repeated]]) -> Figure:
    """Draw the first tier of every code."""
    figure = new_figure(8, 2.8)
    axes = figure.subplots(1, len(results), squeeze=False)[0]
    for ax, (name, rows) in zip(axes, results.items(), strict=True):
        values, spreads = zip(*((row.mean["FT"], row.deviation["FT"]) for row in rows.values()), strict=True)
        ax.barh(list(rows), values, xerr=spreads, color=[COLOURS[0]] + [COLOURS[4]] * (len(rows) - 1))
        ax.invert_yaxis()
        ax.set_title(name, fontsize=9)
        framed(ax, "FT, %", "")
    return figure


if __name__ == "__main__":
    finding = present(make)
