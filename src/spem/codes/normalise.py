"""The intensities of the projections: one unit for all shapes, one weight for each projection (5.5)."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from spem.errors import ParameterError


def unit_rms(maps: NDArray[np.floating]) -> NDArray[np.floating]:
    """Scale each projection to root-mean-square one over its shape.

    This is the unit L2 norm of 5.5 times √n_nodes, so that a node of a shape sampled with more
    voxels keeps its values. A projection that is zero everywhere stays zero.

    Parameters
    ----------
    maps
        ``(n_nodes, n_maps)`` projections of one shape; float32 stays float32.

    Returns
    -------
    NDArray
        ``(n_nodes, n_maps)`` scaled projections.

    Examples
    --------
    >>> unit_rms(np.array([[3.0, 0.0], [4.0, 0.0], [0.0, 0.0], [0.0, 0.0]]))
    array([[1.2, 0. ],
           [1.6, 0. ],
           [0. , 0. ],
           [0. , 0. ]])
    """
    values = np.asarray(maps)
    # Divided by the peak first: squares of tiny or huge projections neither vanish nor overflow.
    peak = np.abs(values).max(axis=0).astype(np.float64)
    unit = values / np.where(peak > 0, peak, 1).astype(values.dtype)
    rms = np.sqrt(np.einsum("ij,ij->j", unit, unit, dtype=np.float64) / len(values))
    unit /= np.where(rms > 0, rms, 1).astype(unit.dtype)
    return np.asarray(unit)


def relative_deviations(samples: Sequence[NDArray[np.floating]]) -> NDArray[np.float64]:
    """Learn the weight of each projection index from the training nodes.

    The standard deviation of projection j over the nodes of all samples together, taken before
    any normalisation, divided by the root of the sum of squares over j. A common factor on all
    projections (the unit of the field, the number of ρ) changes nothing, nor does the number of
    nodes; with these weights on `unit_rms` maps, the mean square length of a node is one.

    Parameters
    ----------
    samples
        For each training shape the ``(n_nodes, n_maps)`` projections of a sample of its nodes.

    Returns
    -------
    NDArray
        ``(n_maps,)`` weights of unit L2 norm.

    Raises
    ------
    ParameterError
        When no projection varies at all.

    Examples
    --------
    >>> relative_deviations([np.array([[0.0, 1.0]]), np.array([[6.0, 9.0]])])
    array([0.6, 0.8])
    """
    nodes = np.concatenate(samples).astype(np.float64)
    deviations = nodes.std(axis=0)
    length = float(np.linalg.norm(deviations))
    if not length > 0:
        msg = f"no projection varies over the {len(nodes)} training nodes; give shapes with several nodes"
        raise ParameterError(msg)
    return np.asarray(deviations / length)
