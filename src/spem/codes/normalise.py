"""From maps to node features: one unit for all shapes, then weights or whitening learnt from nodes (5.5)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal, Self

import numpy as np
from numpy.typing import NDArray

from spem.errors import ParameterError

Scaling = Literal["standard", "whiten", "deviation", "none"]
# Directions in which the nodes vary less than this part of the largest variance are not blown up
# further: what is left there is the error of the solver.
_LEAST_VARIANCE = 1e-6


@dataclass(frozen=True, eq=False)
class Normalisation:
    """An affine map from unit-rms projections to node features, learnt from training nodes.

    Parameters
    ----------
    mean
        ``(n_maps,)`` what is subtracted from the unit-rms projections.
    transform
        ``(n_maps, n_maps)`` what the rest is multiplied with.

    Examples
    --------
    >>> Normalisation.none(2).apply(np.array([[3.0, 0.0], [3.0, 2.0]])).round(3)
    array([[1.   , 0.   ],
           [1.   , 1.414]])
    """

    mean: NDArray[np.float64]
    transform: NDArray[np.float64]

    @classmethod
    def none(cls, n_maps: int) -> Self:
        """Leave every projection at unit rms."""
        return cls(np.zeros(n_maps), np.eye(n_maps))

    @classmethod
    def by_deviation(cls, samples: Sequence[NDArray[np.floating]]) -> Self:
        """Weight each projection by the deviation of its index, as 5.5 does.

        `samples` holds the projections of training nodes as they are: see `relative_deviations`.
        """
        weights = relative_deviations(samples)
        return cls(np.zeros(weights.size), np.diag(weights))

    @classmethod
    def standard(cls, samples: Sequence[NDArray[np.floating]]) -> Self:
        """Bring each projection to mean zero and deviation one over the training nodes.

        Every projection then weighs the same in the assignment to words, however little of the
        field's variance it has: the weak ones tell shapes apart. `samples` holds unit-rms
        projections of training nodes.
        """
        nodes = np.concatenate(samples).astype(np.float64)
        variance = nodes.var(axis=0)
        if not variance.max() > 0:
            raise ParameterError(_constant(nodes))
        variance = np.maximum(variance, _LEAST_VARIANCE * variance.max())
        return cls(nodes.mean(axis=0), np.diag(1 / np.sqrt(variance)))

    @classmethod
    def whitening(cls, samples: Sequence[NDArray[np.floating]]) -> Self:
        """Rotate to the principal axes of the training nodes and divide by the deviation along each.

        Projections at unit rms are nearly the same function where the fields are flat; what tells
        shapes apart is in the axes of little variance, and this lets them count. `samples` holds
        unit-rms projections of training nodes.
        """
        nodes = np.concatenate(samples).astype(np.float64)
        variance, axes = np.linalg.eigh(np.atleast_2d(np.cov(nodes, rowvar=False, bias=True)))
        if not variance[-1] > 0:
            raise ParameterError(_constant(nodes))
        variance = np.maximum(variance[::-1], _LEAST_VARIANCE * variance[-1])
        return cls(nodes.mean(axis=0), axes[:, ::-1] / np.sqrt(variance))

    def apply(self, maps: NDArray[np.floating]) -> NDArray[np.floating]:
        """Return the node features ``(n_nodes, n_maps)`` of one shape, in the precision of its maps."""
        unit = unit_rms(maps)
        unit -= self.mean.astype(unit.dtype)
        return np.asarray(unit @ self.transform.astype(unit.dtype))


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


def peak_share(maps: NDArray[np.floating]) -> NDArray[np.float64]:
    """Return the first projection of each node over its largest magnitude on the shape.

    The first SPEM map is nearly the mean field: its share runs from 1 at the boundary down to the deepest
    nodes, whatever the unit of the maps.

    Parameters
    ----------
    maps
        ``(n_nodes, n_maps)`` projections of one shape.

    Returns
    -------
    NDArray
        ``(n_nodes,)`` shares, at most 1; zero where the projection is zero everywhere.

    Examples
    --------
    >>> peak_share(np.array([[4.0, 0.0], [1.0, 7.0]]))
    array([1.  , 0.25])
    """
    first = np.asarray(maps[:, 0], np.float64)
    peak = np.abs(first).max()
    return np.asarray(first / peak if peak > 0 else first)


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
        raise ParameterError(_constant(nodes))
    return np.asarray(deviations / length)


def _constant(nodes: NDArray[np.floating]) -> str:
    """Return the message for training nodes that are all the same."""
    return f"no projection varies over the {len(nodes)} training nodes; give shapes with several nodes"
