"""The lowest eigenvalues of a solid of unit volume, zero on its surface: what two rivals are made of."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from spem.fields.solvers.lanczos import BlockLanczos
from spem.fields.spectrum import solve_spectrum
from spem.shapes.rescale import to_voxel_budget
from spem.shapes.shape import Shape

# Voxels of a solid: the surface lies where it cuts their edges, and first tiers do not change with more.
VOXELS = 5000
# Values are right to the square of this.
_RTOL = 1e-3


def dirichlet_values(shape: Shape, n_values: int, voxels: int = VOXELS) -> NDArray[np.float64]:
    """Compute the lowest eigenvalues of −Δ that are zero on the surface, at unit volume.

    Parameters
    ----------
    shape
        Of any dimension.
    n_values
        How many.
    voxels
        A shape of more voxels is resampled to about as many.

    Returns
    -------
    numpy.ndarray
        ``(n_values,)`` ascending, times volume^(2/d).

    Raises
    ------
    ParameterError
        When the shape has fewer nodes than values.

    Examples
    --------
    >>> from spem.shapes.synthetic import interval
    >>> (dirichlet_values(interval(3.0, 0.01), 2) / np.pi**2).round(3)
    array([1., 4.])
    """
    coarse = to_voxel_budget(shape, voxels) if shape.n_nodes > voxels else shape
    solver = BlockLanczos(rtol=_RTOL)
    values = solve_spectrum(coarse, n_values, boundary="absorbing", solver=solver).values
    return np.asarray(values * coarse.size**2)
