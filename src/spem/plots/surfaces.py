"""Surfaces of three-dimensional shapes, whole or cut open, with node values on them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from scipy.ndimage import map_coordinates
from skimage.measure import marching_cubes

from spem.errors import ParameterError, ShapeError
from spem.plots.camera import principal_view, view_rotation
from spem.plots.extension import extend_values
from spem.plots.level import surface_level
from spem.plots.raster import render_surface, vertex_normals
from spem.plots.style import FIELD_CMAP, MAP_CMAP, bare
from spem.plots.values import value_limits

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.image import AxesImage
    from numpy.typing import ArrayLike, NDArray

    from spem.plots.camera import View
    from spem.shapes.shape import Shape

# Values are read this many voxels below the surface, where fields differ from their boundary value.
SAMPLE_DEPTH = 1.0
# Level beyond a section: so low that the section lies on its plane of nodes to rounding.
FAR_OUTSIDE = -1e6


@dataclass(frozen=True, eq=False)
class Surface:
    """A triangle mesh around a shape and where its colours are read.

    Parameters
    ----------
    vertices
        ``(n_vertices, 3)`` coordinates, in the shape's own coordinates.
    faces
        ``(n_faces, 3)`` vertex numbers, counter-clockwise seen from outside.
    samples
        ``(n_vertices, 3)`` grid index, with fractions, where values are read.
    section
        ``(n_vertices,)`` True on the plane that cuts the shape open.
    """

    vertices: NDArray[np.float64]
    faces: NDArray[np.int64]
    samples: NDArray[np.float64]
    section: NDArray[np.bool_]

    @property
    def cut_faces(self) -> NDArray[np.bool_]:
        """``(n_faces,)`` True on the plane that cuts the shape open."""
        return np.asarray(self.section[self.faces].all(axis=1))


def shape_surface(shape: Shape, cut: int | None = None, *, toward: ArrayLike = (1.0, 1.0, 1.0)) -> Surface:
    """Return a smooth surface of a shape by marching cubes, whole or cut open by a plane.

    Parameters
    ----------
    shape
        A three-dimensional shape.
    cut
        Axis across which the shape is cut through its median node, or None.
    toward
        ``(3,)`` direction to the viewer; the half on that side is taken away.

    Raises
    ------
    ShapeError
        If the shape is not three-dimensional.
    ParameterError
        If `cut` is no axis.

    Examples
    --------
    >>> from spem.shapes.shape import Shape
    >>> surface = shape_surface(Shape.from_mask(np.ones((3, 3, 3))))
    >>> surface.vertices.shape[1], bool(np.abs(surface.vertices - 1).max() < 1.8)
    (3, True)
    """
    if shape.ndim != 3:
        msg = f"{shape.name}: a surface is drawn of a shape of 3 dimensions, this one has {shape.ndim}"
        raise ShapeError(msg)
    level = surface_level(shape)
    first = np.zeros(3)
    plane = 0
    if cut is not None:
        level, first, plane = _open_level(shape, level, cut, float(np.asarray(toward)[cut]))
    index, faces, _, _ = marching_cubes(level, 0.0, gradient_direction="ascent")
    index, faces = index.astype(np.float64) + first, faces.astype(np.int64)
    section = np.zeros(len(index), bool)
    if cut is not None:
        section = np.abs(index[:, cut] - plane) < 1e-3
        index[section, cut] = plane
        index, faces, section = _split_rim(index, faces, section)
    spacing = np.asarray(shape.spacing)
    vertices = np.asarray(shape.origin) + index * spacing
    inward = -vertex_normals(vertices, faces) * min(shape.spacing) / spacing
    samples = np.where(section[:, None], index, index + SAMPLE_DEPTH * inward)
    return Surface(vertices, faces, samples, section)


def surface_values(
    shape: Shape, surface: Surface, values: ArrayLike, *, boundary: float | None = None
) -> NDArray[np.float64]:
    """Return the values that a surface shows: interpolated one voxel below it, and on its section.

    Parameters
    ----------
    shape
        The shape the surface was made of.
    surface
        From `shape_surface`.
    values
        ``(n_nodes,)`` one value a node.
    boundary
        Value on the surface, where it is known; the section is interpolated up to it.

    Returns
    -------
    vertex_values
        ``(n_vertices,)``; on a section, the values on its plane.

    Examples
    --------
    >>> from spem.shapes.shape import Shape
    >>> shape = Shape.from_mask(np.ones((3, 3, 3)))
    >>> surface_values(shape, shape_surface(shape), np.full(27, 0.5)).round(6).max()
    np.float64(0.5)
    """
    extended = extend_values(shape, values, surface_level(shape), boundary=boundary)
    shown: NDArray[np.float64] = map_coordinates(extended, surface.samples.T, order=1, mode="nearest")
    return shown


def picture_surface(
    shape: Shape,
    values: ArrayLike | None = None,
    *,
    view: View | None = None,
    cut: int | None = None,
    symmetric: bool = False,
    limits: tuple[float, float] | None = None,
    size: tuple[int, int] = (320, 320),
) -> NDArray[np.uint8]:
    """Return a shaded picture of a shape, coloured by node values, whole or cut open.

    Parameters
    ----------
    shape
        A three-dimensional shape.
    values
        ``(n_nodes,)`` values just below the surface and on the section, or None for one colour.
    view
        Elevation and azimuth in degrees, a rotation, or None to look at the broad side.
    cut
        Axis across which to cut the shape open, -1 for the one that faces the viewer most, or None.
    symmetric
        Whether values are signed, coloured about zero.
    limits
        Values at the ends of the colour map; by default those of the values.
    size
        Width and height in pixels.

    Returns
    -------
    picture
        ``(height, width, 4)`` bytes on a transparent ground.

    Examples
    --------
    >>> from spem.shapes.shape import Shape
    >>> picture_surface(Shape.from_mask(np.ones((3, 3, 3))), size=(32, 32)).shape
    (32, 32, 4)
    """
    rotation = principal_view(shape.points) if view is None else view_rotation(view)
    axis = int(np.abs(rotation[2]).argmax()) if cut == -1 else cut
    surface = shape_surface(shape, axis, toward=rotation[2])
    shown = None if values is None else surface_values(shape, surface, values)
    if values is not None and limits is None:
        limits = value_limits(values, symmetric=symmetric)
    return render_surface(
        surface.vertices,
        surface.faces,
        shown,
        view=rotation,
        size=size,
        cmap=MAP_CMAP if symmetric else FIELD_CMAP,
        limits=limits,
        unlit=None if values is None else surface.cut_faces,
    )


def draw_surface(
    shape: Shape,
    values: ArrayLike | None,
    ax: Axes,
    *,
    view: View | None = None,
    cut: int | None = None,
    symmetric: bool = False,
    limits: tuple[float, float] | None = None,
) -> AxesImage:
    """Draw a shaded shape on an axis; the arguments are those of `picture_surface`.

    Examples
    --------
    >>> from spem.plots.style import new_figure
    >>> from spem.shapes.shape import Shape
    >>> ax = new_figure(2, 2).add_subplot()
    >>> draw_surface(Shape.from_mask(np.ones((3, 3, 3))), None, ax).get_array().shape
    (480, 480, 4)
    """
    picture = picture_surface(
        shape, values, view=view, cut=cut, symmetric=symmetric, limits=limits, size=(480, 480)
    )
    bare(ax)
    return ax.imshow(picture, interpolation="antialiased")


def _open_level(
    shape: Shape, level: NDArray[np.float64], cut: int, toward: float
) -> tuple[NDArray[np.float64], NDArray[np.float64], int]:
    """Level of the half away from the viewer, the index of its first node, and that of the section."""
    if not 0 <= cut < 3:
        msg = f"{shape.name}: cut must be an axis, 0, 1 or 2, not {cut}"
        raise ParameterError(msg)
    section = int(np.median(np.unravel_index(shape.voxels, shape.mask.shape)[cut]))
    kept = slice(0, section + 1) if toward >= 0 else slice(section, None)
    pad = [(0, 0)] * 3
    pad[cut] = (0, 1) if toward >= 0 else (1, 0)
    first = np.zeros(3)
    first[cut] = 0 if toward >= 0 else section - 1
    half = level[(*(slice(None),) * cut, kept)]
    return np.pad(half, pad, constant_values=FAR_OUTSIDE), first, section


def _split_rim(
    index: NDArray[np.float64], faces: NDArray[np.int64], on_section: NDArray[np.bool_]
) -> tuple[NDArray[np.float64], NDArray[np.int64], NDArray[np.bool_]]:
    """Give the section vertices of its own, so that its rim is a sharp edge; tell which they are."""
    section = on_section[faces].all(axis=1)
    used, renumbered = np.unique(faces[section], return_inverse=True)
    faces = faces.copy()
    faces[section] = len(index) + renumbered.reshape(-1, 3)
    own = np.arange(len(index) + len(used)) >= len(index)
    return np.concatenate([index, index[used]]), faces, own
