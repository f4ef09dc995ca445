"""Points spread evenly along the contours of a silhouette, with the tangent at each."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from spem.errors import ParameterError, ShapeError, require_kind
from spem.fields.boundary.points import boundary_points
from spem.fields.operator import Boundary, assemble
from spem.shapes.shape import Shape

# Points of a contour while it is smoothed, for each point asked for: tangents are differences of them.
_FINE = 8
# A polygon.
_LEAST = 3


@dataclass(frozen=True, eq=False)
class ContourPoints:
    """Points along the contours of a silhouette, one contour after the other, with the shape on the left.

    Left is seen with axis 0 to the right and axis 1 up.

    Parameters
    ----------
    position
        ``(n_points, 2)`` coordinates, in the shape's own coordinates.
    tangent
        ``(n_points, 2)`` unit vectors along the contour.
    contour
        ``(n_points,)`` number of the contour of each point, ascending: outer ones by length, then holes.
    """

    position: NDArray[np.float64]
    tangent: NDArray[np.float64]
    contour: NDArray[np.int32]

    @property
    def onward(self) -> NDArray[np.int32]:
        """``(n_points,)`` number of the next point of the same contour."""
        following = np.arange(1, self.contour.size + 1, dtype=np.int32)
        first = np.flatnonzero(np.diff(self.contour, prepend=-1))
        following[np.append(first[1:], self.contour.size) - 1] = first
        return following

    def __repr__(self) -> str:
        return f"ContourPoints({self.contour.size} points, {np.unique(self.contour).size} contours)"


def contour_points(
    shape: Shape,
    n_points: int = 128,
    *,
    smoothing: float = 1.0,
    holes: bool = True,
    boundary: Boundary = "surface",
) -> ContourPoints:
    """Spread points evenly along the contours of a silhouette.

    A contour joins the boundary points of a boundary model. It is smoothed along its length, which takes the
    steps of the grid out of it, and has points in proportion to its length; one that would have fewer than
    three is left out, but for the longest.

    Parameters
    ----------
    shape
        A shape of two dimensions.
    n_points
        Number of points in all.
    smoothing
        Standard deviation of the smoothing along the contour, in steps from point to point, or in voxels
        where these are larger; at most a twelfth of a contour is smoothed over.
    holes
        Whether the contours of holes count, or the outer ones alone.
    boundary
        Boundary model.

    Returns
    -------
    ContourPoints
        `n_points` points.

    Raises
    ------
    ShapeError
        When the shape is not of two dimensions.
    ParameterError
        When there are fewer than three points, or the smoothing is negative or not finite.

    Examples
    --------
    >>> from spem.shapes.synthetic import annulus
    >>> contour_points(annulus(0.5, 1.0, 0.05), 90)
    ContourPoints(90 points, 2 contours)
    """
    require_kind(shape, Shape, "read it first: spem.read(...)")
    if shape.ndim != 2:
        msg = f"{shape.name}: a {shape.ndim}-D shape has no contours; expected a silhouette"
        raise ShapeError(msg)
    if n_points < _LEAST or not 0 <= smoothing < np.inf:
        msg = f"n_points={n_points!r}, smoothing={smoothing!r}: expected 3 or more, and 0 or more"
        raise ParameterError(msg)
    lines = _lines(shape, holes=holes, boundary=boundary)
    lengths = np.array([_step_lengths(line).sum() for line in lines])
    counts = _shares(lengths, n_points)
    width = smoothing * max(*shape.spacing, float(lengths.sum()) / n_points)
    kept = np.flatnonzero(counts)
    placed = [_spread(lines[k], int(counts[k]), width) for k in kept]
    position, tangent = (np.concatenate(parts) for parts in zip(*placed, strict=True))
    return ContourPoints(position, tangent, np.repeat(kept, counts[kept]).astype(np.int32))


def _lines(shape: Shape, *, holes: bool, boundary: Boundary) -> list[NDArray[np.float64]]:
    """Return the boundary points of each contour in turn, those that enclose the shape first."""
    points = boundary_points(assemble(shape, boundary))
    starts = np.flatnonzero(np.diff(points.contour)) + 1
    lines = np.split(points.position, starts)
    outer = [line for line in lines if _signed_area(line) > 0]
    return lines if holes or not outer else outer


def _signed_area(line: NDArray[np.float64]) -> float:
    """Return the area that a contour has on its left; negative of a hole."""
    x, y = (line - line[0]).T
    return float(np.sum(x * np.roll(y, -1) - y * np.roll(x, -1)) / 2)


def _step_lengths(line: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the lengths from each point of a closed line to the next."""
    return np.asarray(np.linalg.norm(np.roll(line, -1, axis=0) - line, axis=1))


def _shares(lengths: NDArray[np.float64], n_points: int) -> NDArray[np.int64]:
    """Divide points among contours by length: none for those whose share is no polygon."""
    counts = np.floor(n_points * lengths / lengths.sum()).astype(np.int64)
    counts[counts < _LEAST] = 0
    longest = int(lengths.argmax())
    counts[longest] += n_points - counts.sum()
    return np.asarray(counts)


def _spread(
    line: NDArray[np.float64], count: int, width: float
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Smooth a closed line and return so many points of it, evenly spaced, with their tangents."""
    fine = _resample(line, _FINE * count)
    length = float(_step_lengths(fine).sum())
    frequency = np.fft.rfftfreq(len(fine), length / len(fine))
    # The transform of a Gaussian of standard deviation σ is exp(-2 (π σ f)²).
    damping = np.exp(-2 * (np.pi * min(width, length / 12) * frequency) ** 2)
    smooth = np.fft.irfft(np.fft.rfft(fine, axis=0) * damping[:, None], len(fine), axis=0)
    even = _resample(smooth, _FINE * count)
    along = np.roll(even, -1, axis=0) - np.roll(even, 1, axis=0)
    size = np.linalg.norm(along, axis=1, keepdims=True)
    tangent = along / np.where(size > 0, size, 1.0)
    return even[::_FINE].copy(), tangent[::_FINE].copy()


def _resample(line: NDArray[np.float64], count: int) -> NDArray[np.float64]:
    """Return so many points along a closed line, evenly spaced from its first."""
    travelled = np.concatenate([[0.0], np.cumsum(_step_lengths(line))])
    closed = np.concatenate([line, line[:1]])
    at = travelled[-1] * np.arange(count) / count
    return np.stack([np.interp(at, travelled, column) for column in closed.T], axis=1)
