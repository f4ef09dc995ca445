"""Hu's seven moments of silhouettes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spem.codes.moments import Compression, hu_moments
from spem.rivals.plane import euclidean_distances
from spem.shapes.shape import Shape


@dataclass(frozen=True)
class Hu:
    """Seven moments that do not change with place, size and turn, compared by their inverse hyperbolic sines.

    Hu, "Visual pattern recognition by moment invariants", IRE Transactions on Information Theory 8 (1962),
    179-187. The distance is the Euclidean one of the moments, each standardised over the collection.

    Deviations: Hu compares two moments of characters as they are; all seven span ten orders of magnitude, and
    later users take logarithms. Those jump where a moment changes its sign: on the 1000-shape database they
    have 39.9 for bull's eye, the inverse hyperbolic sine 49.6. Time: 0.2 ms a silhouette of 1,700 pixels.

    Parameters
    ----------
    compression
        What is made of the moments: see `spem.codes.moments.hu_moments`.
    standardised
        Whether each moment is standardised over the collection.

    Examples
    --------
    >>> from spem.shapes.synthetic import box, disk
    >>> rival = Hu()
    >>> round_and_long = [rival.describe(s) for s in (disk(8.0, 1.0), disk(9.0, 1.0), box((40.0, 8.0), 1.0))]
    >>> distance = rival.compare(round_and_long)
    >>> bool(distance[0, 1] < distance[0, 2])
    True
    """

    compression: Compression = "arsinh"
    standardised: bool = True

    @property
    def name(self) -> str:
        """Name in tables."""
        return "Hu moments"

    def describe(self, shape: Shape) -> NDArray[np.float64]:
        """Return the ``(7,)`` moments of a silhouette.

        Raises
        ------
        ShapeError
            When the shape is not of two dimensions.
        """
        return hu_moments(shape, compression=self.compression)

    def compare(self, descriptions: Sequence[Any]) -> NDArray[np.float64]:
        """Return ``(n_shapes, n_shapes)`` distances."""
        return euclidean_distances(np.asarray(descriptions, np.float64), standardised=self.standardised)
