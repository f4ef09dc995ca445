"""Solids in poses: their maps, the regions beyond thresholds, and the same poses as silhouettes (Fig. 15)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from spem.api.fields import maps as compute_maps
from spem.embedding.histograms import first_jumps
from spem.embedding.maps import Maps
from spem.paper.consistency import RTOL, paper_rho
from spem.paper.regions import region_sizes
from spem.plots.figures import map_name
from spem.shapes.components import keep_components
from spem.shapes.shape import Shape

# Pictures leave out what is nearer to the boundary than so many voxels, where the layers of higher maps are
# thinner than the grid, and pieces smaller than this share of the nodes.
LAYER, LEAST_PIECE = 1.5, 0.0005


@dataclass(frozen=True, eq=False)
class Region:
    """What lies beyond one threshold of one map, in each of several poses.

    Parameters
    ----------
    map
        Number of the map, from zero.
    threshold
        The same in all poses; what lies above it, or below if it is on the lower side.
    upper
        Whether it is the upper of the two thresholds of the map.
    shares
        ``(n_poses,)`` share of the nodes beyond.
    pieces
        ``(n_poses,)`` number of connected pieces, small ones left out.
    """

    map: int
    threshold: float
    upper: bool
    shares: NDArray[np.float64]
    pieces: NDArray[np.int64]

    @property
    def name(self) -> str:
        """Name of the map, and on which side of the threshold it lies."""
        return f"{map_name(self.map)} {'above' if self.upper else 'below'}"

    @property
    def variation(self) -> float:
        """Standard deviation of the shares over the poses, relative to their mean."""
        return float(self.shares.std() / self.shares.mean())


def pose_maps(shapes: Sequence[Shape], n_maps: int) -> list[Maps]:
    """Compute the maps of shapes of any size on the paper's range of ρ in inner radii.

    Examples
    --------
    >>> import spem
    >>> [maps.values.shape[1] for maps in pose_maps([spem.synthetic.disk(radius=8.0, spacing=1.0)], 3)]
    [3]
    """
    return [compute_maps(shape, n_maps, rho=paper_rho(shape), rtol=RTOL) for shape in shapes]


def shadow(shape: Shape, axis: int = 0) -> Shape:
    """Return the silhouette of a solid as seen along an axis; its largest piece.

    Examples
    --------
    >>> shadow(Shape.from_mask(np.ones((2, 3, 4))))
    Shape('shape', 2-D, 12 nodes, grid 5 x 6, spacing 1 x 1)
    """
    spacing = tuple(h for a, h in enumerate(shape.spacing) if a != axis)
    return keep_components(Shape.from_mask(shape.mask.any(axis=axis), spacing, name=shape.name), "largest")


def regions(several: Sequence[Maps], which: Sequence[int]) -> list[Region]:
    """Threshold maps at the first jumps of their histograms over all poses, as Fig. 15 does.

    Parameters
    ----------
    several
        Maps of the poses.
    which
        Numbers of the maps, from zero.

    Returns
    -------
    regions
        The lower and the upper region of each map.

    Examples
    --------
    >>> import spem
    >>> several = pose_maps([spem.synthetic.disk(radius=8.0, spacing=1.0)], 2)
    >>> [(region.map, region.upper) for region in regions(several, [1])]
    [(1, False), (1, True)]
    """
    found = []
    for j in which:
        low, high = first_jumps(np.concatenate([maps.values[:, j] for maps in several]))
        for threshold, upper in ((low, False), (high, True)):
            inside = [(m.values[:, j] > high) if upper else (m.values[:, j] < low) for m in several]
            shares = np.array([mask.mean() for mask in inside])
            sizes = [region_sizes(m.shape, mask) for m, mask in zip(several, inside, strict=True)]
            found.append(Region(j, threshold, upper, shares, np.array([len(size) for size in sizes])))
    return found


def mean_variation(several: Sequence[Region]) -> float:
    """Return the mean variation of regions.

    Examples
    --------
    >>> region = Region(1, 0.0, True, np.array([0.1, 0.3]), np.array([1, 1]))
    >>> round(mean_variation([region]), 3)
    0.5
    """
    return float(np.mean([region.variation for region in several]))


def clear_values(maps: Maps, j: int, thresholds: tuple[float, float]) -> NDArray[np.float64]:
    """Return a map without what blurs pictures of its regions: flat near the boundary and in specks.

    Parameters
    ----------
    maps
        Maps of a shape of equal spacings.
    j
        Number of the map, from zero.
    thresholds
        The lower and the upper one.

    Examples
    --------
    >>> import spem
    >>> maps = pose_maps([spem.synthetic.disk(radius=8.0, spacing=1.0)], 2)[0]
    >>> bool((clear_values(maps, 1, (-1.0, 1.0)) >= -1.0).all())
    True
    """
    shape, values = maps.shape, np.asarray(maps.values[:, j], np.float64)
    # Off the thresholds by a hair: surfaces would run through nodes that are on them.
    hair = 0.01 * (thresholds[1] - thresholds[0])
    flat = np.clip(values, thresholds[0] + hair, thresholds[1] - hair)
    kept = np.zeros(shape.n_nodes, bool)
    inner = ndimage.distance_transform_edt(shape.mask)[shape.mask] > LAYER
    for beyond in (values < thresholds[0], values > thresholds[1]):
        grid = np.zeros(shape.mask.shape, bool)
        grid[shape.mask] = beyond & inner
        label = ndimage.label(grid)[0][shape.mask]
        large = np.bincount(label) >= LEAST_PIECE * shape.n_nodes
        kept |= large[label] & (label > 0)
    return np.where(kept, values, flat)
