"""Lines and surfaces of equal value of a node field, within the shape."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray
from skimage.measure import find_contours, marching_cubes

from spem.errors import ParameterError, ShapeError
from spem.shapes.shape import Shape

Lines = list[NDArray[np.float64]]
Mesh = tuple[NDArray[np.float64], NDArray[np.int64]]


def equal_levels(values: ArrayLike, count: int) -> NDArray[np.float64]:
    """Return levels at equal steps between the least and the greatest finite value, both left out.

    Parameters
    ----------
    values
        Values of any shape; -inf and NaN are passed over.
    count
        Number of levels.

    Returns
    -------
    levels
        ``(count,)``, rising; all the same if the values are.

    Raises
    ------
    ParameterError
        If `count` is not positive or no value is finite.

    Examples
    --------
    >>> equal_levels([-np.inf, -8.0, 0.0], 3)
    array([-6., -4., -2.])
    """
    array = np.asarray(values, np.float64)
    finite = array[np.isfinite(array)]
    if count < 1 or not finite.size:
        msg = f"count={count} levels of {finite.size} finite values: expected at least one of each"
        raise ParameterError(msg)
    return np.linspace(finite.min(), finite.max(), count + 2)[1:-1]


def iso_contours(shape: Shape, values: ArrayLike, levels: ArrayLike) -> list[Lines]:
    """Trace the lines of equal value of a field on a two-dimensional shape.

    Values are interpolated linearly along the edges between nodes, so lines end at the outermost nodes and
    never cross voxels outside. Of a logarithm, equal steps are equal ratios of the field.

    Parameters
    ----------
    shape
        A two-dimensional shape.
    values
        ``(n_nodes,)`` the field; lines keep clear of nodes where it is infinite or NaN.
    levels
        ``(k,)`` values to trace; `equal_levels` gives them.

    Returns
    -------
    contours
        For each level a list of polylines ``(n_points, 2)``, in the shape's own coordinates; closed ones
        repeat their first point.

    Raises
    ------
    ShapeError
        If the shape is not two-dimensional.
    ParameterError
        If there is not one value for each node.

    Examples
    --------
    >>> shape = Shape.from_mask(np.ones((3, 3)))
    >>> iso_contours(shape, shape.points[:, 0], [0.5])[0][0].tolist()
    [[0.5, 0.0], [0.5, 1.0], [0.5, 2.0]]
    """
    grid = _grid(shape, values, 2, "iso_surfaces")
    start, step = np.asarray(shape.origin), np.asarray(shape.spacing)
    return [[start + line * step for line in find_contours(grid, level)] for level in np.ravel(levels)]


def iso_surfaces(shape: Shape, values: ArrayLike, levels: ArrayLike) -> list[Mesh]:
    """Triangulate the surfaces of equal value of a field on a three-dimensional shape, by marching cubes.

    Parameters
    ----------
    shape
        A three-dimensional shape.
    values
        ``(n_nodes,)`` the field; surfaces keep clear of nodes where it is infinite or NaN.
    levels
        ``(k,)`` values to trace.

    Returns
    -------
    surfaces
        For each level the vertices ``(n_vertices, 3)``, in the shape's own coordinates, and faces
        ``(n_faces, 3)``; both empty where the level is not met.

    Raises
    ------
    ShapeError
        If the shape is not three-dimensional.
    ParameterError
        If there is not one value for each node.

    Examples
    --------
    >>> shape = Shape.from_mask(np.ones((3, 3, 3)))
    >>> vertices, faces = iso_surfaces(shape, shape.points[:, 0], [0.5])[0]
    >>> len(faces), set(vertices[:, 0].tolist())
    (8, {0.5})
    """
    grid = _grid(shape, values, 3, "iso_contours")
    known = np.isfinite(grid)
    # Marching cubes wants finite values everywhere, and takes a cube if the mask is set at its last corner.
    whole = np.zeros(grid.shape, bool)
    cubes = np.lib.stride_tricks.sliding_window_view(known, (2, 2, 2))
    whole[1:, 1:, 1:] = cubes.all(axis=(3, 4, 5))
    filled = np.where(known, grid, 0.0)
    start, step = np.asarray(shape.origin), np.asarray(shape.spacing)
    surfaces = []
    for level in np.ravel(levels):
        vertices, faces = _march(filled, whole, float(level))
        surfaces.append((start + vertices * step, faces))
    return surfaces


def _march(grid: NDArray[np.float64], cubes: NDArray[np.bool_], level: float) -> Mesh:
    """Vertices, in grid indices, and faces of one level; none where no cube meets it."""
    corners = np.lib.stride_tricks.sliding_window_view(grid, (2, 2, 2))[cubes[1:, 1:, 1:]].reshape(-1, 8)
    if not ((corners.min(axis=1) < level) & (corners.max(axis=1) >= level)).any():
        return np.empty((0, 3)), np.empty((0, 3), np.int64)
    vertices, faces, _, _ = marching_cubes(grid, level, mask=cubes)
    return vertices.astype(np.float64), faces.astype(np.int64)


def _grid(shape: Shape, values: ArrayLike, ndim: int, other: str) -> NDArray[np.float64]:
    """Values on the grid, NaN outside and where they are not finite."""
    if shape.ndim != ndim:
        msg = f"{shape.name}: expected a shape of {ndim} dimensions, this one has {shape.ndim}"
        if shape.ndim in (2, 3):
            msg += f"; use {other}"
        raise ShapeError(msg)
    nodal = np.asarray(values, np.float64)
    if nodal.shape != (shape.n_nodes,):
        msg = f"{shape.name}: values must be ({shape.n_nodes},), one a node, not {nodal.shape}"
        raise ParameterError(msg)
    return shape.to_grid(np.where(np.isfinite(nodal), nodal, np.nan))
