"""
The distance to the boundary, as ρ shrinks
==========================================

For small ρ the field falls as exp(−d/ρ) with the distance d to the boundary, so that −ρ log v tends to d.
So the screened equation approximates the eikonal equation |∇d| = 1 (1, 2.1, 3.2) and stays linear.

How fast? Beside a plane −ρ log v is d for every ρ. Where one boundary point is nearest it is
d + (ρ/2) Σ log(1 − κd) + O(ρ²), κ the principal curvatures there: on a disk of radius R, d − (ρ/2) log(R/r).
Where m points are equally near, on the skeleton, their fields add up, and it falls short by ρ log m. Within
reach of a reentrant corner alone it is too long, by (ρ/2) log(d/ρ) and more, for the field spreads from a
point. In all the error is O(ρ), times a logarithm at centres and corners.

A grid of spacing h adds its own: along an axis its field decays by 2 arsinh(h/2ρ) an edge, not by h/ρ, and
−ρ log v lacks d h²/24ρ². So ρ stays above five voxels here; to go on, refine the grid with ρ.
"""

from itertools import chain

import numpy as np
from numpy.typing import NDArray

from spem.paper import distance
from spem.paper.data import Data, Silhouette
from spem.paper.distance_pictures import figure_errors, figure_where
from spem.paper.findings import Claim, Finding, Picture, Table, judged
from spem.paper.present import present
from spem.paper.silhouettes import chosen

Array = NDArray[np.float64]
SMALLEST = 5.0  # ρ in voxels
FITTED = 0.25  # largest ρ over the inner radius for the rates
EXPANSION = np.geomspace(0.1, 0.0125, 4)  # for the closed form, that no grid limits
KINDS: tuple[Silhouette, ...] = ("cat", "hand")
ERRORS = "Mean errors as ρ falls; −ρ log v on a disk, against the distance and the expansion (dotted)."
WHERE = "(−ρ log v − d)/ρ: short on the skeleton, by log 2 and more; too long around reentrant corners."


def make(data: Data) -> Finding:
    """Hold −ρ log v against exact distances on two known shapes and two silhouettes, as ρ falls."""
    radius = 30.0 if data.quick else 100.0  # of all shapes, in voxels
    shares = np.geomspace(0.4, SMALLEST / radius, 6)
    found = {kind: chosen(data, kind, inner_radius=radius) for kind in KINDS}
    silhouettes = [distance.silhouette_cases(shapes.shapes[0], kind) for kind, shapes in found.items()]
    cases = [*distance.known_cases(radius), *chain(*silhouettes)]
    error = {case.name: distance.errors(case, shares) for case in cases}
    mean = {name: np.abs(values).mean(axis=1) for name, values in error.items()}
    fitted = shares <= FITTED
    rates = {name: distance.rate(shares[fitted], values[fitted]) for name, values in mean.items()}
    least = distance.rate(shares[fitted], shares[fitted] * np.log(1 / shares[fitted]))
    better = {name: np.median(np.abs(distance.extrapolated(shares, e)), axis=1) for name, e in error.items()}
    grid, beyond = distance.grid_share(cases[0], shares, error["disk"]), distance.disk_remainder(EXPANSION)
    where = figure_where([pair[0] for pair in silhouettes], [error[kind] for kind in KINDS], shares)
    return Finding(
        found["cat"].source,
        (limit(shares, mean), speed(rates, least), on_disk(distance.rate(EXPANSION, beyond), grid)),
        (
            Picture("errors", figure_errors(shares, mean, cases[0], error["disk"]), ERRORS),
            Picture("where", where, WHERE),
        ),
        {"shares": shares, "mean": mean, "rates": rates, "extrapolated": better, "grid": grid},
        tables=(rows(shares, mean, rates, better),),
    )


def limit(shares: Array, mean: dict[str, Array]) -> Claim:
    """Judge whether the mean error falls at every step of ρ, on every shape."""
    last = max(float(values[-1]) for values in mean.values())
    return judged(
        "A very small ρ approximates the eikonal equation: −ρ log v tends to the distance (2.1, 3.2).",
        "tends to it",
        f"from ρ = {shares[0]:.2g} to {shares[-1]:.2g} inner radii the mean error falls at every step on "
        f"{sum(bool((np.diff(values) < 0).all()) for values in mean.values())} of {len(mean)} cases, to "
        f"{100 * last:.1f} % of the inner radius or less; against the exact Euclidean distance transform, "
        f"{', '.join(f'{name} {100 * mean[name][-1]:.1f} %' for name in mean if 'voxels' in name)}",
        all((np.diff(values) < 0).all() for values in mean.values()),
        note="The grid's own error has been reached.",
    )


def speed(rates: dict[str, float], least: float) -> Claim:
    """Judge the rate against that of ρ log(1/ρ), the slowest that theory allows."""
    return judged(
        f"The error is O(ρ), times log(1/ρ) at most: here a power of {least:.2f} or more (3.2; derived).",
        f"ρ^{least:.2f} to ρ^1; faster where sides are flat",
        ", ".join(f"{name} ρ^{power:.2f}" for name, power in rates.items()),
        all(power > least for power in rates.values()),
        note="A shape falls more slowly than its curvature, skeleton and corners explain.",
    )


def on_disk(power: float, grid: Array) -> Claim:
    """Judge the term of first order on a disk, and what the grid adds."""
    return judged(
        "On a disk −ρ log v = d − (ρ/2) log(R/r) + O(ρ²), and a grid lacks up to d h²/24ρ² (3.2; derived).",
        "ρ²; 0.5 to 1 of the grid's share",
        f"closed form, off the centre: ρ^{power:.2f}; the grid lacks {grid.min():.2f} to {grid.max():.2f}",
        1.75 < power < 2.25 and grid.min() > 0.45 and grid.max() < 1.05,
        note="ρ is too large for the expansion, or too small for the grid.",
    )


def rows(shares: Array, mean: dict[str, Array], rates: dict[str, float], better: dict[str, Array]) -> Table:
    """Tell the mean error of each case by ρ, its rate, and the median of two ρ extrapolated."""
    return Table(
        "Mean error of −ρ log v in percent of the inner radius, by ρ over the inner radius; median error of "
        "the last two ρ extrapolated to 0.",
        ("shape", *(f"{share:.2g}" for share in shares), "rate", "extrapolated"),
        tuple(
            (name, *(f"{100 * e:.2f}" for e in values), f"{rates[name]:.2f}", f"{100 * better[name][-1]:.2f}")
            for name, values in mean.items()
        ),
    )


if __name__ == "__main__":
    finding = present(make)
