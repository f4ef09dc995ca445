"""Eigenpairs of shapes: time against other methods, and error against closed forms.

``python benchmarks/spectra.py``. The peers are ARPACK, shifted and inverted by SciPy's SuperLU as it comes,
and by the same factorisation as ours, one vector at a time. All find the hundred lowest pairs with a free
boundary to one tolerance, in turns.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import numpy as np
import scipy.sparse.linalg
from scipy.special import jn_zeros

import spem
from _shapes import ball
from _table import Benchmark, Row, alternating, compile_kernels, slope
from spem.codes.kinds import shape_features
from spem.codes.settings import Settings
from spem.fields.operator import System, assemble
from spem.fields.solvers.direct import Direct
from spem.fields.spectrum import free_system
from spem.shapes.creatures import creature
from spem.shapes.shape import Shape

TOLERANCE = 1e-6
RATIO_LIMIT, ORDER_LIMIT = 0.6, 1.9
KINDS = ("spem", "hks", "si-hks", "wks")
SUPERLU_NODES = 6000  # above, SuperLU takes the time of all others together

Pairs = tuple[np.ndarray, np.ndarray]


def main(argv: list[str] | None = None) -> None:
    benchmark = Benchmark("spectra", str(__doc__).splitlines()[0], argv)
    benchmark.fact("seconds to compile or load kernels", compile_kernels((2, 3)))
    count = 30 if benchmark.quick else 100
    rows = [row for name, shape in shapes(benchmark.quick).items() for row in race(name, shape, count)]
    benchmark.table(f"the {count} lowest pairs", rows)
    largest = [row for row in rows if row["method"] == "block Lanczos"][-1]
    benchmark.target("time against ARPACK on the same factor, largest shape", largest["ratio"], RATIO_LIMIT)
    accuracy(benchmark)
    features(benchmark)
    benchmark.write()


def shapes(quick: bool) -> dict[str, Shape]:
    """Return a silhouette and solids of two sizes."""
    rng = np.random.default_rng
    found = {"dog 2-D, 3k": creature("dog", voxels=600 if quick else 3000, rng=rng(0))}
    if not quick:
        found["dog 3-D, 5k"] = creature("dog", ndim=3, voxels=5000, rng=rng(0))
        found["dog 3-D, 15k"] = creature("dog", ndim=3, voxels=15_000, rng=rng(0))
        found["ball, 15k"] = ball(15_000)
    return found


def race(name: str, shape: Shape, count: int) -> list[Row]:
    """Time all methods on one shape, and compare what they find."""
    system = free_system(assemble(shape))
    shift = shape.size**-2
    calls: dict[str, Callable[[], Pairs]] = {
        "block Lanczos": lambda: ours(shape, count),
        "ARPACK, same factor": lambda: arpack(system, shift, count, own_factor=True),
    }
    if shape.n_nodes < SUPERLU_NODES:
        calls["ARPACK, SuperLU"] = lambda: arpack(system, shift, count, own_factor=False)
    seconds = alternating(calls, 3)
    laplacian, rows = system.matrix(), []
    exact = arpack(system, shift, count, own_factor=True, tolerance=0.0)[0]
    for method, call in calls.items():
        values, vectors = call()
        unit = vectors / np.linalg.norm(vectors, axis=0)
        residual = np.linalg.norm(laplacian @ unit - unit * values, axis=0).max() / values[-1]
        row: Row = {"shape": name, "nodes": shape.n_nodes, "method": method, "seconds": seconds[method]}
        row |= {"ratio": seconds[method] / seconds["ARPACK, same factor"], "residual": residual}
        rows.append(row | {"error of values": np.abs(values - exact).max() / exact[-1]})
    return rows


def ours(shape: Shape, count: int) -> Pairs:
    """Find the pairs as the package does."""
    found = spem.solve_spectrum(shape, count)
    return found.values, found.vectors


def arpack(
    system: System, shift: float, count: int, *, own_factor: bool, tolerance: float = TOLERANCE
) -> Pairs:
    """Find the pairs by ARPACK, factoring with the package or with SuperLU."""
    inverse = None
    if own_factor:
        factor = Direct().prepare(system, shift)
        inverse = scipy.sparse.linalg.LinearOperator(
            (system.n_nodes, system.n_nodes), matvec=lambda x: factor.solve(x.ravel()), dtype=np.float64
        )
    start = np.random.default_rng(0).standard_normal(system.n_nodes)
    pairs = scipy.sparse.linalg.eigsh(
        system.matrix(), count, sigma=-shift, OPinv=inverse, tol=tolerance, v0=start
    )
    return np.asarray(pairs[0]), np.asarray(pairs[1])


def accuracy(benchmark: Benchmark) -> None:
    """Hold the values of the disk and of the ball with an absorbing boundary against their zeros."""
    rng = np.random.default_rng(7)
    placements = 2 if benchmark.quick else 8
    zeros = sorted(zero**2 for n in range(6) for zero in [*jn_zeros(n, 3)] * (1 + (n > 0)))
    radial = [np.pi, 4.493409457909064, 5.763459196894550]  # spherical Bessel functions of order 0, 1, 2
    exact = {2: np.array(zeros[:6]), 3: np.repeat(np.square(radial), (1, 3, 5))}
    for ndim, name in ((2, "disk"), (3, "ball")):
        spacings = np.array([0.2, 0.14, 0.1] if ndim == 3 else [0.1, 0.07, 0.05])
        spacings = spacings if benchmark.quick else np.append(spacings, spacings[-2:] / 2)
        rows: list[Row] = []
        for h in spacings:
            made = [
                spem.synthetic.n_ball(1.0, h, ndim, offset=tuple(rng.uniform(size=ndim)))
                for _ in range(placements)
            ]
            found = [
                spem.solve_spectrum(shape, exact[ndim].size, boundary="absorbing").values for shape in made
            ]
            error = float(np.abs(np.array(found) / exact[ndim] - 1).mean())
            rows.append({"spacing": h, "nodes": made[0].n_nodes, "mean error of values": error})
        benchmark.table(f"{name}, absorbing, {exact[ndim].size} pairs", rows)
        order = slope(spacings, [row["mean error of values"] for row in rows])
        benchmark.target(f"{name}, order of the values", order, ORDER_LIMIT, at_least=True)


def features(benchmark: Benchmark) -> None:
    """Time the features of each kind, from shape to nodes."""
    rows = []
    for name, shape in shapes(benchmark.quick).items():
        calls = {kind: partial(shape_features, shape, Settings(features=kind)) for kind in KINDS}
        seconds = alternating(calls, 3)
        rows.append({"shape": name, "nodes": shape.n_nodes} | {f"{k}, s": v for k, v in seconds.items()})
    benchmark.table("node features", rows)


if __name__ == "__main__":
    main()
