"""Where in a shape each row of its features lies: nodes, points of a surface, points or arcs of a contour."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from spem.codes.contour_features import N_POINTS as CONTOUR_POINTS
from spem.codes.features import kept_nodes
from spem.codes.settings import Settings
from spem.codes.source_features import contour_arcs
from spem.codes.surface_features import MOST_VERTICES
from spem.codes.surface_features import N_POINTS as SURFACE_POINTS
from spem.embedding.contours import contour_points
from spem.shapes.boundary_surface import boundary_surface
from spem.shapes.remeshing import decimate, subdivide
from spem.shapes.shape import Shape
from spem.shapes.surface_points import spread_points

Array = NDArray[np.float64]


def feature_positions(shape: Shape, settings: Settings) -> Array:
    """Return where the rows of features lie.

    Parameters
    ----------
    shape
        The shape.
    settings
        Settings of one kind of features, as `Settings.parts` returns them.

    Returns
    -------
    numpy.ndarray
        ``(n_rows, d)`` coordinates, in the shape's own, of the rows of each band that
        `spem.codes.kinds.shape_features` computes of that kind; a row and its mirror image lie at one place.

    Raises
    ------
    ShapeError
        When shapes of this dimension have no such features.

    Examples
    --------
    >>> from spem.shapes.synthetic import disk
    >>> shape = disk(radius=10.0, spacing=1.0)
    >>> kinds = Settings(features="spem+shape-context").parts(2)
    >>> [len(feature_positions(shape, kind)) for kind in kinds], shape.n_nodes
    ([305, 256], 305)
    """
    return _POSITIONS[settings.features](shape, settings)


def _nodes(shape: Shape, settings: Settings) -> Array:
    """Return the nodes, or those off the boundary."""
    return np.asarray(shape.points[kept_nodes(shape, drop_boundary=settings.drop_boundary)])


def _surface(shape: Shape, settings: Settings) -> Array:
    """Return the points spread over the surface that the spectrum is of."""
    surface = subdivide(decimate(boundary_surface(shape), MOST_VERTICES), settings.n_pairs)
    return spread_points(surface, SURFACE_POINTS).interpolate(surface.vertices)


def _contour(shape: Shape, settings: Settings) -> Array:
    """Return the points along the contours, twice."""
    return np.tile(contour_points(shape, CONTOUR_POINTS, boundary=settings.boundary).position, (2, 1))


def _arcs(shape: Shape, settings: Settings) -> Array:
    """Return the middles of the arcs of the longest contour, twice."""
    return np.tile(contour_arcs(shape, settings).position, (2, 1))


_POSITIONS: Mapping[str, Callable[[Shape, Settings], Array]] = MappingProxyType(
    {
        **dict.fromkeys(("spem", "hks", "si-hks", "wks"), _nodes),
        **dict.fromkeys(("surface-hks", "surface-si-hks", "surface-wks"), _surface),
        "sources": _arcs,
        **dict.fromkeys(("shape-context", "inner-distance"), _contour),
    }
)
