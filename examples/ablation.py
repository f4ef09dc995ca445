"""
Ablation: one parameter at a time
=================================

The code of 5.5 has a number of projections d, a number of words k, a power α, a range and a number N of ρ,
a number of voxels and a boundary model. Each is varied alone, the others stay where the paper has them, and
the first tier (FT) tells what it does.
"""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from spem.codes.settings import Settings
from spem.paper.data import Collection, Data
from spem.paper.findings import Finding, Picture, Table, judged
from spem.paper.present import present
from spem.paper.scoring import Repeated, collect, repeat
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
    "voxels": "voxels",
    "boundary": "boundary",
    "scheme": "ρ spread",
}

Rows = dict[str, Repeated]


def make(data: Data) -> Finding:
    """Vary one parameter after the other."""
    found = data.collection("shrec11", ndim=3, per_class=3 if data.quick else None, voxels=1000)
    settings = Settings.paper(voxels=1000 if data.quick else BASE_VOXELS)
    seeds = 1 if data.quick else 3
    few = 2 if data.quick else None
    results = of_codes(found, settings, seeds, few)
    if not data.quick:
        results |= {name: of_fields(found, settings, seeds, name) for name in OF_FIELDS}
    best = {name: max(rows, key=lambda value: rows[value].mean["FT"]) for name, rows in results.items()}
    spread = {name: np.ptp([row.mean["FT"] for row in rows.values()]) for name, rows in results.items()}
    d = results["n_maps"]
    gain = d[str(OF_CODES["n_maps"][-1])].mean["FT"] - d["1"].mean["FT"] if not data.quick else 0.0
    claim = judged(
        "Several projections together say more than one (5.5 takes d = 6).",
        "d = 6",
        f"FT {gain:+.1f} from d = 1 to 10; best at d = {best['n_maps']}"
        if not data.quick
        else "not measured",
        gain > 0,
        note=data.absent("shrec11") if not found.real else "A reduced size; run it in full.",
        tested=found.real and not data.quick,
    )
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
                "First tier against each parameter; bars are one deviation of seeds.",
            ),
        ),
        tables=(Table(caption, ("parameter", "value", "NN", "FT", "FT, seeds"), cells),),
        numbers={"best": best, "spread of FT": spread}
        | {name: summary(rows) for name, rows in results.items()},
    )


def of_codes(found: Collection, settings: Settings, seeds: int, few: int | None) -> dict[str, Rows]:
    """Vary what does not touch the maps; those of fewer projections are the first of more."""
    features = collect(found, replace(settings, n_maps=max(OF_CODES["n_maps"])))
    results: dict[str, Rows] = {}
    for name, values in OF_CODES.items():
        rows: Rows = {}
        for value in values[:few]:
            change: dict[str, Any] = {name: value}
            chosen = replace(settings, **change)
            rows[str(value)] = repeat(features.first(chosen.n_maps), chosen, seeds)
        results[name] = rows
    return results


def of_fields(found: Collection, settings: Settings, seeds: int, name: str) -> Rows:
    """Vary what needs other fields or maps."""
    rows: Rows = {}
    for value in OF_FIELDS[name]:
        change: dict[str, Any] = {name: (value,) if name == "rho_ranges" else value}
        chosen = replace(settings, **change)
        label = f"{value[0]:g}–{value[1]:g}" if name == "rho_ranges" else str(value)
        rows[label] = repeat(collect(found, chosen), chosen, seeds)
    return rows


def summary(rows: Rows) -> dict[str, Mapping[str, float]]:
    """Return mean and deviation of FT for each value."""
    return {value: {"FT": row.mean["FT"], "deviation": row.deviation["FT"]} for value, row in rows.items()}


def chart(results: dict[str, Rows]) -> Figure:
    """Draw the first tier against each parameter, on one scale."""
    columns = min(4, len(results))
    figure = new_figure(9, 2.4 * -(-len(results) // columns))
    axes = figure.subplots(-(-len(results) // columns), columns, squeeze=False, sharey=True).ravel()
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
