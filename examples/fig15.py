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
from numpy.typing import NDArray

import spem
from spem.paper.consistency import distribution_distances, pairs
from spem.paper.data import Data
from spem.paper.findings import Claim, Finding, Picture, judged
from spem.paper.pose_regions import Region, clear_values, mean_variation, pose_maps, regions, shadow
from spem.paper.present import present
from spem.plots.camera import view_rotation
from spem.plots.figures import map_name
from spem.plots.level_surfaces import draw_levels
from spem.plots.style import TEXT_SIZE, new_figure

# With the second coordinate up, as the meshes of horses have it: from the front left, a little above.
SIDE_VIEW = (18.0, 118.0)
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
    absent = data.absent("horse_poses") if folder is None else ""
    numbers = {
        **{what: {r.name: getattr(r, what) for r in found} for what in ("threshold", "shares", "pieces")},
        "distance_solid": distances[0],
        "distance_silhouette": distances[1],
        "variation_solid": mean_variation(found),
        "variation_silhouette": mean_variation(seen),
    }
    source = (
        "The horse of Sumner and Popović, whose mesh has two small holes, in ten poses and at rest."
        if folder
        else "Dogs made here, in place of the paper's horse."
    )
    figure = draw(solid[:3], found, folder is not None)
    picture = Picture("levels", figure, "P₂ to P₆ beyond their thresholds, without specks.")
    claims = (thresholded(found, absent), steadier(found, seen, distances, absent))
    return Finding(source, claims, (picture,), numbers)


def thresholded(found: list[Region], absent: str) -> Claim:
    """Judge how much of the volume lies beyond one threshold, from pose to pose."""
    most = max(float(np.ptp(region.shares)) for region in found)
    return judged(
        "Each projection is consistent for different poses, after thresholding too (5.3, Fig. 15).",
        "consistent, as seen",
        "one threshold for all poses: the share of the volume beyond it varies by "
        f"{100 * mean_variation(found):.0f} % of itself on average, by {most:.3f} of the volume at most; its "
        f"pieces by {max(int(np.ptp(r.pieces)) for r in found)} at most, over {found[0].shares.size} poses",
        most < 0.05,
        note=absent or "A change below 5 % of the volume was asked for.",
        tested=not absent,
    )


def steadier(found: list[Region], seen: list[Region], apart: list[NDArray[np.float64]], absent: str) -> Claim:
    """Judge maps of solids against those of their silhouettes."""
    words = ", ".join(f"{map_name(j)} {a:.3f} ({b:.3f})" for j, a, b in zip(SHOWN, *apart, strict=True))
    solid, flat = mean_variation(found), mean_variation(seen)
    return judged(
        "Maps of a solid are more consistent across poses than those of its silhouette (5.3).",
        "more consistent",
        f"distance of distributions between poses, solid (silhouette), in standard deviations: {words}; "
        f"variation of the regions beyond thresholds {solid:.2f} ({flat:.2f})",
        bool((apart[0] < apart[1]).all() and solid < flat),
        note=absent or "For some map the silhouettes of these poses are nearer to each other.",
        tested=not absent,
    )


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
