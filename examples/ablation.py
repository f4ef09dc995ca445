"""
Ablation: one parameter at a time
=================================

The code of 5.5 has a number of projections d, a number of words k, a power α, a range and a number N of ρ,
a number of voxels and a boundary model. Each is varied alone, the others stay where the paper has them, and
the first tier (FT) tells what it does.
"""

from typing import Any

import numpy as np
from matplotlib.figure import Figure

from spem.codes.settings import Settings
from spem.paper.ablation import Rows, vary_codes, vary_fields
from spem.paper.data import Data
from spem.paper.findings import Claim, Finding, Picture, Table, judged
from spem.paper.present import present
from spem.plots.style import COLOURS, framed, new_figure

BASE_VOXELS = 8_000
# What is learnt from the same maps, and what needs other fields.
OF_CODES: dict[str, tuple[Any, ...]] = {
    "n_maps": (1, 2, 3, 4, 6, 8, 10),
    "n_centers": (8, 16, 32, 64, 128),
    "power": (0.1, 0.25, 0.5, 0.75, 1.0),
}
OF_FIELDS: dict[str, tuple[Any, ...]] = {
    "rho_ranges": ((0.0127, 0.127), (0.0254, 0.254), (0.05, 0.5), (0.1, 1.0), (0.0254, 0.5)),
    "n_rho": (8, 16, 32, 64, 128),
    "voxels": (1_000, 2_000, 4_000, 8_000, 16_000, 32_000),
    "boundary": ("voxel", "surface"),
    "scheme": ("linear", "squared", "log"),
}
WORDS = {
    "n_maps": "d, projections",
    "n_centers": "k, words",
    "power": "α",
    "rho_ranges": "range of ρ, in sizes",
    "n_rho": "N, number of ρ",
    "voxels": "voxels, boundary layer kept",
    "boundary": "boundary",
    "scheme": "ρ spread",
}


def make(data: Data) -> Finding:
    """Vary one parameter after the other."""
    found = data.collection("shrec11", ndim=3, per_class=3 if data.quick else None, voxels=1000)
    settings = Settings.paper(voxels=1000 if data.quick and not found.real else BASE_VOXELS)
    seeds = 1 if data.quick else 3
    of_codes = {name: values[:2] for name, values in OF_CODES.items()} if data.quick else OF_CODES
    results = vary_codes(found, settings, seeds, of_codes)
    if not data.quick:
        results |= vary_fields(found, settings, seeds, OF_FIELDS)
    best = {name: max(rows, key=lambda value: rows[value].mean["FT"]) for name, rows in results.items()}
    spread = {name: np.ptp([row.mean["FT"] for row in rows.values()]) for name, rows in results.items()}
    tested = found.real and not data.quick
    why = "A reduced size; run it in full." if found.real else data.absent("shrec11")
    note = "A gain has to exceed two standard errors of seeds." if tested else why
    claim = projections_claim(results["n_maps"], best["n_maps"], tested=tested, note=note)
    cells = tuple(
        (WORDS[name], value, f"{row.mean['NN']:.1f}", f"{row.mean['FT']:.1f}", f"{row.deviation['FT']:.2f}")
        for name, rows in results.items()
        for value, row in rows.items()
    )
    caption = (
        f"One parameter varied, the others as in 5.5 but {settings.voxels:,} voxels; {seeds} seeds, percent."
    )
    return Finding(
        found.source,
        (claim,),
        (
            Picture(
                "ablation",
                chart(results),
                "First tier against each parameter, scales apart; bars are one deviation of seeds.",
            ),
        ),
        tables=(Table(caption, ("parameter", "value", "NN", "FT", "FT, seeds"), cells),),
        numbers={"best": best, "spread of FT": spread}
        | {name: {value: row.to_json() for value, row in rows.items()} for name, rows in results.items()},
    )


def projections_claim(rows: Rows, best: str, *, tested: bool, note: str) -> Claim:
    """Judge six projections against one by FT, against what seeds change."""
    one, six = rows["1"], rows.get("6", rows["1"])
    gain = six.mean["FT"] - one.mean["FT"]
    error = float(np.hypot(one.deviation["FT"], six.deviation["FT"]) / np.sqrt(len(one.scores)))
    return judged(
        "Several projections together say more than one (5.5 takes d = 6).",
        "d = 6",
        f"FT {gain:+.1f} from d = 1 to 6; best at d = {best}" if tested else "not measured",
        gain > 2 * error,
        note=note,
        tested=tested,
    )


def chart(results: dict[str, Rows]) -> Figure:
    """Draw the first tier against each parameter, on one scale."""
    columns = min(4, len(results))
    figure = new_figure(9, 2.4 * -(-len(results) // columns))
    axes = figure.subplots(-(-len(results) // columns), columns, squeeze=False).ravel()
    for ax, (name, rows) in zip(axes, results.items(), strict=False):
        means = [row.mean["FT"] for row in rows.values()]
        spreads = [row.deviation["FT"] for row in rows.values()]
        ax.errorbar(range(len(rows)), means, yerr=spreads, color=COLOURS[0], marker="o", capsize=2)
        ax.set_xticks(range(len(rows)), list(rows), rotation=35, ha="right", fontsize=7)
        framed(ax, WORDS[name], "FT, %")
    for ax in axes[len(results) :]:
        ax.remove()
    return figure


if __name__ == "__main__":
    finding = present(make)
