"""64 fields and 6 maps against one field by others: ``python benchmarks/sweep_speed.py``.

The others solve one field, ρ = 30 voxels, to a relative residual of 1e-8: every hierarchy of pyamg that is
apt for this matrix, its setup included, and conjugate gradients of SciPy with the diagonal as preconditioner.
They take the assembled matrix for granted; our time starts at the shape. All run in turns in one process.
"""

from __future__ import annotations

import importlib.util
from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
import scipy.sparse
import scipy.sparse.linalg

import spem
from _shapes import BULKY, NAMES, THIN, TUBE, ball
from _table import Benchmark, Row, alternating, compile_kernels, data_root, timed
from spem.fields.operator import System, assemble
from spem.shapes.creatures import creature
from spem.shapes.shape import Shape

RHO_VOXELS, RESIDUAL = 30.0, 1e-8
N_RHO, N_MAPS = 64, 6
OURS = f"ours: hyperfield of {N_RHO} rho and {N_MAPS} maps"
OURS_FULL = f"ours: the same, all {N_RHO} fields materialised"
PLAIN = "scipy: CG, diagonal"
TO_PYAMG, TO_PLAIN = "to pyamg's fastest", "to plain CG"
RATIO_LIMIT = 0.5
HOPELESS = 2.0


def main(argv: list[str] | None = None) -> None:
    benchmark = Benchmark("sweep_speed", str(__doc__).splitlines()[0], argv)
    benchmark.fact("seconds to compile and warm up", compile_kernels())
    with_pyamg = importlib.util.find_spec("pyamg") is not None
    if not with_pyamg:
        benchmark.skip("the hierarchies of pyamg: pyamg is not installed (pip install pyamg)")
    voxels = 4_000 if benchmark.quick else 250_000
    ratios: list[Row] = []
    for name, make in shapes(benchmark, voxels).items():
        rows = compare(make(), with_pyamg, rounds=1 if benchmark.quick else 5)
        benchmark.table(f"{name}, {voxels // 1000}k nodes", rows)
        ratios += [row | {"shape": name} for row in rows if row["method"] in (OURS, OURS_FULL)]
    if benchmark.quick:
        benchmark.skip("ratios held against their target: the shapes are too small")
        ratios = []
    for method in (OURS, OURS_FULL):
        found = [row[TO_PYAMG] for row in ratios if row["method"] == method and row[TO_PYAMG] != ""]
        if found:
            benchmark.target(f"{method}, {TO_PYAMG}, worst shape", max(found), RATIO_LIMIT)
        for row in ratios:
            if row["method"] == method:
                benchmark.fact(f"{row['shape']}, {method}, {TO_PLAIN}", row[TO_PLAIN])
    benchmark.write()


def shapes(benchmark: Benchmark, voxels: int) -> dict[str, Callable[[], Shape]]:
    """Return made shapes, bulky and thin, and real ones where there are data."""
    chosen: dict[str, Callable[[], Shape]] = {"ball": partial(ball, voxels)}
    if not benchmark.quick:
        chosen["ant"] = lambda: creature("ant", ndim=3, voxels=voxels, rng=np.random.default_rng(2))
    root = data_root()
    for mesh in (TUBE,) if benchmark.quick else (TUBE, THIN, BULKY):
        if root is None or not (root / f"shrec11/{mesh}.obj").is_file():
            benchmark.skip(f"{NAMES[mesh]} {mesh} of shrec11: no such file under SPEM_DATA")
        else:
            file = root / f"shrec11/{mesh}.obj"
            chosen[f"{NAMES[mesh]} {mesh} of shrec11"] = partial(spem.read, file, voxels=voxels)
    return chosen


def compare(shape: Shape, with_pyamg: bool, rounds: int) -> list[Row]:
    """Time all methods on one shape, and check what the others reach."""
    system = assemble(shape)
    matrix = scipy.sparse.csr_matrix(system.matrix((RHO_VOXELS * min(shape.spacing)) ** -2.0))
    ours = {
        OURS: lambda: spem.maps(spem.sweep(shape, n_rho=N_RHO), N_MAPS),
        OURS_FULL: lambda: materialised(shape),
    }
    peers: dict[str, Callable[[], np.ndarray]] = {PLAIN: lambda: plain(matrix, system)}
    if with_pyamg:
        peers |= {f"pyamg: {k}": partial(v, matrix, system.rhs) for k, v in hierarchies().items()}
    once = {name: timed(call) for name, call in peers.items()}
    reached = {name: residual(matrix, system.rhs, v) for name, (_, v) in once.items()}
    # what was far from the fastest is not worth a second round, and keeps the time it took
    limit = HOPELESS * min(value for name, (value, _) in once.items() if name != PLAIN or not with_pyamg)
    in_turns = ours | {name: call for name, call in peers.items() if name == PLAIN or once[name][0] <= limit}
    seconds = {name: value for name, (value, _) in once.items()} | alternating(in_turns, rounds)
    rivals = [seconds[name] for name in peers if name != PLAIN]
    rows: list[Row] = []
    for name in (*ours, *peers):
        row: Row = {"method": name, "runs": rounds if name in in_turns else 1, "seconds": seconds[name]}
        row[TO_PYAMG] = seconds[name] / min(rivals) if rivals else ""
        row[TO_PLAIN] = seconds[name] / seconds[PLAIN]
        rows.append(row | {"residual": reached.get(name, "")})
    return rows


def materialised(shape: Shape) -> np.ndarray:
    """Sweep, take the maps and expand every field."""
    hyperfield = spem.sweep(shape, n_rho=N_RHO)
    spem.maps(hyperfield, N_MAPS)
    return np.asarray(hyperfield.fields())


def hierarchies() -> dict[str, Callable[[scipy.sparse.csr_matrix, np.ndarray], np.ndarray]]:
    """Return pyamg's solvers that are apt for this matrix; each takes matrix and right-hand side."""
    import pyamg

    makers = {
        "ruge_stuben": pyamg.ruge_stuben_solver,
        "smoothed_aggregation": pyamg.smoothed_aggregation_solver,
        "unsmoothed aggregation": partial(pyamg.smoothed_aggregation_solver, smooth=None),
    }

    def run(make: Callable[..., Any], accel: str | None, matrix: Any, rhs: np.ndarray) -> np.ndarray:
        return np.asarray(make(matrix, max_coarse=100).solve(rhs, tol=RESIDUAL, accel=accel, maxiter=300))

    solvers = {name: partial(run, make, None) for name, make in list(makers.items())[:2]}
    return solvers | {f"{name}, CG": partial(run, make, "cg") for name, make in makers.items()}


def plain(matrix: scipy.sparse.csr_matrix, system: System) -> np.ndarray:
    """Return the field by conjugate gradients with the diagonal as preconditioner."""
    jacobi = scipy.sparse.diags_array(1.0 / matrix.diagonal())
    return np.asarray(scipy.sparse.linalg.cg(matrix, system.rhs, rtol=RESIDUAL, maxiter=10_000, M=jacobi)[0])


def residual(matrix: scipy.sparse.csr_matrix, rhs: np.ndarray, v: np.ndarray) -> float:
    """Return the relative residual in the 2-norm."""
    return float(np.linalg.norm(rhs - matrix @ v) / np.linalg.norm(rhs))


if __name__ == "__main__":
    main()
