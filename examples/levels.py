"""
Level curves: a family in ρ and v
=================================

A level curve of the field v is a smoothed boundary. Each ρ has a family of them, from the boundary (v = 1)
inward, so that shapes lie in a plane of two parameters, ρ and v (2.1). For small ρ curves keep limbs and
notches; for larger ρ, and for lower v, they forget them. The last panel has curves of equal distance from
the boundary: they have corners, where the field's are round.

Behind it stands (2.1): v ≈ ρ (1 + ρ/2 curv) ∂v/∂n. The profile of v depends on the curvature of its own
level curves, so that a linear equation smooths as a nonlinear one would. What is left out is O(ρ³) at a given
∂v/∂n: a share O(ρ²) of v. Curvature is positive on a disk, and n points to larger v.

Smoothing is measured by total curvature, the angle by which a closed curve turns one way and the other: one
full turn if it is convex, more if it has bulges and notches. Curves that hold the same share of the shape are
compared as well, for a larger ρ also moves a level inward. A corner shows in that the sharpest turn between
successive chords stays as chords are halved; on a smooth curve it is halved too.
"""

import numpy as np
from numpy.typing import NDArray

import spem
from spem.paper.data import Data
from spem.paper.findings import Claim, Finding, Picture, judged
from spem.paper.level_expansion import left_out, smooth_shapes
from spem.paper.level_pictures import figure_family, figure_smoothing
from spem.paper.level_smoothness import at_areas, smoothness
from spem.paper.present import present
from spem.paper.silhouettes import chosen

RHO = (4.0, 8.0, 16.0, 32.0, 64.0)
LEVELS = np.round(np.arange(0.9, 0.05, -0.1), 1)
AREAS = np.array([0.7, 0.6, 0.5, 0.4, 0.3])  # shares of the nodes within a curve
SHARES = (0.4, 0.28, 0.2, 0.14, 0.1)  # ρ over the inner radius, for (2.1)
CHORD = 3.0  # pixels
INNER_RADIUS = 40.0
ENOUGH = 0.9  # of the steps
CORNER = 0.75  # halfway between a smooth curve, 1/2, and a corner, 1
Array = NDArray[np.float64]


def make(data: Data) -> Finding:
    """Check (2.1) on three shapes, and measure the curves of a cat over v, over ρ, and of its distance."""
    found = chosen(data, "cat", inner_radius=INNER_RADIUS)
    cat = found.shapes[0]
    fields = {rho: np.asarray(spem.field(cat, rho, solver=spem.Direct()), np.float64) for rho in RHO}
    limit = -spem.distance_to_boundary(cat)  # grows outward, as v
    by_level = np.stack([smoothness(cat, v, LEVELS, CHORD).turns for v in fields.values()])
    turns, corners = at_areas(cat, [limit, *fields.values()], AREAS, CHORD)
    missed = {shape.name: left_out(shape, SHARES) for shape in smooth_shapes(50 if data.quick else 120)}
    order = {name: np.polyfit(np.log(SHARES[2:]), np.log(m[2:]), 1)[0] for name, m in missed.items()}
    family = figure_family(cat, limit, fields, LEVELS)
    curves = figure_smoothing((SHARES, missed), (LEVELS, by_level), (AREAS, turns), RHO)
    return Finding(
        found.source,
        (expansion(order), *smoothing(by_level, turns), sharpness(corners)),
        (
            Picture("family", family, "Level curves: of the distance, the limit of small ρ; for growing ρ."),
            Picture("smoothing", curves, "What (2.1) leaves out; turns of the curves, by v and by area."),
        ),
        {"missed": missed, "order": order, "by level": by_level, "by area": turns, "corners": corners},
    )


def expansion(order: dict[str, Array]) -> Claim:
    """Judge (2.1) by the power of ρ with which the share that it leaves out falls."""
    return judged(
        "v ≈ ρ (1 + ρ/2 curv) ∂v/∂n up to O(ρ³), a share O(ρ²) of v (2.1).",
        "share ρ²; ρ¹ without the curvature",
        "; ".join(f"{name}: ρ^{power[0]:.2f}, without ρ^{power[1]:.2f}" for name, power in order.items()),
        all(with_term > 1.75 for with_term, _ in order.values()),
        note="The median over a band of nodes falls more slowly than ρ^1.75 somewhere.",
    )


def smoothing(by_level: Array, by_area: Array) -> tuple[Claim, Claim]:
    """Judge smoothing with decreasing v and with increasing ρ, the latter at equal areas as well."""
    steps = [np.diff(by_level, axis=1), np.diff(by_level, axis=0), np.diff(by_area, axis=0)]
    share = [float((step < 0).sum() / np.isfinite(step).sum()) for step in steps]
    inward, level, area = (
        f"{100 * value:.0f} % of {np.isfinite(step).sum()}" for value, step in zip(share, steps, strict=True)
    )
    note = "A curve that loses a limb, or that is nearly convex already, may turn a little more than before."
    return (
        judged(
            "Smoothing increases with a decrease in v (2.1).",
            "increases",
            f"a level curve turns less than the one outside it in {inward} steps of v by 0.1",
            share[0] > ENOUGH,
            note=note,
        ),
        judged(
            "Smoothing increases with an increase in ρ² (2.1).",
            "increases",
            f"a doubled ρ makes curves turn less in {level} cases at the same v, and in {area} at the same "
            "area, so that it is not depth alone",
            min(share[1:]) > ENOUGH,
            note=note,
        ),
    )


def sharpness(corners: Array) -> Claim:
    """Judge corners by the sharpest turn, against that between chords of twice the length."""
    distance, smooth = np.nanmedian(corners[0]), np.nanmedian(corners[-2:])
    return judged(
        "Level curves of v are smooth, unlike those of the solution of the eikonal equation (2.1).",
        "smooth; not smooth",
        f"as chords are halved the sharpest turn falls to {smooth:.2f} of what it was for ρ = {RHO[-2]:g} "
        f"and {RHO[-1]:g}, and to {distance:.2f} for the distance; a smooth curve has 0.5, a corner 1",
        bool(smooth < CORNER < distance),
        note="Chords of a few pixels do not tell curves of such a radius from corners.",
    )


if __name__ == "__main__":
    finding = present(make)
