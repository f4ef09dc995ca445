"""The value object of the first stage: a shape on a regular grid, and where its surface cuts the grid."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from spem.errors import ParameterError, ShapeError

# A cut closer to a node than this fraction of an edge is moved there: the field changes by at
# most this fraction of its variation along one edge, and the diagonal of the operator stays finite.
MIN_FRACTION = 1e-6
# Where nothing more is known, the surface lies on the face between an inside and an outside voxel.
FACE_FRACTION = 0.5


@dataclass(frozen=True, eq=False)
class Cuts:
    """Where the surface cuts grid edges that leave an inside voxel.

    An edge between two inside voxels that is listed (once from each side) is cut as well: two
    surfaces pass between its ends. An edge from inside to outside that is not listed is cut at
    one half, on the face of the voxel.

    Parameters
    ----------
    voxel
        ``(n_cuts,)`` flat C-order index, into the mask, of the inside voxel that the edge leaves.
    direction
        ``(n_cuts,)`` direction of the edge: ``2 * axis`` toward lower, ``2 * axis + 1`` toward
        higher indices.
    fraction
        ``(n_cuts,)`` distance from the voxel's centre to the surface, in edges, in (0, 1].
    """

    voxel: NDArray[np.int64]
    direction: NDArray[np.uint8]
    fraction: NDArray[np.float64]

    def __post_init__(self) -> None:
        order = np.lexsort((self.direction, self.voxel))
        fraction = np.asarray(self.fraction, np.float64)[order]
        if not np.all((fraction > 0) & (fraction <= 1)):
            msg = "cut fractions must lie in (0, 1]"
            raise ParameterError(msg)
        object.__setattr__(self, "voxel", np.asarray(self.voxel, np.int64)[order])
        object.__setattr__(self, "direction", np.asarray(self.direction, np.uint8)[order])
        object.__setattr__(self, "fraction", np.maximum(fraction, MIN_FRACTION))

    @classmethod
    def none(cls) -> Self:
        """No cut is known: every boundary edge is cut on the face of its voxel."""
        return cls(np.empty(0, np.int64), np.empty(0, np.uint8), np.empty(0))

    def __len__(self) -> int:
        return self.voxel.size


@dataclass(frozen=True)
class Report:
    """What was read and what was done to it: nothing that changes a shape is silent.

    Parameters
    ----------
    source
        Where the shape came from: a path, or the call that made it.
    method
        How inside was told from outside, in words.
    watertight
        Whether a mesh was closed and consistently oriented; None for other sources.
    components
        Number of connected components found before any was dropped.
    volume_kept
        Fraction of the volume found that the shape still has.
    repairs
        What was changed, one phrase each.
    """

    source: str = ""
    method: str = ""
    watertight: bool | None = None
    components: int = 1
    volume_kept: float = 1.0
    repairs: tuple[str, ...] = ()

    def with_repair(self, *phrases: str) -> Report:
        """Return the report with further phrases added to `repairs`."""
        return replace(self, repairs=self.repairs + phrases)


@dataclass(frozen=True, eq=False)
class Shape:
    """A bounded region of space sampled on a regular grid.

    Parameters
    ----------
    mask
        ``(n_0, ..., n_{d-1})`` boolean, True at voxels whose centre lies inside. Its outermost
        layer is False; use `Shape.from_mask` to have that arranged.
    spacing
        ``(d,)`` distance between voxel centres along each axis, in the unit of the source.
    origin
        ``(d,)`` coordinates of the centre of ``mask[0, ..., 0]``, in the shape's own coordinates:
        array-axis order times spacing for images and volumes, x y z for meshes.
    name
        Short name for messages and pictures.
    cuts
        Where the surface cuts the edges of the grid.
    report
        What was read and what was done to it.
    affine
        ``(d + 1, d + 1)`` map from array index of the *source* to world coordinates, or None.
    """

    mask: NDArray[np.bool_]
    spacing: tuple[float, ...]
    origin: tuple[float, ...]
    name: str = "shape"
    cuts: Cuts = field(default_factory=Cuts.none)
    report: Report = field(default_factory=Report)
    affine: NDArray[np.float64] | None = None

    def __post_init__(self) -> None:
        d = self.mask.ndim
        if len(self.spacing) != d or len(self.origin) != d:
            msg = f"{self.name}: a {d}-dimensional mask needs {d} spacings and origins"
            raise ParameterError(msg)
        if not all(np.isfinite(h) and h > 0 for h in self.spacing):
            msg = f"{self.name}: spacing {self.spacing} must be positive and finite"
            raise ParameterError(msg)
        for axis in range(d):
            if self.mask.take([0, -1], axis=axis).any():
                msg = f"{self.name}: the outermost layer of a mask must be outside; use Shape.from_mask"
                raise ShapeError(msg)
        if not self.mask.any():
            msg = f"{self.name}: no voxel centre lies inside the shape; use a finer spacing"
            raise ShapeError(msg)

    @classmethod
    def from_mask(
        cls,
        mask: ArrayLike,
        spacing: float | tuple[float, ...] = 1.0,
        *,
        origin: tuple[float, ...] | None = None,
        name: str = "shape",
        cuts: Cuts | None = None,
        **rest: Any,
    ) -> Self:
        """Make a shape from any boolean array: cropped to the shape, one outside layer around it.

        Points keep their coordinates, the origin moves with the crop.

        Parameters
        ----------
        mask
            ``(n_0, ..., n_{d-1})`` array, non-zero inside.
        spacing
            One spacing for all axes, or one per axis.
        origin
            Coordinates of the centre of ``mask[0, ..., 0]``; zeros by default.
        name
            Short name.
        cuts
            Cuts indexed into `mask` as given.
        **rest
            `report` and `affine`, passed on.

        Examples
        --------
        >>> import numpy as np
        >>> Shape.from_mask(np.ones((3, 4)), spacing=0.5)
        Shape('shape', 2-D, 12 nodes, grid 5 x 6, spacing 0.5 x 0.5)
        """
        inside = np.asarray(mask).astype(bool)
        if inside.ndim == 0 or not inside.any():
            msg = f"{name}: no voxel centre lies inside the shape; use a finer spacing"
            raise ShapeError(msg)
        d = inside.ndim
        steps = (float(spacing),) * d if np.isscalar(spacing) else tuple(map(float, spacing))  # type: ignore[arg-type]
        start = (0.0,) * d if origin is None else tuple(map(float, origin))
        low, high = _bounding_box(inside)
        framed = np.zeros(tuple(high - low + 2), bool)
        framed[(slice(1, -1),) * d] = inside[tuple(map(slice, low, high))]
        moved = tuple(o + h * (int(i) - 1) for o, h, i in zip(start, steps, low, strict=True))
        if cuts is not None and len(cuts):
            index = np.array(np.unravel_index(cuts.voxel, inside.shape)) - (low - 1)[:, None]
            voxel = np.ravel_multi_index(tuple(index), framed.shape)
            cuts = Cuts(voxel, cuts.direction, cuts.fraction)
        return cls(framed, steps, moved, name, cuts or Cuts.none(), **rest)

    @property
    def ndim(self) -> int:
        """Dimension of the space the shape lives in."""
        return self.mask.ndim

    @cached_property
    def voxels(self) -> NDArray[np.int64]:
        """``(n_nodes,)`` flat C-order index of each inside voxel: the order of all node arrays."""
        return np.flatnonzero(self.mask)

    @property
    def n_nodes(self) -> int:
        """Number of inside voxels."""
        return self.voxels.size

    @cached_property
    def volume(self) -> float:
        """Length, area, volume ... of the shape, in units of the spacing, with the surface where it is cut.

        Along one axis, a node owns half of each uncut edge and its part of each cut one. Axes are weighted
        by the square of their number of cuts: the more lines meet the surface, the better they measure.
        """
        axis = self.cuts.direction // 2
        count = np.bincount(axis, minlength=self.ndim).astype(np.float64)
        excess = np.bincount(axis, self.cuts.fraction - FACE_FRACTION, self.ndim)
        weight = np.square(count) / max(float(np.square(count).sum()), 1.0)
        return float((self.n_nodes + weight @ excess) * np.prod(self.spacing))

    @property
    def size(self) -> float:
        """Side of the cube of equal volume, ``volume ** (1 / d)``: the unit of default ρ ranges."""
        return float(self.volume ** (1 / self.ndim))

    @property
    def points(self) -> NDArray[np.float64]:
        """``(n_nodes, d)`` coordinates of the nodes, in the shape's own coordinates."""
        index = np.stack(np.unravel_index(self.voxels, self.mask.shape), axis=1)
        return np.asarray(np.asarray(self.origin) + index * np.asarray(self.spacing))

    @property
    def axes(self) -> tuple[NDArray[np.float64], ...]:
        """Coordinates of the grid along each axis."""
        counts = self.mask.shape
        return tuple(o + h * np.arange(n) for o, h, n in zip(self.origin, self.spacing, counts, strict=True))

    def to_grid(self, values: ArrayLike, fill: float = np.nan) -> NDArray[np.float64]:
        """Scatter node values ``(n_nodes, ...)`` to the grid; `fill` stands outside the shape."""
        nodal = np.asarray(values)
        grid = np.full((self.mask.size, *nodal.shape[1:]), fill, np.result_type(nodal, np.float32))
        grid[self.voxels] = nodal
        return np.asarray(grid.reshape(self.mask.shape + nodal.shape[1:]))

    def __repr__(self) -> str:
        grid = " x ".join(map(str, self.mask.shape))
        spacing = " x ".join(f"{h:.4g}" for h in self.spacing)
        return f"Shape({self.name!r}, {self.ndim}-D, {self.n_nodes} nodes, grid {grid}, spacing {spacing})"


def _bounding_box(mask: NDArray[np.bool_]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return the first and one past the last inside index along each axis."""
    low, high = [], []
    for axis in range(mask.ndim):
        hit = np.flatnonzero(mask.any(axis=tuple(a for a in range(mask.ndim) if a != axis)))
        low.append(hit[0])
        high.append(hit[-1] + 1)
    return np.array(low), np.array(high)
