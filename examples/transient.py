"""
The field on its way: how it comes to rest
==========================================

Light up the boundary at time 0 and let light seep in: the field u(x, t) of ∂u/∂t = Δu − u/ρ² starts at 0 and
rises to v. At each time it is the chance that the killed walker from x has arrived by then. What is missing
to v dies out like exp(−(λ₁ + 1/ρ²) t), λ₁ being the lowest eigenvalue of the shape (3.1): screening makes it
settle sooner.

The paper writes (Δ + ∂/∂t) u = f, with the sign of time turned round, and gives the solution as an integral
over space alone (3.1, 3.4). Both are put right here: with the proper sign, and summed over time as well, the
kernel of the transformed walk gives 1 − v(x, t) to rounding.
"""

import numpy as np

import spem
from spem.fields.walks.transient import decay_rate
from spem.paper.data import Data
from spem.paper.findings import Claim, Finding, Picture, judged
from spem.paper.present import present
from spem.paper.silhouettes import chosen
from spem.paper.transient import Settling, figure_settling, kernel_errors, poisson_error, settle
from spem.plots.figures import figure_fields

# In units of the inner radius.
SCALES = (0.25, 0.5, 1.0, np.inf)


def make(data: Data) -> Finding:
    """Follow the field of a cat over time, and put the paper's formulas beside it."""
    radius = 8.0 if data.quick else 20.0
    found = chosen(data, "cat", (1,), inner_radius=radius)
    cat = found.shapes[0]
    settled = [settle(cat, scale * radius) for scale in SCALES]
    moments = radius**2 * np.array([0.004, 0.02, 0.06, 0.2, 1.0])
    shown = spem.solve_transient(cat, SCALES[1] * radius, moments)
    small = spem.read(cat, inner_radius=3.0)
    kernels = kernel_errors(small, 1.5)
    rate = decay_rate(cat, np.inf)
    poisson = poisson_error(cat, 100 * radius)
    titles = [f"t = {t / radius**2:g} R²" for t in moments]
    pictures = (
        Picture(
            "fields",
            figure_fields(cat, shown.values, titles, columns=5),
            f"u at five times, R being the inner radius, ρ = {SCALES[1]:g} R.",
        ),
        Picture(
            "decay",
            figure_settling(settled, radius),
            "What is missing to the steady state, solved for (lines) and exp(−(λ₁ + 1/ρ²) t) (dashes).",
        ),
    )
    numbers = kernels | {
        "rate": {s.rho: s.rate for s in settled},
        "measured rate": {s.rho: s.slope for s in settled},
        "lowest eigenvalue": rate,
        "poisson": poisson,
        "rises": min(s.rises for s in settled),
    }
    return Finding(found.source, claims(settled, kernels, rate * radius**2, poisson), pictures, numbers)


def claims(
    settled: list[Settling], kernels: dict[str, float], growth: float, poisson: float
) -> tuple[Claim, ...]:
    """Judge the formulas of 3.1."""
    worst = max(abs(s.slope / s.rate - 1) for s in settled)
    return (
        judged(
            "The time-dependent solution tends to the steady one (3.1).",
            "as t → ∞",
            f"at the rate λ₁ + 1/ρ², to {100 * worst:.2f} %, for every ρ; it rises all the way at every node",
            worst < 0.01 and all(s.rises > -1e-8 for s in settled),
            note="Other modes have not died out yet.",
        ),
        judged(
            "(Δ + ∂/∂t) u = f has that steady state (3.1).",
            "plus sign",
            f"with this sign the lowest mode grows by exp({growth:.2f}) while t passes R²; with Δ − ∂/∂t it "
            "falls by as much",
            growth < 0,
            note="The sign of ∂/∂t is a slip: it is the heat equation backwards.",
        ),
        judged(
            "For ρ → ∞ the steady state 1 − v solves the Poisson equation (3.1).",
            "1 − v",
            f"ρ² (1 − v) does, to {poisson:.0e} of its maximum at ρ = 100 R; 1 − v itself tends to 0",
            poisson < 0.01,
            note="The source 1/ρ² is not small against the rate of the shape.",
        ),
        judged(
            "h(x) p̃_t(x, y) h(y) of the transformed walk is the kernel of the screened equation (3.4).",
            "equal",
            f"equal but for {kernels['kernel']:.0e} of the largest value",
            kernels["kernel"] < 1e-10,
            note="The difference is more than rounding.",
        ),
        judged(
            "1 − v(x, t) is the integral of that kernel and f over space (3.1, 3.4).",
            "integral over space",
            f"off by {kernels['space']:.2f} of 1 − v at late times, where the kernel dies out; summed over "
            f"time too it is right to {kernels['time']:.0e}",
            kernels["space"] < 0.01,
            note="The integral over time is missing in print (Duhamel's principle): by itself the one over "
            "space is the answer to a source that flashes once.",
        ),
    )


if __name__ == "__main__":
    finding = present(make)
