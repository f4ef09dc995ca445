"""Pictures of how the time of a sweep grows with nodes, ρ and shapes at once."""

from __future__ import annotations

from _table import Benchmark, Row
from spem.plots.style import COLOURS, MARKERS, new_figure

# Title of a table starts with this -> name of the picture, key along the axis, key of the time.
PICTURES = {
    "one shape alone": ("nodes", "nodes", "seconds"),
    "number of rho": ("rho", "rho", "seconds"),
    "shapes at once": ("batch", "batch", "ms a shape"),
}


def draw(benchmark: Benchmark) -> None:
    """Draw what was measured, one picture a table, beside the JSON file."""
    for title, rows in benchmark.tables.items():
        for words, (name, across, key) in PICTURES.items():
            if words in title and rows:
                _draw(rows, across, key).savefig(benchmark.out / f"gpu_sweep_{name}.png")


def _draw(rows: list[Row], across: str, key: str) -> object:
    """Draw one line for each side and shape, both axes in logarithms."""
    figure = new_figure(4.2, 3.2)
    axis = figure.add_subplot()
    lines: dict[str, list[Row]] = {}
    for row in rows:
        size = "" if across == "nodes" else f", {_thousands(row['nodes'])} nodes"
        lines.setdefault(f"{row['side']}, {row['shape']}{size}", []).append(row)
    for i, (label, found) in enumerate(lines.items()):
        style = {"color": COLOURS[i % len(COLOURS)], "marker": MARKERS[i % len(MARKERS)]}
        axis.loglog([row[across] for row in found], [row[key] for row in found], label=label, **style)
    axis.set(xlabel={"batch": "shapes at once", "rho": "number of ρ"}.get(across, across), ylabel=key)
    axis.grid(alpha=0.3)
    axis.legend(fontsize=7)
    return figure


def _thousands(count: int) -> str:
    """Write a number of nodes in thousands, alike for shapes of one size."""
    return f"{round(count, -3) // 1000:g}k"
