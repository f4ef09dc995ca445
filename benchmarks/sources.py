"""Plain fields of many sources, iterated and factored: ``python benchmarks/sources.py``.

`MultigridGradients` takes eight sources at a time and holds a few vectors; `Direct` factors once, then solves
for any number; `ConjugateGradient` takes one source after the other. What is measured is one preparation, the
time of each source beyond it, and the largest error of a field relative to its maximum, against `Direct`.
Where the factor does not fit into the memory limit there is no `Direct`, and no error. The number of sources
up to which iteration is the faster one follows from both times. h is the spacing. A CUDA device is measured
beside the processor where there is one.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import numpy as np
from numpy.typing import NDArray

import spem
from _shapes import ball
from _table import Benchmark, Row, data_root, timed
from spem.errors import SizeError, SpemError
from spem.fields.boundary.patches import patch_sources
from spem.fields.boundary.sources import Sources
from spem.fields.operator import assemble
from spem.fields.solvers.cg import ConjugateGradient
from spem.fields.solvers.cuda.device import Cuda
from spem.fields.solvers.direct import Direct
from spem.fields.solvers.engine import Backend
from spem.fields.solvers.gradients import MultigridGradients
from spem.fields.solvers.protocol import SourceSolver
from spem.shapes.shape import Shape

PATCHES = 200
# Plain conjugate gradients take one source after the other, so a few of them tell the time of each.
FEW = 8
# In spacings; the other one is infinite.
RHO = 10.0
# Figures are medians of some rounds; of large shapes, which take long, there is one.
ROUNDS, LARGE = 3, 100_000
ERROR_LIMIT = 1e-8
ITERATED = "MultigridGradients"
HORSES = {"horse, 15k": 15_000, "horse, 60k": 60_000, "horse, 250k": 250_000}
BALLS = {"ball, 15k": 15_000, "ball, 60k": 60_000, "ball, 250k": 250_000}


def main(argv: list[str] | None = None) -> None:
    benchmark = Benchmark("sources", str(__doc__).splitlines()[0], argv)
    rows: list[Row] = []
    device = find_device(benchmark)
    for name, make in shapes(benchmark).items():
        shape = make()
        sources = patch_sources(assemble(shape), PATCHES, np.random.default_rng(0))
        for rho in (RHO * min(shape.spacing), np.inf):
            rows += measure(name, sources, rho, device)
    benchmark.table(f"{PATCHES} sources", rows)
    errors = [row["error"] for row in rows if row["solver"] == ITERATED and "error" in row]
    if errors:
        benchmark.target(f"largest error of {ITERATED}", max(errors), ERROR_LIMIT)
    benchmark.write()


def shapes(benchmark: Benchmark) -> dict[str, Callable[[], Shape]]:
    """Return the shapes to measure, by name."""
    if benchmark.quick:
        return {"ball, 2k": partial(ball, 2_000)}
    made: dict[str, Callable[[], Shape]] = {name: partial(ball, size) for name, size in BALLS.items()}
    root = data_root()
    if root is None:
        benchmark.skip("real shapes: SPEM_DATA names no folder")
        return made
    mesh = root / "horse_poses" / "1.obj"
    return {name: partial(spem.read, mesh, voxels=size) for name, size in HORSES.items()} | made


def find_device(benchmark: Benchmark) -> Backend | None:
    """Return the CUDA device if there is one; say why not otherwise."""
    try:
        Cuda().runtime()
    except SpemError as error:
        benchmark.skip(f"device: {error}")
        return None
    return Cuda()


def measure(name: str, sources: Sources, rho: float, device: Backend | None) -> list[Row]:
    """Measure all solvers on one shape at one ρ, in turns."""
    system, rhs = sources.system, sources.rhs.toarray()
    solvers: dict[str, SourceSolver] = {"Direct": Direct(), ITERATED: MultigridGradients()}
    if device is not None:
        solvers[f"{ITERATED}, device"] = MultigridGradients(device=device)
    solvers["ConjugateGradient"] = ConjugateGradient()
    rows: dict[str, Row] = {}
    times: dict[str, list[tuple[float, float]]] = {}
    values: dict[str, NDArray[np.float64]] = {}
    for key, solver in solvers.items():
        columns = rhs[:, :FEW] if key == "ConjugateGradient" else rhs
        rows[key] = {"shape": name, "nodes": system.n_nodes, "rho": "inf" if np.isinf(rho) else f"{RHO:g} h"}
        rows[key] |= {"solver": key, "sources": columns.shape[1]}
        try:
            solver.prepare(system, rho**-2.0).solve(rhs[:, :1])  # compile
        except SizeError as error:
            rows[key]["all, s"] = str(error)
        else:
            times[key] = []
    for _ in range(1 if system.n_nodes > LARGE else ROUNDS):
        for key, taken in times.items():
            preparing, prepared = timed(partial(solvers[key].prepare, system, rho**-2.0))
            solving, values[key] = timed(partial(prepared.solve, rhs[:, : rows[key]["sources"]]))
            taken.append((preparing, solving))
    for key, taken in times.items():
        preparing, solving = map(float, np.median(taken, axis=0))
        rows[key] |= {"prepare, s": preparing, "each, ms": 1e3 * solving / rows[key]["sources"]}
        rows[key]["all, s"] = preparing + solving if rows[key]["sources"] == rhs.shape[1] else ""
    compare(rows, values)
    return list(rows.values())


def compare(rows: dict[str, Row], values: dict[str, NDArray[np.float64]]) -> None:
    """Add errors against the direct solver, and the number of sources up to which it is the slower one."""
    if "Direct" not in values:
        return
    direct, exact = rows["Direct"], values.pop("Direct")
    for key, found in values.items():
        true = exact[:, : found.shape[1]]
        rows[key]["error"] = float(np.max(np.abs(found - true).max(axis=0) / true.max(axis=0)))
        spare = rows[key]["each, ms"] - direct["each, ms"]
        rows[key]["faster up to"] = int(1e3 * direct["prepare, s"] / spare) if spare > 0 else "any number"


if __name__ == "__main__":
    main()
