"""iHKS: heat kernel signatures of the boundary carried inside, as a bag of features."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import igl
import numpy as np
from numpy.typing import NDArray
from scipy.spatial.distance import cdist
from sklearn.cluster import KMeans

from spem.errors import ParameterError, ShapeError
from spem.fields.surface_spectrum import solve_surface_spectrum
from spem.rivals.mean_value import carry_inside
from spem.shapes.boundary_surface import boundary_surface
from spem.shapes.shape import Shape
from spem.shapes.surface import Surface

Array = NDArray[np.float64]
# Of a surface of unit area; the first value of the sphere is 25, and those of long shapes are smaller.
_LOWEST = 5.0
# A surface with holes turns once around a point inside but for the holes.
_WITHIN = 0.5
# Points that the vocabulary is learnt of, and the seed of their choice and of the k-means.
_TRAINING, _SEED = 20_000, 0


@dataclass(frozen=True)
class IHKS:
    """Interior heat kernel signatures h_t(x) = Σ_k exp(−λ_k t) φ_k(x)², gathered as a bag of features.

    The publication: R. M. Rustamov, "Interpolated eigenfunctions for volumetric shape processing", The Visual
    Computer 27 (2011) 951-961. λ_k and φ_k are eigenvalues and eigenfunctions of the boundary surface; φ_k is
    carried inside by mean value coordinates. The bag of features is that of A. M. Bronstein, M. M. Bronstein,
    L. J. Guibas, M. Ovsjanikov, "Shape Google", ACM Trans. Graph. 30 (2011): 48 words, soft assignment with σ
    of twice the median distance of a point to its word, the mean over the points, L1 distance.

    Deviations: the surface is scaled to unit area, and times are the same for all shapes, spread
    logarithmically from that at which heat of the last eigenvalue is spent (4 ln 10 / λ with Weyl's estimate
    λ = 4π n) to that of a value of 5. Each time is divided by its standard deviation over all points, lest
    the short ones alone count; that is worth a point of first tier on SHREC'11, soft assignment three, and a
    thousand points in place of 333 one. Numbers of eigenpairs, times and points are ours: what the
    publication took is not known.

    Time: 0.11 s a mesh of 250 vertices on one core, 3 s one of 8,400, and 0.5 s to compare 600 shapes.

    Parameters
    ----------
    n_pairs
        Number of eigenpairs, the constant one among them.
    n_times
        Number of times t.
    samples
        Number of interior points, evenly spread over the numbers of the nodes; all nodes where there are
        fewer. Nodes outside the surface, in another component, are left out.
    n_words
        Size of the vocabulary.
    softness
        σ of the soft assignment, in median distances of a point to its word; 0 assigns to the nearest alone.
    standardised
        Divide each time by its standard deviation.

    Examples
    --------
    >>> from spem.shapes.synthetic import ball, box
    >>> rival = IHKS(n_pairs=20, n_words=4, samples=50)
    >>> shapes = [ball(1.0, 0.2), ball(2.0, 0.4), box((4.0, 1.0, 1.0), 0.2)]
    >>> distances = rival.compare([rival.describe(shape) for shape in shapes])
    >>> bool(distances[0, 1] < 1e-6 < distances[0, 2])
    True
    """

    n_pairs: int = 100
    n_times: int = 12
    samples: int = 1000
    n_words: int = 48
    softness: float = 2.0
    standardised: bool = True

    def __post_init__(self) -> None:
        least = {"n_pairs": 2, "n_times": 1, "samples": 1, "n_words": 1, "softness": 0}
        for parameter, bound in least.items():
            if getattr(self, parameter) < bound:
                msg = f"{parameter}={getattr(self, parameter)}: expected at least {bound}"
                raise ParameterError(msg)

    @property
    def name(self) -> str:
        """Name in tables."""
        return "iHKS"

    @property
    def times(self) -> Array:
        """``(n_times,)`` times t, for a surface of unit area."""
        spent = 4 * math.log(10)
        return np.geomspace(spent / (4 * math.pi * self.n_pairs), spent / _LOWEST, self.n_times)

    def describe(self, shape: Shape) -> NDArray[np.float32]:
        """Compute the interior heat kernel signatures of points spread over the solid.

        Parameters
        ----------
        shape
            A shape of three dimensions.

        Returns
        -------
        numpy.ndarray
            ``(n_points, n_times)``, without a unit.

        Raises
        ------
        ShapeError
            When the shape has no boundary surface, or none of its points lies within it.
        """
        boundary = boundary_surface(shape)
        scale = boundary.area**-0.5
        unit = Surface(boundary.vertices * scale, boundary.faces)
        spectrum = solve_surface_spectrum(unit, self.n_pairs, name=shape.name)
        points = self._points(shape, boundary) * scale
        inside = carry_inside(spectrum.surface, spectrum.vectors, points)
        heat = np.square(inside) @ np.exp(-np.outer(spectrum.values, self.times))
        return np.asarray(heat, np.float32)

    def _points(self, shape: Shape, boundary: Surface) -> Array:
        """Return nodes spread over the solid; of several components those in the one with the surface."""
        chosen = np.linspace(0, shape.n_nodes - 1, min(self.samples, shape.n_nodes)).round().astype(np.int64)
        points = shape.points[chosen]
        within = igl.fast_winding_number(boundary.vertices, boundary.faces, points) > _WITHIN
        if not within.any():
            msg = f"{shape.name}: none of {chosen.size} nodes lies within its boundary surface; mend the mesh"
            raise ShapeError(msg)
        return np.asarray(points[within])

    def compare(self, descriptions: Sequence[Any]) -> Array:
        """Compute the L1 distances between the shares of words in the shapes.

        Parameters
        ----------
        descriptions
            Signatures of each shape; the vocabulary is learnt of them.

        Returns
        -------
        numpy.ndarray
            ``(n_shapes, n_shapes)`` in [0, 2].

        Raises
        ------
        ParameterError
            When all shapes together have fewer points than words.
        """
        points = np.concatenate(descriptions).astype(np.float64)
        if len(points) < self.n_words:
            msg = (
                f"n_words={self.n_words}: expected at most {len(points)}, the number of points of all shapes"
            )
            raise ParameterError(msg)
        spread = _deviations(points) if self.standardised else 1.0
        rng = np.random.default_rng(_SEED)
        training = points[rng.permutation(len(points))[:_TRAINING]] / spread
        words = KMeans(self.n_words, n_init=1, random_state=_SEED).fit(training).cluster_centers_
        width = self.softness * float(np.median(cdist(training, words).min(axis=1)))
        shares = np.stack([_shares(each / spread, words, width) for each in descriptions])
        return np.asarray(cdist(shares, shares, "cityblock"))


def _deviations(points: Array) -> Array:
    """Return standard deviations to divide by: 1 of what is constant to the rounding of float32."""
    found = points.std(axis=0)
    varied = found > np.finfo(np.float32).eps * np.abs(points.mean(axis=0))
    return np.asarray(np.where(varied, found, 1.0))


def _shares(points: Array, words: Array, width: float) -> Array:
    """Return how much of each word the points of a shape have, in the mean; of width 0 the nearest alone."""
    squared = cdist(points, words, "sqeuclidean")
    squared -= squared.min(axis=1, keepdims=True)
    weights = np.exp(-squared / (2 * max(width, 1e-9) ** 2))
    return np.asarray((weights / weights.sum(axis=1, keepdims=True)).mean(axis=0))
