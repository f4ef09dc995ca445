"""
Figure 15: level sets of the maps of a horse in three poses
===========================================================

The second to sixth maps of a solid horse, one a row, in three poses: red is what lies above an upper
threshold, blue what lies below a lower one. Thresholds are where the histogram of the map, over the poses
together, first jumps, going inward from either end; where it does not jump, zero. All poses have the same
thresholds (5.3); in full size eleven are measured. A solid has its whole geometry, a silhouette is a view of
it: the same poses seen along one axis give maps that vary more.
"""

from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

import spem
from spem.paper.consistency import distribution_distances, pairs
from spem.paper.data import Data
from spem.paper.findings import Finding, Picture, judged
from spem.paper.pose_regions import SIDE_VIEW, Region, clear_values, pose_maps, regions, shadow
from spem.paper.present import present
from spem.plots.camera import view_rotation
from spem.plots.figures import map_name
from spem.plots.level_surfaces import draw_levels
from spem.plots.style import TEXT_SIZE, new_figure

N_MAPS = 6
SHOWN = range(1, N_MAPS)
POSES = ("reference", "2", "8", "1", "3", "4", "5", "6", "7", "9", "10")


def make(data: Data) -> Finding:
    """Threshold the maps of all poses, as solids and as silhouettes; three are drawn."""
    folder = data.find("horse_poses")
    shapes = poses(folder, data.quick)
    solid, flat = pose_maps(shapes, N_MAPS), pose_maps([shadow(shape) for shape in shapes], N_MAPS)
    found, seen = regions(solid, SHOWN), regions(flat, SHOWN)
    distances = [pairs(distribution_distances(several)).mean(axis=0)[1:] for several in (solid, flat)]
    variation = [float(np.mean([r.variation for r in several])) for several in (found, seen)]
    shares = [r.shares.max() - r.shares.min() for r in found]
    words = ", ".join(f"{map_name(j)} {a:.3f} ({b:.3f})" for j, a, b in zip(SHOWN, *distances, strict=True))
    absent = data.absent("horse_poses") if folder is None else ""
    claims = (
        judged(
            "Each projection is consistent for different poses, after thresholding too (5.3, Fig. 15).",
            "consistent, as seen",
            "one threshold for all poses: the share of the volume beyond it varies by "
            f"{100 * variation[0]:.0f} % of itself on average, by {max(shares):.3f} of the volume at most; "
            f"its pieces by {max(int(np.ptp(r.pieces)) for r in found)} at most, over {len(shapes)} poses",
            max(shares) < 0.05,
            note=absent or "A change below 5 % of the volume was asked for.",
            tested=folder is not None,
        ),
        judged(
            "Maps of a solid are more consistent across poses than those of its silhouette (5.3).",
            "more consistent",
            f"distance of distributions between poses, solid (silhouette), in standard deviations: {words}; "
            f"variation of the regions beyond thresholds {variation[0]:.2f} ({variation[1]:.2f})",
            bool((distances[0] < distances[1]).all() and variation[0] < variation[1]),
            note=absent or "For some map the silhouettes of these poses are nearer to each other.",
            tested=folder is not None,
        ),
    )
    numbers = {
        "thresholds": {f"{map_name(r.map)} {'above' if r.upper else 'below'}": r.threshold for r in found},
        "shares": {f"{map_name(r.map)} {'above' if r.upper else 'below'}": r.shares for r in found},
        "pieces": {f"{map_name(r.map)} {'above' if r.upper else 'below'}": r.pieces for r in found},
        "distance_solid": distances[0],
        "distance_silhouette": distances[1],
        "variation_solid": variation[0],
        "variation_silhouette": variation[1],
    }
    source = (
        "The horse of Sumner and Popović, whose mesh has two small holes, in ten poses and at rest."
        if folder
        else "Dogs made here, in place of the paper's horse."
    )
    picture = Picture(
        "levels",
        draw(solid[:3], found, folder is not None),
        "P₂ to P₆ beyond their thresholds, without specks.",
    )
    return Finding(source, claims, (picture,), numbers)


def poses(folder: Path | None, quick: bool) -> list[spem.Shape]:
    """Return poses of a horse, those that are drawn first, or of a dog made here."""
    voxels = 12_000 if quick else 100_000
    if folder is None:
        rng = np.random.default_rng(3)
        return [spem.creatures.creature("dog", ndim=3, voxels=voxels, rng=rng) for _ in range(3)]
    return [spem.read(folder / f"{name}.obj", voxels=voxels) for name in POSES[: 3 if quick else None]]


def draw(several: list[spem.Maps], found: list[Region], horses: bool) -> Figure:
    """Draw a row for each map, and a column for each pose."""
    view = view_rotation(SIDE_VIEW)[:, [1, 2, 0]] if horses else None
    figure = new_figure(6.6, 8.4)
    axes = figure.subplots(len(SHOWN), len(several))
    for row, j in zip(axes, SHOWN, strict=True):
        low, high = (region.threshold for region in found if region.map == j)
        for ax, maps in zip(row, several, strict=True):
            values = clear_values(maps, j, (low, high))
            draw_levels(maps.shape, values, (low, high), ax, view=view, size=(420, 330))
        words = f"{map_name(j)}: red above {high:.2g}" + (f", blue below {low:.2g}" if low < high else "")
        row[0].set_title(words.replace("-", "−"), fontsize=TEXT_SIZE, loc="left")
    return figure


if __name__ == "__main__":
    finding = present(make)
