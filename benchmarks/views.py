"""Views that the server sends of a shape: processor seconds, size of the body, error in single precision."""

from __future__ import annotations

import statistics
import time
from typing import Any

import numpy as np

import spem
from _shapes import made, real
from _table import Benchmark, Row
from spem.server.arrays import pack_arrays
from spem.server.views import VIEWS
from spem.server.views.options import shown_shape
from spem.shapes.shape import Shape

NODES = 16_000
SECONDS, MEGABYTES, ERROR = 0.3, 1.5, 1e-5
CALLS: dict[str, tuple[str, dict[str, Any]]] = {
    "geometry": ("geometry", {}),
    "field": ("field", {}),
    "parts, 6": ("parts", {"k": 6}),
    "parts, chosen": ("parts", {}),
    "source": ("source", {"patch": 0}),
}


def measure(shape: Shape, rounds: int) -> list[Row]:
    """Return the cost of each view of a shape, at the median of some rounds after a first one."""
    rows = []
    for name, (view, options) in CALLS.items():
        seconds = []
        for _ in range(rounds + 1):
            start = time.process_time()
            body = pack_arrays(*VIEWS[view](shape, options))
            seconds.append(time.process_time() - start)
        later = statistics.median(seconds[1:])
        rows.append({"view": name, "first": seconds[0], "s": later, "MB": len(body) / 1e6})
    return rows


def field_error(shape: Shape) -> float:
    """Return the largest error of the fields that a browser multiplies out, against sharp ones."""
    _, arrays = VIEWS["field"](shape, {})
    rho = arrays["rho"].astype(np.float64)[:: max(1, arrays["rho"].size // 4)]
    sharp = spem.field(shown_shape(shape, {}), rho)
    shown = arrays["basis"] @ arrays["coefficients"][:: max(1, arrays["rho"].size // 4)].T
    return float(np.abs(shown - sharp).max())


def main(argv: list[str] | None = None) -> None:
    benchmark = Benchmark("views", str(__doc__).splitlines()[0], argv)
    shapes = made(benchmark.quick) | real(benchmark)
    worst: dict[str, list[float]] = {"seconds": [], "megabytes": [], "error": []}
    for name, factory in shapes.items():
        shape = factory()
        if shape.ndim not in (2, 3):
            continue
        rows = measure(shape, 1 if benchmark.quick else 3)
        benchmark.table(f"{name}: {shape.n_nodes} nodes", rows)
        worst["error"].append(field_error(shape))
        if shape.n_nodes <= NODES:
            first_page = [row for row in rows if row["view"] in ("geometry", "field")]
            worst["seconds"].append(sum(row["s"] for row in first_page))
            worst["megabytes"].append(sum(row["MB"] for row in first_page))
    benchmark.target(f"geometry and field, up to {NODES} nodes, seconds", max(worst["seconds"]), SECONDS)
    benchmark.target(f"geometry and field, up to {NODES} nodes, MB", max(worst["megabytes"]), MEGABYTES)
    benchmark.target("largest error of a field in single precision", max(worst["error"]), ERROR)
    benchmark.write()


if __name__ == "__main__":
    main()
