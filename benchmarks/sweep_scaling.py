"""Time and memory of the sweep against the number of nodes: ``python benchmarks/sweep_scaling.py``.

What is measured is 64 fields and 6 maps. Every size runs in its own process, so that its peak memory is its
own. Bytes a node are what the peak of the process grew by during the sweep and the maps, without the shape
(made before) and with it.
"""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import numpy as np

import spem
from _memory import forget_peak, peak, resident
from _shapes import ball, meshed
from _table import Benchmark, Row, compile_kernels, slope, timed
from spem.shapes.creatures import creature_mesh
from spem.shapes.shape import Shape

N_RHO, N_MAPS = 64, 6
EXPONENT_LIMIT, BYTES_LIMIT = 1.1, 400
# Below this the fixed memory of a process hides what a node takes.
SMALLEST_FOR_BYTES = 200_000
SIZES = (15_000, 60_000, 250_000, 1_000_000, 4_000_000)
QUICK = (5_000, 20_000)


def main(argv: list[str] | None = None) -> None:
    benchmark = Benchmark("sweep_scaling", str(__doc__).splitlines()[0], argv)
    for name in ("ball",) if benchmark.quick else ("ball", "ant"):
        rows = [measure(name, size, benchmark.quick) for size in (QUICK if benchmark.quick else SIZES)]
        benchmark.table(name, rows)
        nodes, seconds = ([row[key] for row in rows] for key in ("nodes", "seconds"))
        benchmark.target(f"{name}, exponent of time against nodes", slope(nodes, seconds), EXPONENT_LIMIT)
        large = [row for row in rows if row["nodes"] > SMALLEST_FOR_BYTES]
        if large:
            bytes_a_node = max(row["bytes a node"] for row in large)
            benchmark.target(f"{name}, peak bytes a node", bytes_a_node, BYTES_LIMIT)
    benchmark.write()


def measure(name: str, size: int, quick: bool) -> Row:
    """Run one size in its own process."""
    rounds = str(1 if quick else max(1, min(5, 1_000_000 // size)))
    command = [sys.executable, str(Path(__file__).resolve()), "--child", name, str(size), rounds]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    row: Row = json.loads(done.stdout.splitlines()[-1])
    return row


def child(name: str, size: int, rounds: int) -> None:
    """Measure one size and print the row as JSON; memory is read after the first round."""
    compile_kernels((3,))
    before = resident()
    shape = make(name, size)
    made = resident()
    forget_peak()
    first = timed(lambda: spem.maps(spem.sweep(shape, n_rho=N_RHO), N_MAPS))[0]
    after = max(peak(), resident())
    times = [first] + [
        timed(lambda: spem.maps(spem.sweep(shape, n_rho=N_RHO), N_MAPS))[0] for _ in range(rounds - 1)
    ]
    n = shape.n_nodes
    row: Row = {"nodes": n, "grid": shape.mask.size, "seconds": float(np.median(times))}
    row["microseconds a node"] = 1e6 * row["seconds"] / n
    row["bytes a node"] = (after - made) / n
    row["with the shape"] = (after - before) / n
    row["process peak, MB"] = after / 1e6
    print(json.dumps(row))


def make(name: str, size: int) -> Shape:
    """Return a bulky or a thin shape of so many nodes."""
    if name == "ball":
        return ball(size)
    return meshed(*creature_mesh(name, np.random.default_rng(3)), size, name)


if __name__ == "__main__":
    if sys.argv[1:2] == ["--child"]:
        child(sys.argv[2], int(sys.argv[3]), int(sys.argv[4]))
    else:
        main()
