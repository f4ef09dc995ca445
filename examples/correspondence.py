"""
Point correspondence
====================

Section 4.2 defines real-valued functions "that can be used for the purpose of matching or registration", and
measures no match. Here points just below the surface of one pose are matched to the nodes of another, by
nearest neighbours of ten SPEM values, of as many as are consistent; the error is the length of the shortest
way inside the target from the match to the true point, in units of L, the cube root of the volume. That is
done for all ordered pairs of poses, and beside the volumetric heat and wave kernel signatures (HKS, WKS).

A node alone says little about where it is: many have one and the same depth and width around them. Averaged
over the surroundings of each node, at 0.1, 0.3 and 0.9 L, the same values say which part it is in
(:func:`spem.correspond`). No descriptor here can tell left from right, so that half of the matches are on the
wrong side; the right column counts the mirror image of the true point as right.
"""

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from spem.embedding.correspondence import match_nodes
from spem.paper.correspondence import AROUND, CHANCE, Errors, descriptors, match_errors
from spem.paper.data import Data
from spem.paper.findings import Claim, Finding, Picture, judged
from spem.paper.poses import Poses, absences, load_poses
from spem.paper.present import present
from spem.plots.fields import draw_values
from spem.plots.style import COLOURS, INK, MUTED, TEXT_SIZE, TITLE_SIZE, bare, framed, new_figure
from spem.plots.surfaces import draw_surface

RADII = np.linspace(0, 1, 101)
NAMES = ("SPEM", "HKS", "WKS")


def make(data: Data) -> Finding:
    """Match the poses of each set by each descriptor."""
    sets = load_poses(data, n_inside=2, n_marks=100 if data.quick else 300)
    features = [[descriptors(shape) for shape in poses.shapes] for poses in sets]
    errors = {poses.name: match_errors(poses, made) for poses, made in zip(sets, features, strict=True)}
    missing = absences(data, sets)
    return Finding(
        " ".join(poses.source for poses in sets),
        tuple(judge(errors, around, missing) for around in ("", AROUND)),
        (
            Picture(
                "errors",
                draw_errors(errors),
                "Share of the points matched within a distance; steps are voxels.",
            ),
            Picture(
                "transfer",
                draw_transfer(sets[0], features[0]),
                "Colours of one pose, by where a node is along the body, carried to another by its matches.",
            ),
        ),
        {name: {key: e.figures for key, e in by.items()} for name, by in errors.items()},
    )


def judge(errors: dict[str, dict[str, Errors]], around: str, missing: str) -> Claim:
    """Judge whether matches are less than half as far off as those by chance."""
    ours, holds = [], True
    for name, by in errors.items():
        means = {key: by[key].either.mean() for key in (*(n + around for n in NAMES), CHANCE)}
        holds &= bool(means["SPEM" + around] < means[CHANCE] / 2)
        ours.append(f"{name}: " + ", ".join(f"{key} {mean:.2f}" for key, mean in means.items()))
    how = "averaged over the surroundings of each node" if around else "at each node alone"
    return judged(
        f"The maps can be used for matching (4.2), {how}.",
        "no figure",
        "mean error in L, either side: " + "; ".join(ours),
        holds,
        note=missing
        or "Less than half of the error by chance is asked for; nodes far apart have like values.",
        tested=not missing,
    )


def draw_errors(errors: dict[str, dict[str, Errors]]) -> Figure:
    """Draw the share of points within each distance, a row for each set."""
    figure = new_figure(9.0, 0.6 + 3.0 * len(errors))
    axes = figure.subplots(len(errors), 2, squeeze=False)
    for row, (name, by) in zip(axes, errors.items(), strict=True):
        for ax, exact in zip(row, (True, False), strict=True):
            for key, e in by.items():
                colour = COLOURS[NAMES.index(key.removesuffix(AROUND))] if key != CHANCE else MUTED
                dash = "-" if AROUND in key else ":" if key == CHANCE else "--"
                ax.plot(RADII, e.within(RADII, exact=exact), color=colour, linestyle=dash, label=key)
            framed(ax, "distance from the true point in L", "share of the points")
            ax.set(xlim=(0, 1), ylim=(0, 1))
            side = "the true side" if exact else "either side"
            ax.set_title(f"{name}: {side}", fontsize=TITLE_SIZE, color=INK)
    handles = axes[0, 0].get_legend_handles_labels()
    figure.legend(*handles, fontsize=TEXT_SIZE, frameon=False, ncols=4, loc="outside lower center")
    return figure


def draw_transfer(poses: Poses, features: list[dict[str, NDArray[np.float64]]]) -> Figure:
    """Draw a pose in colours, and another one that takes them from its matches."""
    first, other = poses.shapes[:2]
    points = first.points
    along = points[:, np.ptp(points, axis=0).argmax()]
    shown = {"colours given": (first, along)}
    for name in NAMES:
        matched = match_nodes(features[1][name + AROUND], features[0][name + AROUND])
        shown[name + AROUND] = (other, along[matched])
    figure = new_figure(9.4, 2.5)
    for ax, (title, (shape, values)) in zip(figure.subplots(1, 4), shown.items(), strict=True):
        draw = draw_values if shape.ndim == 2 else draw_surface
        draw(shape, values, ax, limits=(along.min(), along.max()))
        bare(ax, title)
    return figure


if __name__ == "__main__":
    finding = present(make)
