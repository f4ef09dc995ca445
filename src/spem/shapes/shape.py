"""The value object of the first stage: a shape on a regular grid, and where its surface cuts the grid."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from spem.errors import ParameterError, ShapeError
from spem.shapes.grids import spacing_per_axis
from spem.shapes.surface import Surface

# A cut closer to a node than this fraction of an edge is moved there: the field changes by at
# most this fraction of its variation along one edge, and the diagonal of the operator stays finite.
MIN_FRACTION = 1e-6
# Where nothing more is known, the surface lies on the face between an inside and an outside voxel.
FACE_FRACTION = 0.5
_MAX_DIRECTION = np.iinfo(np.uint8).max


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

    Raises
    ------
    ParameterError
        When a number is out of range, the arrays differ in length, or an edge is listed twice.
    """

    voxel: NDArray[np.int64]
    direction: NDArray[np.uint8]
    fraction: NDArray[np.float64]

    def __post_init__(self) -> None:
        voxel, direction = _whole(self.voxel, "voxel"), _whole(self.direction, "direction")
        fraction = np.asarray(self.fraction, np.float64)
        if not voxel.shape == direction.shape == fraction.shape or voxel.ndim != 1:
            shapes = f"{voxel.shape}, {direction.shape} and {fraction.shape}"
            msg = f"cuts: expected voxel, direction and fraction of one length, got {shapes}"
            raise ParameterError(msg)
        if not np.all((fraction > 0) & (fraction <= 1)):
            msg = "cut fractions must lie in (0, 1]"
            raise ParameterError(msg)
        if direction.size and not 0 <= direction.min() <= direction.max() <= _MAX_DIRECTION:
            stray = direction.min() if direction.min() < 0 else direction.max()
            msg = f"cuts: direction {stray}, expected 0 to {_MAX_DIRECTION}"
            raise ParameterError(msg)
        order = np.lexsort((direction, voxel))
        voxel, direction = voxel[order], direction[order]
        twice = (voxel[1:] == voxel[:-1]) & (direction[1:] == direction[:-1])
        if twice.any():
            first = int(np.argmax(twice))
            edge = f"voxel {voxel[first]}, direction {direction[first]}"
            msg = f"cuts: {edge} is listed twice; give each edge once"
            raise ParameterError(msg)
        object.__setattr__(self, "voxel", voxel)
        object.__setattr__(self, "direction", direction.astype(np.uint8))
        object.__setattr__(self, "fraction", np.maximum(fraction[order], MIN_FRACTION))

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
        ``(w + 1, d + 1)`` map from array index of the *source* to the w world coordinates, or None; of a
        slice of a scan, d = 2 and w = 3.
    surface
        The triangle mesh that the shape was filled from, mended, in the shape's own coordinates; None where
        there was none. `spem.shapes.boundary_surface` has a surface for every shape of three dimensions.

    Raises
    ------
    ShapeError
        When no voxel is inside, or one of the outermost layer is.
    ParameterError
        When spacing, origin or cuts do not fit the mask.
    """

    mask: NDArray[np.bool_]
    spacing: tuple[float, ...]
    origin: tuple[float, ...]
    name: str = "shape"
    cuts: Cuts = field(default_factory=Cuts.none)
    report: Report = field(default_factory=Report)
    affine: NDArray[np.float64] | None = None
    surface: Surface | None = None

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
        _check_cuts(self.mask, self.cuts, self.name)

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
            `report`, `affine` and `surface`, passed on.

        Raises
        ------
        ShapeError
            When nothing is inside.
        ParameterError
            When spacing or cuts do not fit the mask.

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
        steps = spacing_per_axis(spacing, d, name)
        start = (0.0,) * d if origin is None else tuple(map(float, origin))
        low, high = _bounding_box(inside)
        framed = np.zeros(tuple(high - low + 2), bool)
        framed[(slice(1, -1),) * d] = inside[tuple(map(slice, low, high))]
        moved = tuple(o + h * (int(i) - 1) for o, h, i in zip(start, steps, low, strict=True))
        if cuts is not None and len(cuts):
            _check_ends(inside, cuts, name)
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
        nodes = f"{self.n_nodes} node{'s' if self.n_nodes > 1 else ''}"
        return f"Shape({self.name!r}, {self.ndim}-D, {nodes}, grid {grid}, spacing {spacing})"


def _bounding_box(mask: NDArray[np.bool_]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return the first and one past the last inside index along each axis."""
    low, high = [], []
    for axis in range(mask.ndim):
        hit = np.flatnonzero(mask.any(axis=tuple(a for a in range(mask.ndim) if a != axis)))
        low.append(hit[0])
        high.append(hit[-1] + 1)
    return np.array(low), np.array(high)


def _whole(values: ArrayLike, what: str) -> NDArray[np.int64]:
    """Return whole numbers as such."""
    numbers = np.asarray(values)
    if numbers.size and numbers.dtype.kind not in "iu":
        msg = f"cuts: {what} must hold whole numbers, got {numbers.dtype}"
        raise ParameterError(msg)
    return numbers.astype(np.int64)


def _check_ends(mask: NDArray[np.bool_], cuts: Cuts, name: str) -> None:
    """Refuse cuts that leave no inside voxel of the mask, or leave it in no direction of its grid."""
    voxel, d = cuts.voxel, mask.ndim
    # sorted by voxel, so the ends are the extremes
    if len(cuts) and (voxel[0] < 0 or voxel[-1] >= mask.size):
        stray = voxel[0] if voxel[0] < 0 else voxel[-1]
        msg = f"{name}: a cut leaves voxel {stray}, expected 0 to {mask.size - 1}, as the mask has"
        raise ParameterError(msg)
    within = mask.ravel()[voxel]
    if not within.all():
        msg = f"{name}: a cut leaves voxel {voxel[np.argmin(within)]}, which is outside; list it from inside"
        raise ParameterError(msg)
    if len(cuts) and cuts.direction.max() >= 2 * d:
        msg = f"{name}: a cut has direction {cuts.direction.max()}, expected 0 to {2 * d - 1} in {d}-D"
        raise ParameterError(msg)


def _check_cuts(mask: NDArray[np.bool_], cuts: Cuts, name: str) -> None:
    """Refuse cuts that do not fit a framed mask; an edge between inside voxels is cut from both ends."""
    _check_ends(mask, cuts, name)
    d = mask.ndim
    strides = [int(np.prod(mask.shape[axis + 1 :])) for axis in range(d)]
    signed = np.array([sign * stride for stride in strides for sign in (-1, 1)])  # by direction
    end = cuts.voxel + signed[cuts.direction]
    between = np.flatnonzero(mask.ravel()[end])
    if not between.size:
        return
    direction = cuts.direction[between].astype(np.int64)
    listed = cuts.voxel[between] * (2 * d) + direction
    answered = np.isin(end[between] * (2 * d) + (direction ^ 1), listed)
    if not answered.all():
        lone = int(between[np.argmin(answered)])
        msg = (
            f"{name}: the edge between inside voxels {cuts.voxel[lone]} and {end[lone]} is cut from the "
            "first alone; list the cut from the other side too"
        )
        raise ParameterError(msg)
