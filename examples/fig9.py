"""
Figure 9: maps of a hand across scales
======================================

A hand is scaled from an inner radius of 20 pixels to four times that while ρ stays at 2 to 30 pixels (4.2.1).
What was far from the boundary for a small hand is farther for a large one, so the basis Φₙ adapts. Left: Φₙ
coloured by scale. Right: how far the maps of the scaled hand are from those of the original at the same
places, as a peak signal-to-noise ratio; the peak is the range of the original map. Where ρ is scaled with the
shape, which is what spem does unless told otherwise, next to nothing changes (dashed).
"""

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

import spem
from spem.paper.consistency import PAPER_RHO, RTOL
from spem.paper.data import Data
from spem.paper.findings import Claim, Finding, Picture, judged
from spem.paper.present import present
from spem.paper.scaling import scaled, signal_to_noise, values_at
from spem.plots.basis_grid import draw_bases
from spem.plots.figures import map_name
from spem.plots.map_grid import figure_map_grid
from spem.plots.style import COLOURS, TEXT_SIZE, framed, new_figure

N_MAPS = 6


def make(data: Data) -> Finding:
    """Scale a hand, and compare its maps with those of the original."""
    found = data.silhouettes("hand", 2)
    hand = found.shapes[1]  # its fingers stand apart
    scales = np.linspace(1, 4, 7 if data.quick else 13)
    original = spem.maps(hand, N_MAPS, rho=PAPER_RHO, rtol=RTOL)
    several, ratios = [original], []
    for scale in scales[1:]:
        large = scaled(hand, float(scale))
        field = spem.sweep(large, np.linspace(PAPER_RHO[0], PAPER_RHO[-1] * scale), rtol=RTOL)
        several.append(spem.maps(field.resampled(PAPER_RHO), N_MAPS))
        adapted = spem.maps(field.resampled(PAPER_RHO * scale), N_MAPS)
        there = [values_at(maps, hand.points * scale) for maps in (several[-1], adapted)]
        ratios.append([signal_to_noise(original.values, values) for values in there])
    psnr, free = np.moveaxis(np.array(ratios), 1, 0)
    shown = {f"scale {s}": several[int(np.abs(scales - s).argmin())] for s in (1, 2, 4)}
    grid = figure_map_grid(list(shown.values()), list(shown))
    curves = draw(several, scales, psnr, free)
    pictures = (
        Picture("scales", curves, "Φₙ by scale, and PSNR; dashed lines peak where the grids coincide."),
        Picture("maps", grid, "The same hand at scales 1, 2 and 4, drawn in one size; ρ is the same."),
    )
    numbers = {"scale": scales[1:], "psnr_db": psnr, "psnr_db_rho_scaled": free}
    return Finding(found.source, claims(scales[1:], psnr, free), pictures, numbers)


def claims(
    scales: NDArray[np.float64], psnr: NDArray[np.float64], free: NDArray[np.float64]
) -> tuple[Claim, ...]:
    """Judge what is said of the curves."""
    steps = -np.diff(psnr, axis=0)
    # A difference in proportion to the change of scale would lower the ratio by this from step to step.
    slowest = 20 * np.log10((scales[1:] - 1) / (scales[:-1] - 1))[:, None]
    excess = steps - slowest
    faster = [map_name(j) for j in range(N_MAPS) if excess[:, j].max() > 0]
    ends = ", ".join(f"{map_name(j)} {psnr[0, j]:.1f} to {psnr[-1, j]:.1f}" for j in range(N_MAPS))
    return (
        judged(
            "The PSNR of projections changes monotonically with scale (4.2.1, Fig. 9).",
            "monotone from scale 1 to 4",
            f"falls at {100 * (steps > 0).mean():.0f} % of the steps; from scale {scales[0]:g} to 4 in dB: "
            f"{ends}",
            bool((steps > 0).all()),
            note="It rises again at some step of some projection.",
        ),
        judged(
            "The change is slow: nothing changes abruptly as the scale increases (4.2.1).",
            "slow",
            f"steps of {scales[1] - scales[0]:g} take {steps.min():.1f} to {steps.max():.1f} dB, the last "
            f"{steps[-1].min():.1f} to {steps[-1].max():.1f}; largest excess over a difference in "
            f"proportion to the change of scale: {excess.max():.1f} dB",
            bool(excess.max() <= 0),
            note="Slow is tested as: the difference grows at most in proportion to the change of scale; "
            f"{', '.join(faster)} of {N_MAPS} grows faster at first.",
        ),
        judged(
            "The maps are not scale invariant on a fixed range of ρ (4.2.1).",
            "not invariant",
            f"at scale 4 {psnr[-1].max():.1f} dB at best; with ρ scaled with the shape at least "
            f"{free.min():.1f} dB at every scale and map",
            bool(psnr[-1].max() < free.min()),
            note="A scaled hand on a fixed range is as near as one whose range is scaled too.",
        ),
    )


def draw(
    several: list[spem.Maps],
    scales: NDArray[np.float64],
    psnr: NDArray[np.float64],
    free: NDArray[np.float64],
) -> Figure:
    """Draw the bases at the left and the curves at the right."""
    figure = new_figure(9.4, 3.8)
    grid = figure.add_gridspec(1, 2, width_ratios=(1.75, 1))
    draw_bases(several, scales, figure.add_subfigure(grid[0]), label="scale")
    ax = figure.add_subfigure(grid[1]).subplots()
    for j, colour in zip(range(N_MAPS), COLOURS, strict=False):
        ax.plot(scales[1:], psnr[:, j], color=colour, marker="o", markersize=3, label=map_name(j))
        ax.plot(scales[1:], free[:, j], color=colour, linestyle="--", linewidth=0.8)
    framed(ax, "scale", "PSNR against scale 1 in dB")
    ax.set_ylim(top=68)
    ax.legend(
        fontsize=TEXT_SIZE - 1, frameon=False, ncols=3, loc="upper center", title="dashed: ρ scaled too"
    )
    return figure


if __name__ == "__main__":
    finding = present(make)
