"""Why the sweep is what it is: the candidates for 64 ρ on one shape each: ``python benchmarks/solvers.py``.

Candidates solve for the default range of 64 ρ and aim at errors of 1e-6 of the field's maximum, which is what
the sweep is asked for. Those that take one ρ at a time are run for a few of them, spread over the range;
their time for all is extrapolated from that, and marked. Errors are the largest over nodes and fields,
against the sweep to 1e-12.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import scipy.sparse

from _shapes import Factories, ball, comb, made, real
from _table import Benchmark, Row, compile_kernels, timed
from spem.fields.operator import System, assemble
from spem.fields.rho import sample_rho
from spem.fields.solvers.cg import ConjugateGradient
from spem.fields.solvers.direct import Direct
from spem.fields.solvers.explicit import ExplicitIteration
from spem.fields.solvers.sweep import Sweep

N_RHO, SAMPLED = 64, 4
RTOL = 1e-6
# The candidates take minutes on each of the largest shapes: one bulky and one thin are enough.
LARGEST = ("ball, 250k", "ant T1 of shrec11, 250k")
# Past these, a candidate takes minutes or gigabytes; the table says so instead.
DIRECT_NODES = {2: 200_000, 3: 20_000}
EXPLICIT_NODES = 3_000
SHIFTED_NODES = 300_000

Fields = tuple[np.ndarray, np.ndarray, int]  # indices of the ρ solved for, fields, iterations


def main(argv: list[str] | None = None) -> None:
    benchmark = Benchmark("solvers", str(__doc__).splitlines()[0], argv)
    benchmark.fact("seconds to compile and warm up", compile_kernels())
    shapes: Factories = {"comb, 2k": comb, "ball, 3k": lambda: ball(3000)}
    if not benchmark.quick:
        large = made(quick=False) | real(benchmark)
        shapes |= {name: make for name, make in large.items() if not name.endswith("250k") or name in LARGEST}
    for name, make in shapes.items():
        system = assemble(make())
        rho = sample_rho(system.shape.size, count=N_RHO)
        exact = Sweep(rtol=1e-12).solve(system, rho).values
        title = f"{name}: {system.n_nodes} nodes"
        benchmark.table(title, [race(*item, system, rho, exact) for item in candidates(system).items()])
    benchmark.write()


def candidates(system: System) -> dict[str, Callable[[System, np.ndarray], Fields] | str]:
    """Return the candidates by name; a word in place of one that is out of reach."""
    n, d = system.n_nodes, system.shape.ndim

    def unless(limit: int, call: Callable[[System, np.ndarray], Fields]) -> Callable | str:
        return call if n <= limit else f"over {limit} nodes, not run"

    return {
        "sweep: block multigrid CG at poles, Galerkin basis": sweep,
        "multi-shift CG, one Krylov space": unless(SHIFTED_NODES, shifted_cg),
        "the same, for the deficit 1 - v": unless(SHIFTED_NODES, deficit_cg),
        "CG with the diagonal, each rho": cg,
        "sparse LU, each rho": unless(DIRECT_NODES[d], direct),
        "explicit iteration (5.1), each rho": unless(EXPLICIT_NODES, explicit),
    }


def race(
    name: str,
    candidate: Callable[[System, np.ndarray], Fields] | str,
    system: System,
    rho: np.ndarray,
    exact: np.ndarray,
) -> Row:
    """Time one candidate on one shape."""
    if isinstance(candidate, str):
        return {"candidate": name, "seconds for 64": candidate}
    seconds, (index, values, iterations) = timed(lambda: candidate(system, rho))
    error = float(np.abs(values - exact[:, index]).max() / exact.max())
    row: Row = {"candidate": name, "seconds for 64": seconds * N_RHO / index.size, "error": error}
    extrapolated = f"from {index.size} rho" if index.size < N_RHO else "all run"
    return row | {"iterations": iterations or "", "timed": extrapolated}


def sweep(system: System, rho: np.ndarray) -> Fields:
    """Solve for all ρ by the package's sweep."""
    solution = Sweep(rtol=RTOL).solve(system, rho)
    return np.arange(rho.size), solution.values, solution.iterations


def cg(system: System, rho: np.ndarray) -> Fields:
    """Solve for a few ρ, one after the other; residuals are taken from what the error shall be."""
    index = few(rho)
    solution = ConjugateGradient(rtol=0.01 * RTOL).solve(system, rho[index])
    return index, solution.values, solution.iterations


def direct(system: System, rho: np.ndarray) -> Fields:
    """Factor for a few ρ."""
    index = few(rho)
    return index, Direct().solve(system, rho[index]).values, 0


def explicit(system: System, rho: np.ndarray) -> Fields:
    """Descend as the paper does, for a few ρ."""
    index = few(rho)
    solution = ExplicitIteration(rtol=0.1 * RTOL).solve(system, rho[index])
    return index, solution.values, solution.iterations


def few(rho: np.ndarray) -> np.ndarray:
    """Return the indices of a few ρ spread over the range, its ends among them."""
    return np.linspace(0, rho.size - 1, min(SAMPLED, rho.size)).round().astype(int)


def shifted_cg(system: System, rho: np.ndarray) -> Fields:
    """Solve for all ρ in one Krylov space, after scaling by M^(-1/2): a shift then adds a multiple of 1."""
    matrix, scale = scaled(system)
    values, iterations = multi_shift(matrix, scale * system.rhs, rho**-2.0)
    return np.arange(rho.size), scale[:, None] * values, iterations


def deficit_cg(system: System, rho: np.ndarray) -> Fields:
    """Solve likewise for the deficit, (A + sM)(1 - v) = sM·1, whose right-hand side is smooth."""
    matrix, scale = scaled(system)
    shifts = rho**-2.0
    values, iterations = multi_shift(matrix, 1.0 / scale, shifts)
    return np.arange(rho.size), 1.0 - shifts * scale[:, None] * values, iterations


def scaled(system: System) -> tuple[scipy.sparse.csr_array, np.ndarray]:
    """Return M^(-1/2) A M^(-1/2), and the diagonal of M^(-1/2)."""
    scale = 1.0 / np.sqrt(system.mass)
    diagonal = scipy.sparse.diags_array(scale)
    return scipy.sparse.csr_array(diagonal @ system.matrix() @ diagonal), scale


def multi_shift(
    matrix: scipy.sparse.csr_array, rhs: np.ndarray, shifts: np.ndarray, limit: int = 3000
) -> tuple[np.ndarray, int]:
    """Solve (A + s) x = b for all shifts by CG for the smallest one, whose residuals those of others follow.

    Residuals are parallel, and the factors ζ between them come from the steps (Frommer and Maass 1999); a
    shift whose residual is small enough is left alone.
    """
    order = np.argsort(shifts)
    base, offset = shifts[order[0]], (shifts - shifts[order[0]])[order]
    x, p = np.zeros((shifts.size, rhs.size)), np.tile(rhs, (shifts.size, 1))
    r, previous = rhs.copy(), np.ones(shifts.size)
    zeta, last_alpha, beta = np.ones(shifts.size), 1.0, 0.0
    rr, goal = float(r @ r), 0.1 * RTOL * np.linalg.norm(rhs)
    active = shifts.size
    for iteration in range(limit):
        # larger shifts converge first, so those still active come first
        active = int(np.count_nonzero(zeta[:active] * np.sqrt(rr) > goal))
        if active == 0:
            return np.ascontiguousarray(x[np.argsort(order)].T), iteration
        ap = matrix @ p[0] + base * p[0]
        alpha = rr / float(p[0] @ ap)
        now, before = zeta[:active], previous[:active]
        below = alpha * beta * (before - now) + before * last_alpha * (1 + offset[:active] * alpha)
        following = now * before * last_alpha / below
        r -= alpha * ap
        new = float(r @ r)
        last_alpha, beta, rr = alpha, new / rr, new
        for j in range(active):
            ratio = following[j] / now[j]
            x[j] += (alpha * ratio) * p[j]
            p[j] *= beta * ratio**2
            p[j] += following[j] * r
        previous, zeta = now, following
    return np.ascontiguousarray(x[np.argsort(order)].T), limit


if __name__ == "__main__":
    main()
