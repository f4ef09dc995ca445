"""
Figure 6: the hyperfield
========================

Everything together is a stack of N × m fields, one for each screening length ρ and each point p of the
boundary (2.4). Three layers of sources of variability lie on each other: ρ, the bias of the walk; the level
s of v, which embeds a smoother and smoother shape; and the boundary point that the value comes from. Left:
the fields of five ρ. Right: for one of them, the fields of four pieces of the boundary. The slices are
computed.

For every ρ the fields of all boundary points add up to the field of the whole boundary. They are solved for
one by one, as logarithms; the sum is held against one solution for all of the boundary at once.
"""

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

import spem
from spem.paper.data import Data
from spem.paper.findings import Finding, Picture, Table, judged
from spem.paper.present import present
from spem.paper.silhouettes import chosen
from spem.plots.stack import draw_stack
from spem.plots.style import TEXT_SIZE, new_figure

RHO = (2.0, 5.0, 10.0, 20.0, 40.0, np.inf)
SHOWN = 3
N_PIECES = 4
ROUNDING = 1e-12


def make(data: Data) -> Finding:
    """Add up the fields of all boundary points of a hand, for each ρ."""
    found = chosen(data, "hand")
    hand = found.shapes[0]
    error, largest, points = {}, {}, {}
    for boundary in ("surface", "voxel"):
        hyperfield = spem.SourceHyperfield(spem.sources(hand, boundary=boundary), np.array(RHO))
        whole = spem.field(hand, RHO, boundary=boundary, solver=spem.Direct())
        error[boundary] = np.abs(hyperfield.total() - whole.T).max(axis=1)
        points[boundary] = hyperfield.size[1]
        largest[boundary] = float(error[boundary].max())
    worst = max(largest.values())
    claim = judged(
        "The fields of all boundary points add up to v, for every ρ (2.4).",
        "v^ρ = Σ v^(ρ, p)",
        f"the largest difference over {len(RHO)} ρ and {hand.n_nodes} nodes is {worst:.0e}, from "
        f"{points['surface']} points on the surface or {points['voxel']} outside pixels",
        worst < ROUNDING,
        note="The sum differs from v by more than rounding.",
    )
    rows = tuple(
        (f"{rho:g}", *(f"{error[boundary][k]:.1e}" for boundary in error)) for k, rho in enumerate(RHO)
    )
    caption = "Largest difference between the sum over boundary points and v, by ρ and boundary model."
    return Finding(
        found.source,
        (claim,),
        (
            Picture(
                "stack",
                figure_stacks(hand, spem.field(hand, RHO[:-1])),
                f"Left: v for five ρ. Right: the fields of {N_PIECES} pieces of the boundary for ρ = "
                f"{RHO[SHOWN]:g} pixels; they add up to the slice of that ρ. White lines: levels s of v.",
            ),
        ),
        tables=(Table(caption, ("ρ (pixels)", *error), rows),),
        numbers={"rho": RHO, "error": error, "points": points},
    )


def figure_stacks(hand: spem.Shape, fields: NDArray[np.floating]) -> Figure:
    """Draw the slices of several ρ beside those of several sources."""
    figure = new_figure(7.2, 4.4)
    left, right = figure.subplots(1, 2)
    draw_stack(hand, fields, left, [f"ρ = {rho:g}" for rho in RHO[:-1]], title="v for each ρ")
    pieces = spem.source_fields(spem.sources(hand, N_PIECES), RHO[SHOWN]).values
    words = [f"p{'₁₂₃₄'[k]}" for k in range(N_PIECES)]
    slices = np.column_stack([pieces.T, pieces.sum(axis=0)])
    draw_stack(hand, slices, right, [*words, "Σ"], title=f"v for each source, ρ = {RHO[SHOWN]:g}; their sum")
    bar = figure.colorbar(left.images[0], ax=[left, right], shrink=0.4, aspect=25, ticks=[0, 0.5, 1])
    bar.set_label("v", fontsize=TEXT_SIZE)
    bar.ax.tick_params(labelsize=TEXT_SIZE - 1)
    return figure


if __name__ == "__main__":
    finding = present(make)
