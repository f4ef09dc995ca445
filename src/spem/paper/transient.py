"""How the field comes to rest, and the kernels of the transformed walk (3.1, 3.4)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from spem.fields.operator import assemble
from spem.fields.solvers.direct import Direct
from spem.fields.walks.conditioned import arriving_walk, transition_density
from spem.fields.walks.killed import killed_walk
from spem.fields.walks.transient import decay_rate, solve_transient
from spem.plots.style import COLOURS, framed, new_figure
from spem.shapes.shape import Shape

if TYPE_CHECKING:
    from collections.abc import Sequence

    from matplotlib.figure import Figure

# Times at which decay is measured, in units of one over its rate, and points of the time integral.
_LATE = (12.0, 16.0)
_NODES = 40


@dataclass(frozen=True, eq=False)
class Settling:
    """The way to the steady state of one ρ.

    Parameters
    ----------
    rho
        The screening length.
    rate
        λ₁ + 1/ρ².
    times
        ``(n_times,)`` in units of length².
    gap
        ``(n_times,)`` largest distance from the steady state.
    slope
        Rate at which the gap falls at late times.
    rises
        The least step of any node from one time to the next, over v: negative where it falls.
    """

    rho: float
    rate: float
    times: NDArray[np.float64]
    gap: NDArray[np.float64]
    slope: float
    rises: float


def settle(shape: Shape, rho: float) -> Settling:
    """Follow the field of a shape from 0 to its steady state.

    Examples
    --------
    >>> from spem.shapes.synthetic import disk
    >>> found = settle(disk(1.0, 0.2), 0.5)
    >>> round(found.slope / found.rate, 3)
    1.0
    """
    rate = decay_rate(shape, rho)
    times = np.concatenate([np.geomspace(1e-3, 1, 30), np.linspace(1.2, max(_LATE), 35)]) / rate
    found = solve_transient(shape, rho, times, rtol=1e-10)
    gap = np.abs(found.values - found.steady[:, None]).max(axis=0)
    late = times * rate >= min(_LATE)
    slope = -np.polyfit(times[late], np.log(gap[late]), 1)[0]
    return Settling(rho, rate, times, gap, float(slope), float(np.diff(found.values, axis=1).min()))


def kernel_errors(shape: Shape, rho: float) -> dict[str, float]:
    """Set the kernel of the transformed walk, and its integrals, beside the solver (3.4).

    The field starts at 1 and is heated by nothing but its boundary, so 1 - v(x, t) rises from 0 under the
    source f = 1/ρ² in the interior.

    Parameters
    ----------
    shape
        A small shape: kernels are dense.
    rho
        The screening length.

    Returns
    -------
    errors
        ``kernel``: h p̃ h of the transformed walk against the kernel of the killed one, over the largest
        value; ``space``: the integral over space alone, at a late time, against 1 - v, over its maximum;
        ``time``: the integral over space and time against the transient solver.

    Examples
    --------
    >>> from spem.shapes.synthetic import disk
    >>> kernel_errors(disk(4.0, 1.0), 3.0)["kernel"] < 1e-12
    True
    """
    system = assemble(shape)
    walk = killed_walk(system, rho)
    arriving, measure = arriving_walk(walk), system.mass * np.prod(shape.spacing)
    h, source = np.exp(arriving.log_h), np.full(shape.n_nodes, rho**-2.0)
    late = 3 / decay_rate(system, rho)

    def killed(time: float) -> NDArray[np.float64]:
        # the network of h = 1 leaves killing out
        return np.asarray(np.exp(-time / rho**2) * transition_density(walk, time))

    def transformed(time: float) -> NDArray[np.float64]:
        return np.asarray(h[:, None] * transition_density(arriving, time) * h)

    early = late / 10
    kernel = np.abs(transformed(early) - killed(early)).max() / killed(early).max()
    steady = 1 - Direct().solve(system, np.array([rho])).values[:, 0]
    space = transformed(late) @ (source * measure)
    # Gauss-Legendre in the square root of time, about which the integrand is smooth
    root, weight = np.polynomial.legendre.leggauss(_NODES)
    root, weight = (root + 1) / 2 * np.sqrt(late), weight / 2 * np.sqrt(late)
    flashes = [transformed(float(r**2)) @ (source * measure) for r in root]
    total = np.transpose(flashes) @ (2 * root * weight)
    solved = 1 - solve_transient(system, rho, late, start=1.0, rtol=1e-11).values[:, 0]
    return {
        "kernel": float(kernel),
        "space": float(np.abs(space - steady).max() / steady.max()),
        "time": float(np.abs(total - solved).max() / steady.max()),
    }


def poisson_error(shape: Shape, rho: float) -> float:
    """Return how far ρ² (1 - v) is from the solution of -Δu = 1 with u = 0 on the boundary, over its maximum.

    Examples
    --------
    >>> from spem.shapes.synthetic import disk
    >>> poisson_error(disk(1.0, 0.1), 100.0) < 1e-4
    True
    """
    system = assemble(shape)
    poisson = Direct().prepare(system, 0.0).solve(system.mass)
    deficit = Direct().prepare(system, rho**-2.0).solve(system.mass)
    return float(np.abs(deficit - poisson).max() / poisson.max())


def figure_settling(settled: Sequence[Settling], radius: float) -> Figure:
    """Draw what is missing to the steady state over time, and its rate.

    Parameters
    ----------
    settled
        The ways of several ρ.
    radius
        Unit of length.

    Examples
    --------
    >>> from spem.shapes.synthetic import disk
    >>> len(figure_settling([settle(disk(1.0, 0.2), 0.5)], 1.0).axes)
    1
    """
    figure = new_figure(5.0, 3.2)
    ax = figure.add_subplot()
    for found, colour in zip(settled, COLOURS, strict=False):
        times, late = found.times / radius**2, found.times * found.rate > 1
        name = "∞" if np.isinf(found.rho) else f"{found.rho / radius:g} R"
        ax.semilogy(times, found.gap, color=colour, label=f"ρ = {name}")
        line = found.gap[-1] * np.exp(-found.rate * (found.times - found.times[-1]))
        ax.semilogy(times[late], line[late], "--", color="black", linewidth=0.8)
    ax.legend(fontsize=7, frameon=False)
    framed(ax, "time (R²)", "largest distance from v")
    return figure
