"""
Figure 10: star polygons of one circle, and of one inner radius
===============================================================

The star polygons {n/4}, n = 9 to 20, all have their points on one circle; with n they become rounder and
deeper, and their bases Φ₁ to Φ₆ over ρ adapt (4.2.1). Rescaled to one inner radius, the largest distance from
a node to the boundary, their bases nearly coincide: what is left to tell them apart is in the maps.
"""

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

import spem
from spem.paper.consistency import PAPER_RADIUS, PAPER_RHO, RTOL, basis_cosines, largest_subspace_angle, pairs
from spem.paper.data import Data
from spem.paper.findings import Claim, Finding, Picture, judged
from spem.paper.present import present
from spem.paper.scaling import scaled
from spem.plots.basis_grid import draw_bases
from spem.plots.fields import draw_outline
from spem.plots.style import bare, new_figure
from spem.shapes.distance import signed_distance

N_MAPS = 6
POINTS = range(9, 21)
RADIUS = 40.0
# In degrees: lines that differ by less are not told apart in a figure of this size.
IDENTICAL = 10.0


def make(data: Data) -> Finding:
    """Compare the bases of stars before and after rescaling."""
    stars = [spem.synthetic.star_polygon(n, 4, radius=RADIUS, spacing=1.0) for n in POINTS]
    inner = [float(signed_distance(star).max()) for star in stars]
    rescaled = [scaled(star, PAPER_RADIUS / depth) for star, depth in zip(stars, inner, strict=True)]
    before, after = (
        [spem.maps(star, N_MAPS, rho=PAPER_RHO, rtol=RTOL) for star in several]
        for several in (stars, rescaled)
    )
    angles = [np.degrees(np.arccos(pairs(basis_cosines(maps)).min(axis=0))) for maps in (before, after)]
    spaces = [largest_subspace_angle(maps) for maps in (before, after)]
    numbers = {
        "n": list(POINTS),
        "inner_radius_px": inner,
        "largest_angle_before_deg": angles[0],
        "largest_angle_after_deg": angles[1],
        "subspace_angle_before_deg": spaces[0],
        "subspace_angle_after_deg": spaces[1],
    }
    pictures = (
        Picture("stars", draw_stars(), "The star polygons {n/4}, points on one circle."),
        Picture(
            "bases", draw(before, after), "Φₙ before (left) and after rescaling to one inner radius (right)."
        ),
    )
    source = f"Star polygons made here as in the paper, of circumradius {RADIUS:g} px; ρ from 2 to 30 px."
    return Finding(source, claims(angles, spaces, inner), pictures, numbers)


def claims(angles: list[NDArray[np.float64]], spaces: list[float], inner: list[float]) -> tuple[Claim, ...]:
    """Judge the angles between two stars before and after rescaling."""
    words = [", ".join(f"{angle:.1f}" for angle in several) for several in angles]
    return (
        judged(
            "Rescaled to one inner radius, the first six eigenvectors of stars come together (Fig. 10).",
            "nearly coincide",
            f"largest angle of two stars, Φ₁ to Φ₆: {words[1]}°, from {words[0]}° on one circle",
            bool((angles[1] < angles[0] / 2).all()),
            note="Come together is tested as: every largest angle is at least halved.",
        ),
        judged(
            "Rescaled to one inner radius, they are almost identical (4.2.1, Fig. 10).",
            "almost identical",
            f"largest angle {angles[1].max():.1f}°; of the spaces they span {spaces[1]:.1f}°",
            bool(angles[1].max() <= IDENTICAL),
            note=f"Almost identical is tested as: within {IDENTICAL:g}°. The stars with the fewest points, "
            "whose core is small beside them, are farthest from the others; the circle's size in pixels, "
            "which the paper does not give, matters too.",
        ),
        judged(
            "On one circle, the eigenvectors alter with the distances inside the stars (4.2.1, Fig. 10).",
            "altered",
            f"largest angle Φ₁ to Φ₆: {words[0]}°; of the spaces: {spaces[0]:.1f}°; inner radii "
            f"{min(inner):.0f} to {max(inner):.0f} px",
            bool((angles[0] > angles[1]).all() and spaces[0] > spaces[1]),
            note="Some basis vector differs more after rescaling than before.",
        ),
    )


def draw_stars() -> Figure:
    """Draw the outlines of the stars in a row, on a finer grid."""
    figure = new_figure(9.4, 0.95)
    for ax, n in zip(figure.subplots(1, len(POINTS)), POINTS, strict=True):
        draw_outline(spem.synthetic.star_polygon(n, 4, radius=RADIUS, spacing=0.3), ax)
        bare(ax, f"{{{n}/4}}")
    return figure


def draw(before: list[spem.Maps], after: list[spem.Maps]) -> Figure:
    """Draw the bases before and after, side by side."""
    figure = new_figure(9.4, 3.4)
    titles = ("one circle", f"one inner radius, {PAPER_RADIUS:g} px")
    grid = figure.add_gridspec(1, 2)
    for part, maps, title in zip((grid[0], grid[1]), (before, after), titles, strict=True):
        draw_bases(maps, POINTS, figure.add_subfigure(part), label="n", title=title)
    return figure


if __name__ == "__main__":
    finding = present(make)
