"""Fields of one source against exact solutions in 60 digits: ``python benchmarks/source_accuracy.py``.

Straight bars with the ``voxel`` boundary, the source at the middle of a short end. Conjugate gradients stand
beside the direct solver: they are right relative to the maximum of the field, so not where it is small.
"""

from __future__ import annotations

import math

import mpmath
import numpy as np

from _exact import bar_logs
from _table import Benchmark, Row, timed
from spem.fields.boundary.sources import Sources, point_sources
from spem.fields.operator import assemble
from spem.fields.solvers.cg import ConjugateGradient
from spem.fields.superposition.fields import solve_sources, source_values
from spem.shapes.shape import Shape

LIMIT = 1e-11
HELD = (((1200, 9), (math.inf, 5.0)), ((400, 5, 5), (math.inf, 5.0)))
# Beyond the range of float64: longer, narrower, and screened within a spacing.
BEYOND = (((4000, 5), (math.inf, 5.0)), ((1600, 3, 3), (math.inf, 2.0)), ((300, 9), (0.05,)))
SMALL = (((120, 9), (math.inf, 5.0)), ((60, 5, 5), (math.inf,)))
SMALL_BEYOND = (((700, 3), (math.inf,)),)


def main(argv: list[str] | None = None) -> None:
    benchmark = Benchmark("source_accuracy", str(__doc__).splitlines()[0], argv)
    held, beyond = (SMALL, SMALL_BEYOND) if benchmark.quick else (HELD, BEYOND)
    for title, cases in (("within the range of float64", held), ("below the range of float64", beyond)):
        rows = [accuracy(counts, rho) for counts, lengths in cases for rho in lengths]
        benchmark.table(title, rows)
        for row in rows:
            what = f"{row['nodes']}, rho {row['rho']:g}, worst relative error"
            benchmark.target(what, row["direct, error"], LIMIT)
    benchmark.write()


def accuracy(counts: tuple[int, ...], rho: float) -> Row:
    """Compare both solvers with the exact solution."""
    source = end_source(counts)
    seconds, fields = timed(lambda: solve_sources(source, rho))
    exact = bar_logs(counts, tuple(n // 2 for n in counts[1:]), rho)
    error = [abs(mpmath.expm1(mpmath.mpf(float(a)) - b)) for a, b in zip(fields.log[0], exact, strict=True)]
    values = source_values(source, rho, solver=ConjugateGradient(rtol=1e-14, max_iterations=20_000))[0]
    relative = np.array([abs(float(a / mpmath.exp(b) - 1)) for a, b in zip(values, exact, strict=True)])
    right = np.array([float(b) for b in exact])[relative <= LIMIT] / math.log(10)
    return {
        "nodes": " x ".join(map(str, counts)),
        "rho": rho,
        "log10 of smallest": float(min(exact)) / math.log(10),
        "direct, error": float(max(error)),
        "direct, seconds": seconds,
        "cg, error": float(relative.max()),
        "cg, log10 of smallest right": float(right.min(initial=0.0)),
    }


def end_source(counts: tuple[int, ...]) -> Sources:
    """Return the source at the middle of the first end of a bar."""
    sources = point_sources(assemble(Shape.from_mask(np.ones(counts)), "voxel"))
    middle = np.array([-1, *(n // 2 for n in counts[1:])])
    return sources.select([int(np.square(sources.position - middle).sum(axis=1).argmin())])


if __name__ == "__main__":
    main()
