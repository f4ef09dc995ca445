"""
Figure 3: equally far from the boundary, and yet not the same
=============================================================

Take the nodes of a hand that are equally far from its boundary. A distance transform cannot tell them
apart; v can, since each has its own neighbourhood (2.2). Each of them has a profile over ρ of its own.

How much of the spread is real? A grid has few nodes at exactly one distance, so nodes are taken within a
quarter of a pixel, and the spread of v in this band is held against the spread that the band's own width
brings about: the standard deviation of the distance times the mean fall of v per pixel of distance. A ratio
of one would mean that v knows the distance and nothing else. A disk, where it does, is the control. The
same is done along the curve of exactly this distance, found between the nodes, where only the error of
finding it is left to be explained.
"""

from typing import Any

import numpy as np
from matplotlib import colormaps
from matplotlib.figure import Figure
from numpy.typing import NDArray

import spem
from spem.paper.data import INNER_RADIUS, Data
from spem.paper.equidistance import BAND, band, spread_along_curve, spread_ratios
from spem.paper.findings import Finding, Picture, Table, judged
from spem.paper.present import present
from spem.paper.silhouettes import chosen
from spem.plots.fields import draw_outline
from spem.plots.style import DASHES, INK, TEXT_SIZE, bare, framed, new_figure

RHO = np.linspace(2, 30, 57)
DEPTHS = (2, 3, 4, 6, 8)
SHOWN = 4
N_CURVES = 12

Array = NDArray[np.floating[Any]]


def make(data: Data) -> Finding:
    """Measure the spread of v at equal distance on a hand and on a disk, for each ρ."""
    found = chosen(data, "hand")
    hand, disk = found.shapes[0], spem.synthetic.disk(INNER_RADIUS, 1.0)
    fields = {shape.name: spem.sweep(shape, RHO).fields() for shape in (hand, disk)}
    ratio = {shape.name: spread_ratios(shape, fields[shape.name], SHOWN) for shape in (hand, disk)}
    exact = {shape.name: spread_along_curve(shape, fields[shape.name], SHOWN) for shape in (hand, disk)}
    here, there = ratio[hand.name], ratio[disk.name]
    mean = {name: float(values.mean()) for name, values in exact.items()}
    claim = judged(
        "Profiles v(ρ) of nodes that have the same distance to the boundary show quite different "
        "character: the field encodes more than the distance (2.2).",
        "quite different character",
        f"{SHOWN} pixels deep, the spread of v is {here['sub-voxel'].min():.1f} to "
        f"{here['sub-voxel'].max():.1f} times what the width of the band explains (pixels' distances: "
        f"{here['pixel'].min():.1f} to {here['pixel'].max():.1f}), on a disk "
        f"{there['sub-voxel'].max():.1f} at most; at exactly equal distance the standard deviation of v is "
        f"{mean[hand.name]:.3f}, on the disk {mean[disk.name]:.4f}",
        bool(here["sub-voxel"].min() > 2 and here["pixel"].min() > 2),
        note="At some ρ the spread is no more than twice what the band's width explains.",
    )
    figure = figure_spread(hand, fields[hand.name], here["sub-voxel"], there["sub-voxel"])
    return Finding(
        found.source,
        (claim,),
        (
            Picture(
                "spread",
                figure,
                f"Nodes {SHOWN} ± {BAND} pixels deep; their profiles, in the same colours; how many times "
                "more v spreads than the band's width explains.",
            ),
        ),
        tables=(table_depths(hand, fields[hand.name]),),
        numbers={"rho": RHO, "hand": here, "disk": there, "exact_hand": exact[hand.name], "exact": mean},
    )


def table_depths(hand: spem.Shape, fields: Array) -> Table:
    """Return the ratios at several depths for a small, a middle and a large ρ."""
    columns = [(kind, k) for kind in ("sub-voxel", "pixel") for k in (0, 16, RHO.size - 1)]
    head = [f"ρ = {RHO[k]:g}{', pixels' if kind == 'pixel' else ''}" for kind, k in columns]
    found = [(depth, spread_ratios(hand, fields, depth)) for depth in DEPTHS]
    return Table(
        "Spread of v at one depth over what the band's width explains, by depth in pixels; on the right by "
        "the distances of the pixels.",
        ("depth", *head),
        tuple((f"{depth}", *(f"{ratio[kind][k]:.1f}" for kind, k in columns)) for depth, ratio in found),
    )


def figure_spread(hand: spem.Shape, fields: Array, ratio: Array, control: Array) -> Figure:
    """Draw nodes of one depth, their profiles and the ratio over ρ."""
    figure = new_figure(9.0, 3.0)
    place, curves, right = figure.subplots(1, 3, width_ratios=(1, 1.3, 1.3))
    nodes = np.flatnonzero(band(spem.distance_to_boundary(hand), SHOWN))
    order = nodes[np.argsort(fields[nodes, RHO.size // 4])]
    draw_outline(hand, place)
    bare(place, f"nodes {SHOWN} pixels deep")
    colours = colormaps["viridis"](np.linspace(0, 0.92, N_CURVES))
    for node, colour in zip(
        order[np.linspace(0, order.size - 1, N_CURVES).astype(int)], colours, strict=True
    ):
        curves.plot(RHO, fields[node], color=colour, linewidth=1.2)
        place.plot(*hand.points[node][::-1], "o", color=colour, markersize=4)
    framed(curves, "ρ (pixels)", "v")
    right.plot(RHO, ratio, color=INK, label="hand")
    right.plot(RHO, control, color=INK, linestyle=DASHES[1], label="disk")
    right.legend(fontsize=TEXT_SIZE - 1, frameon=False)
    right.set_ylim(0, None)
    framed(right, "ρ (pixels)", "spread of v / spread explained by distance")
    return figure


if __name__ == "__main__":
    finding = present(make)
