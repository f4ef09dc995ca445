"""The plane of a picture of a shape: where its grid lies and where the picture ends."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.patches import PathPatch
from matplotlib.path import Path
from skimage.measure import find_contours

from spem.errors import ShapeError
from spem.plots.style import bare

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from numpy.typing import NDArray

    from spem.shapes.shape import Shape


def require_dimension(shape: Shape, wanted: int, what: str) -> None:
    """Raise a `ShapeError` unless the shape has the dimension that a picture needs.

    Examples
    --------
    >>> from spem.shapes.shape import Shape
    >>> require_dimension(Shape.from_mask([1, 1]), 1, "a curve")
    """
    if shape.ndim != wanted:
        msg = f"{shape.name}: {what} is drawn of a shape of {wanted} dimensions, this one has {shape.ndim}"
        raise ShapeError(msg)


def extent(shape: Shape, axes: tuple[int, int] = (0, 1)) -> tuple[float, float, float, float]:
    """Return the left, right, bottom and top edge of the grid, half a voxel beyond its outermost centres.

    Examples
    --------
    >>> from spem.shapes.shape import Shape
    >>> extent(Shape.from_mask(np.ones((2, 3))))
    (-1.5, 3.5, 2.5, -1.5)
    """
    start = [shape.origin[a] - shape.spacing[a] / 2 for a in axes]
    stop = [b + shape.mask.shape[a] * shape.spacing[a] for a, b in zip(axes, start, strict=True)]
    return start[1], stop[1], stop[0], start[0]


def frame(shape: Shape, ax: Axes, axes: tuple[int, int] = (0, 1)) -> None:
    """Set the limits of an axis to the grid, its first axis down.

    Examples
    --------
    >>> from spem.plots.style import new_figure
    >>> from spem.shapes.shape import Shape
    >>> ax = new_figure(2, 2).add_subplot()
    >>> frame(Shape.from_mask(np.ones((2, 3))), ax)
    >>> [float(end) for end in ax.get_ylim()]
    [2.5, -1.5]
    """
    left, right, bottom, top = extent(shape, axes)
    ax.set_xlim(left, right)
    ax.set_ylim(bottom, top)
    ax.set_aspect("equal")
    bare(ax)


def contour_lines(
    shape: Shape, grid: NDArray[np.float64], level: float = 0.0, axes: tuple[int, int] = (0, 1)
) -> list[NDArray[np.float64]]:
    """Return the polylines (x, y) of a level of a plane of the grid, in the shape's coordinates.

    Examples
    --------
    >>> from spem.shapes.shape import Shape
    >>> shape = Shape.from_mask(np.ones((2, 3)))
    >>> [line.shape for line in contour_lines(shape, shape.to_grid(np.ones(6), -1.0))]
    [(11, 2)]
    """
    start, step = (np.array([whole[a] for a in axes]) for whole in (shape.origin, shape.spacing))
    return [(start + line * step)[:, ::-1] for line in find_contours(grid, level)]


def clip_to(artist: Artist, ax: Axes, lines: list[NDArray[np.float64]]) -> None:
    """Draw an artist inside closed lines only; lines the other way round leave holes.

    Examples
    --------
    >>> from spem.plots.style import new_figure
    >>> ax = new_figure(2, 2).add_subplot()
    >>> image = ax.imshow(np.ones((2, 2)))
    >>> clip_to(image, ax, [np.array([[0.0, 0], [1, 0], [1, 1], [0, 0]])])
    >>> image.get_clip_path() is None
    False
    """
    path = Path.make_compound_path(*map(Path, lines)) if lines else Path(np.empty((0, 2)))
    artist.set_clip_path(PathPatch(path, transform=ax.transData))
