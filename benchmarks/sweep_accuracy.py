"""Worst error of any field of the sweep over ρ: ``python benchmarks/sweep_accuracy.py``.

The reference is the sweep to 1e-12, itself checked against sparse direct solutions on the small shapes.
Errors of a field are the largest over its nodes, and the 2-norm, each relative to that of the field.
"""

from __future__ import annotations

from functools import partial

import numpy as np

import spem
from _shapes import made, real
from _table import Benchmark, Row, compile_kernels, timed
from spem.fields.operator import assemble
from spem.fields.rho import sample_rho
from spem.fields.solvers.direct import Direct
from spem.fields.solvers.sweep import Sweep
from spem.shapes.shape import Shape

LIMIT = 1e-6
N_RHO = 64
# Above this many nodes a factorisation for each of a few ρ takes too long, in 2-D and in 3-D.
DIRECT_NODES = {2: 20_000, 3: 4_000}
RANGES = {"default": (None, None), "2 to 30 voxels": (2.0, 30.0), "1 to 10 voxels": (1.0, 10.0)}


def main(argv: list[str] | None = None) -> None:
    benchmark = Benchmark("sweep_accuracy", str(__doc__).splitlines()[0], argv)
    benchmark.fact("seconds to compile and warm up", compile_kernels())
    shapes = made(benchmark.quick) | {"ball, 3k": partial(spem.synthetic.ball, 1.0, 0.11)}
    shapes |= real(benchmark)
    labels = list(RANGES)[:2] if benchmark.quick else list(RANGES)
    rows = [measure(name, make(), label) for name, make in shapes.items() for label in labels]
    benchmark.table(f"errors of {N_RHO} fields, default settings", rows)
    worst = max(row["max-norm"] for row in rows)
    benchmark.target("worst error in the max-norm", worst, LIMIT)
    benchmark.target("worst error in the 2-norm", max(row["2-norm"] for row in rows), LIMIT)
    checked = [row["reference off"] for row in rows if row["reference off"] != ""]
    benchmark.fact("largest distance of the reference from direct solutions", max(checked))
    benchmark.write()


def measure(name: str, shape: Shape, label: str) -> Row:
    """Compare the fields of one shape and range with the reference."""
    low, high = RANGES[label]
    h = min(shape.spacing)
    rho = sample_rho(shape.size, low and low * h, high and high * h, N_RHO)
    seconds, hyperfield = timed(lambda: spem.sweep(shape, rho))
    fields = hyperfield.fields()
    system = assemble(shape)
    reference = Sweep(rtol=1e-12).solve(system, rho)
    reached = float(reference.residual.max())
    largest, root = relative_errors(fields, reference.values)
    off: float | str = ""
    if shape.n_nodes <= DIRECT_NODES[shape.ndim]:
        some = np.array([0, N_RHO // 2, N_RHO - 1])
        off = relative_errors(reference.values[:, some], Direct().solve(system, rho[some]).values)[0]
    row: Row = {"shape": name, "rho": label, "nodes": shape.n_nodes, "rank": hyperfield.rank}
    row |= {"seconds": seconds, "max-norm": largest, "2-norm": root, "claimed": hyperfield.error}
    return row | {"reference claims": reached, "reference off": off}


def relative_errors(fields: np.ndarray, reference: np.ndarray) -> tuple[float, float]:
    """Return the worst error over the columns, in the max-norm and in the 2-norm."""
    largest = root = 0.0
    for v, exact in zip(fields.T, reference.T, strict=True):
        difference = v.astype(np.float64) - exact
        largest = max(largest, float(np.abs(difference).max() / exact.max()))
        root = max(root, float(np.linalg.norm(difference) / np.linalg.norm(exact)))
    return largest, root


if __name__ == "__main__":
    main()
