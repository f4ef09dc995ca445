"""WESD: the weighted spectral distance between the Dirichlet spectra of solids."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.distance import cdist

from spem.errors import ParameterError
from spem.rivals.solid_spectrum import VOXELS, dirichlet_values
from spem.shapes.shape import Shape

Array = NDArray[np.float64]


@dataclass(frozen=True)
class WESD:
    """Distance ρ = (Σ_n (|λ_n − μ_n| / (λ_n μ_n))^p)^(1/p) between the spectra λ and μ of two solids.

    The publication: E. Konukoglu, B. Glocker, A. Criminisi, K. M. Pohl, "WESD - weighted spectral distance
    for measuring shape dissimilarity", IEEE Trans. Pattern Anal. Mach. Intell. 35 (2013) 2284-2297. The sum
    over all values converges for p > d/2. Since |λ − μ| / (λμ) = |1/λ − 1/μ|, it is the p-norm of the
    difference of the reciprocals. Size is taken out as the publication does, by unit volume.

    Deviations: the spectrum is solved on the voxels of the shape with the surface where it cuts them, second
    order in the spacing, in place of the staircase of a label map.

    Time: 0.35 s a solid of 5,000 voxels on one core.

    Parameters
    ----------
    p
        Exponent, above d/2.
    n_values
        Number of values. From 20 to 50 of them, and from p = 1.5 to 3, first tiers on SHREC'11 are the same
        within half a point.
    voxels
        A solid of more voxels is resampled to about as many.

    Examples
    --------
    >>> from spem.shapes.synthetic import ball, box
    >>> rival = WESD(n_values=10)
    >>> shapes = [ball(1.0, 0.2), ball(3.0, 0.6), box((4.0, 1.0, 1.0), 0.2)]
    >>> rival.compare([rival.describe(shape) for shape in shapes])[0].round(4).tolist()
    [0.0, 0.0, 0.0172]
    """

    p: float = 2.0
    n_values: int = 50
    voxels: int = VOXELS

    @property
    def name(self) -> str:
        """Name in tables."""
        return "WESD"

    def describe(self, shape: Shape) -> Array:
        """Compute the reciprocals of the lowest eigenvalues of the solid of unit volume, zero on its surface.

        Parameters
        ----------
        shape
            Of any dimension.

        Returns
        -------
        numpy.ndarray
            ``(n_values,)`` descending.

        Raises
        ------
        ParameterError
            When the shape has fewer nodes than values, or the exponent is too small for its dimension.
        """
        if not self.p > shape.ndim / 2:
            least = shape.ndim / 2
            msg = f"{shape.name}: p={self.p!r}: expected more than {least:g} in {shape.ndim} dimensions"
            raise ParameterError(msg)
        return 1 / dirichlet_values(shape, self.n_values, self.voxels)

    def compare(self, descriptions: Sequence[Any]) -> Array:
        """Compute the weighted spectral distances, ``(n_shapes, n_shapes)``."""
        reciprocals = np.stack(descriptions)
        return np.asarray(cdist(reciprocals, reciprocals, "minkowski", p=self.p))
