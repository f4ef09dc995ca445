"""
One source and the shortest ways inside
=======================================

The field of a single boundary point p falls, for small ρ, with the length of the shortest way to p inside the
shape: −ρ log v tends to the inner geodesic distance, but for a constant (3.2). Here it is held against exact
lengths on a U, and on a hand against fast marching. As v is 0 on the walls, every way pays for keeping clear
of them: the difference is O(ρ), times a logarithm.

Do gradients of v point along the shortest ways, as 3.2 says? For small ρ they do. For ρ = ∞ they do not:
walls where v = 0 swallow walkers, so that v is greatest along the middle of a limb, and ∇v leads to this
medial locus as well as to p. The paper says both; the angles below tell how much there is of each.
(Varadhan's formula has a sign too many there, −√(−4t log p): it is √(−4t log p) that tends to the distance.
Neither a logarithm nor a square root turns a gradient.)
"""

import numpy as np
from numpy.typing import NDArray

from spem.paper import geodesics
from spem.paper.data import Data
from spem.paper.distance import rate
from spem.paper.findings import Claim, Finding, Picture, judged
from spem.paper.geodesic_pictures import figure_angles, figure_rates
from spem.paper.present import present
from spem.paper.silhouettes import chosen

Array = NDArray[np.float64]
SMALLEST = 4.0  # ρ in voxels
PARALLEL = 10.0  # degrees; the median of directions at random would be 90
ANGLES = "Lengths of shortest ways, and −ρ log v for the smallest ρ; angles between −∇v and the ways."
RATES = "Mean difference of −ρ log v from the distance; angles: median, and dashed nine tenths."


def make(data: Data) -> Finding:
    """Compare values and gradients of single-source fields with shortest ways, as ρ falls."""
    radius = 30.0 if data.quick else 100.0  # inner radius of the hand, in voxels
    found = chosen(data, "hand", inner_radius=radius)
    u, marched = geodesics.u_way(70 if data.quick else 200)
    cases = (u, geodesics.tip_way(found.shapes[0], "hand"))
    shares = np.geomspace(0.6, SMALLEST / radius, 6)  # ρ over the inner radius
    mean, turned = {}, {}
    for way in cases:
        rho = shares * way.depth.max()
        mean[way.name] = np.array([np.abs(geodesics.difference(way, r)).mean() for r in rho])
        turned[way.name] = [geodesics.angles(way, r) for r in (np.inf, *rho)]
    angle = {name: np.array([np.quantile(a, (0.5, 0.9)) for a, _ in each]) for name, each in turned.items()}
    inward = {name: [float(up.mean()) for _, up in each] for name, each in turned.items()}
    rates = {name: rate(shares[2:], values[2:]) for name, values in mean.items()}
    numbers = {"shares": shares, "mean": mean, "rates": rates, "angle": angle, "inward": inward}
    numbers["fast marching, voxels"] = np.abs(marched - u.distance).mean() / u.shape.spacing[0]
    panels = [("ρ = ∞", 0), *((f"ρ = {shares[k] * radius:.3g} voxels", k + 1) for k in (2, 5))]
    shown = figure_angles(cases[1], shares[-1] * radius, [(t, turned["hand"][k][0]) for t, k in panels])
    return Finding(
        found.source,
        (limit(mean, rates), parallel(angle), tending(angle), medial(inward)),
        (Picture("angles", shown, ANGLES), Picture("rates", figure_rates(shares, mean, angle), RATES)),
        numbers,
    )


def limit(mean: dict[str, Array], rates: dict[str, float]) -> Claim:
    """Judge whether −ρ log v tends to the inner geodesic distance, and how fast."""
    return judged(
        "The values of v^p are strongly linked to the geodesic distance from p (3.2): for small ρ, −ρ log v "
        "is this distance, but for a constant.",
        "a strong link",
        "; ".join(
            f"{name}: mean difference {100 * values[0]:.0f} % of the longest way, falling to "
            f"{100 * values[-1]:.1f} %, as ρ^{rates[name]:.2f}"
            for name, values in mean.items()
        ),
        all((np.diff(values) < 0).all() and rates[name] > 0.75 for name, values in mean.items()),
        note="The difference does not fall at every ρ as ρ log(1/ρ) does.",
    )


def parallel(angle: dict[str, Array]) -> Claim:
    """Judge gradient directions for ρ = ∞, where v is the harmonic measure of the source."""
    return judged(
        "Gradient directions of v^p are parallel to geodesics (3.2): for ρ = ∞.",
        "parallel",
        "; ".join(
            f"{name}: median {a[0, 0]:.0f}°, nine tenths within {a[0, 1]:.0f}°" for name, a in angle.items()
        ),
        all(a[0, 0] < PARALLEL for a in angle.values()),
        note="v is 0 on the walls, so ∇v leads away from them as well as to p, as the paper goes on to say.",
    )


def tending(angle: dict[str, Array]) -> Claim:
    """Judge gradient directions as ρ falls."""
    return judged(
        "Gradient directions of v^p are parallel to geodesics (3.2): as ρ falls.",
        "parallel",
        "; ".join(
            f"{name}: median {a[1, 0]:.0f}° falling to {a[-1, 0]:.1f}°, nine tenths within {a[-1, 1]:.0f}°"
            for name, a in angle.items()
        ),
        all((np.diff(a[:, 0]) < 0).all() and a[-1, 0] < PARALLEL for a in angle.values()),
        note="The smallest ρ that the grid resolves is not small against the width of the limbs.",
    )


def medial(inward: dict[str, list[float]]) -> Claim:
    """Judge the attraction of the medial locus."""
    return judged(
        "Dirichlet boundary conditions attract the flux to the medial locus (3.2).",
        "attracted",
        "cosine of ∇v with the direction away from the nearest wall, mean: "
        + "; ".join(
            f"{name} {up[0]:.2f} for ρ = ∞, {up[-1]:.2f} for the smallest ρ" for name, up in inward.items()
        ),
        all(up[0] > 0.1 and up[-1] < up[0] for up in inward.values()),
        note="Gradients do not lead away from walls on the whole.",
    )


if __name__ == "__main__":
    finding = present(make)
