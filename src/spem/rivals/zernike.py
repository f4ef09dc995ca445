"""Zernike moments of silhouettes, by mahotas."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spem.errors import ParameterError
from spem.rivals.extra import require
from spem.rivals.plane import euclidean_distances, require_silhouette
from spem.shapes.shape import Shape


@dataclass(frozen=True)
class Zernike:
    """Magnitudes of the Zernike moments in the circle about the centroid that encloses the silhouette.

    Khotanzad, Hong, "Invariant image recognition by Zernike moments", PAMI 12 (1990), 489-497; moments by
    mahotas. They are invariant to turns and reflections; the circle makes them so to place and size. The
    distance is the Euclidean one.

    Deviations: the circle has the radius of the farthest pixel, not that which gives all shapes one area,
    so that no pixel is left out. The moment of order 0 is that of the scale and falls out. Time: 4 ms a
    silhouette of 1,700 pixels.

    Parameters
    ----------
    degree
        Highest order; 12 is where Khotanzad and Hong stop.
    standardised
        Whether each moment is standardised over the collection.

    Examples
    --------
    >>> from spem.rivals.extra import has
    >>> from spem.shapes.synthetic import disk
    >>> not has("mahotas") or Zernike(4).describe(disk(8.0, 1.0)).shape == (8,)
    True
    """

    degree: int = 12
    standardised: bool = False

    def __post_init__(self) -> None:
        if self.degree < 1:
            msg = f"degree={self.degree}: expected at least 1"
            raise ParameterError(msg)

    @property
    def name(self) -> str:
        """Name in tables."""
        return "Zernike moments"

    def describe(self, shape: Shape) -> NDArray[np.float64]:
        """Return the magnitudes of the moments of orders from 1 on.

        Raises
        ------
        ShapeError
            When the shape is no silhouette on square pixels.
        MissingExtraError
            When mahotas is not installed.
        """
        require_silhouette(shape, "Zernike moments")
        features = require("mahotas.features", "mahotas")
        pixels = np.argwhere(shape.mask)
        centre = pixels.mean(axis=0)
        radius = float(np.linalg.norm(pixels - centre, axis=1).max()) + 0.5
        image = shape.mask.astype(np.uint8)
        moments = features.zernike_moments(image, radius, degree=self.degree, cm=tuple(centre))
        return np.asarray(moments, np.float64)[1:]

    def compare(self, descriptions: Sequence[Any]) -> NDArray[np.float64]:
        """Return ``(n_shapes, n_shapes)`` distances."""
        return euclidean_distances(np.asarray(descriptions, np.float64), standardised=self.standardised)
