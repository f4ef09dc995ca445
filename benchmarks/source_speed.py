"""Time and memory of many boundary sources: ``python benchmarks/source_speed.py``.

What is measured is one factorisation and the logarithms of the fields of all sources at ρ = inf, every entry
right in relative terms. SciPy's SuperLU without pivoting, the sparse direct solver that a pip installation
brings along, solves the same right-hand sides beside it. Every row runs in its own process, so that its peak
memory is its own.
"""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import scipy.sparse.linalg
from numpy.typing import NDArray

import spem
from _memory import peak
from _shapes import ball
from _table import Benchmark, Row, data_root, slope, timed
from spem.fields.boundary.patches import patch_sources
from spem.fields.boundary.sources import Sources, point_sources
from spem.fields.operator import assemble
from spem.fields.solvers.direct import Direct
from spem.fields.superposition.fields import solve_sources
from spem.shapes.shape import Shape

PATCHES = 200
SECONDS_LIMIT, BYTES_LIMIT = 60.0, 6 << 30
# SuperLU takes minutes beyond this, and gigabytes.
PEER_LIMIT = 100_000
REAL = {
    "hand of tari1000": ("tari1000/obj11_3.png", 0),
    "cat of tari1000": ("tari1000/obj9_1.png", 0),
    "horse, 15k": ("horse_poses/1.obj", 15_000),
    "horse, 60k": ("horse_poses/1.obj", 60_000),
    "horse, 250k": ("horse_poses/1.obj", 250_000),
}
MADE = {"ball, 15k": ("", 15_000), "ball, 60k": ("", 60_000)}
QUICK = {"ball, 2k": ("", 2_000)}


def main(argv: list[str] | None = None) -> None:
    benchmark = Benchmark("source_speed", str(__doc__).splitlines()[0], argv)
    root = data_root()
    cases = QUICK if benchmark.quick else MADE
    if root is None:
        benchmark.skip("real shapes: SPEM_DATA names no folder")
    elif not benchmark.quick:
        cases = REAL | cases
    rows = [
        measure(name, str(root / file) if root and file else "", size) for name, (file, size) in cases.items()
    ]
    benchmark.table("all sources at rho = inf", rows)
    for row in rows:
        if row["shape"] == "horse, 60k":
            benchmark.target("horse of 60k nodes, 200 patches, seconds", row["seconds"], SECONDS_LIMIT)
            benchmark.target("the same, peak memory in bytes", row["peak, GB"] * 1e9, BYTES_LIMIT)
    for name in ("horse", "ball"):
        same = [row for row in rows if row["shape"].startswith(name)]
        if len(same) > 1:
            nodes = [row["nodes"] for row in same]
            benchmark.fact(f"{name}, exponent of time", slope(nodes, [row["seconds"] for row in same]))
            benchmark.fact(
                f"{name}, exponent of the factor", slope(nodes, [row["factor, MB"] for row in same])
            )
    benchmark.write()


def measure(name: str, path: str, size: int) -> Row:
    """Run one case in its own process."""
    command = [sys.executable, str(Path(__file__).resolve()), "--child", name, path, str(size)]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    row: Row = json.loads(done.stdout.splitlines()[-1])
    return row


def child(name: str, path: str, size: int) -> None:
    """Measure one case and print the row as JSON; memory is read before the peer takes its own."""
    solve_sources(point_sources(assemble(ball(500))), np.inf)  # compile
    sources = make(path, size)
    system = sources.system
    rounds = 1 if system.n_nodes > PEER_LIMIT else 3
    seconds = min(timed(lambda: solve_sources(sources, np.inf))[0] for _ in range(rounds))
    held = peak()
    factor_seconds, factor = timed(lambda: Direct().prepare(system, 0.0))
    row: Row = {"shape": name, "nodes": system.n_nodes, "sources": sources.n_sources, "seconds": seconds}
    row |= {"of it, factorisation": factor_seconds, "GFlop": factor.dissection.flops / 1e9}
    row |= {"factor, MB": factor.nbytes / 1e6, "peak, GB": held / 1e9}
    if system.n_nodes <= PEER_LIMIT:
        rhs = sources.rhs.toarray()
        row["SuperLU, s"] = min(timed(lambda: superlu(system.matrix(), rhs))[0] for _ in range(rounds))
        row["ratio"] = seconds / row["SuperLU, s"]
    print(json.dumps(row), flush=True)


def make(path: str, size: int) -> Sources:
    """Every boundary point of a silhouette at inner radius 20, or patches of a solid."""
    shape: Shape
    if path and not size:
        shape = spem.read(path, inner_radius=20)
        return point_sources(assemble(shape, "voxel"))
    shape = spem.read(path, voxels=size) if path else ball(size)
    return patch_sources(assemble(shape), PATCHES, np.random.default_rng(0))


def superlu(matrix: Any, rhs: NDArray[np.float64]) -> NDArray[np.float64]:
    """Solve by SuperLU as an M-matrix allows: symmetric mode, no pivoting."""
    options = {"permc_spec": "MMD_AT_PLUS_A", "diag_pivot_thresh": 0.0, "options": {"SymmetricMode": True}}
    with np.errstate(divide="ignore"):
        return np.log(scipy.sparse.linalg.splu(matrix, **options).solve(rhs))


if __name__ == "__main__":
    if sys.argv[1:2] == ["--child"]:
        child(sys.argv[2], sys.argv[3], int(sys.argv[4]))
    else:
        main()
