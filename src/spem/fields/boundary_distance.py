"""The distance to the boundary, exactly and as the limit of the screened field for small ρ (3.2)."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial import cKDTree

from spem.errors import ParameterError, require_kind
from spem.fields.domain import surface_domain
from spem.fields.marching import spread
from spem.shapes.shape import Shape

# Cuts of opposite edges belong to two sides of a thin wall: this many voxels keep them apart.
_SIDES = 0.7
# A cut's plane is taken where it is met within this many voxels of the cut; cuts are about one apart.
_REACH = 1.5
# Cuts that lie farther than this, in voxels, off their plane are at an edge, where no plane is taken.
_FLAT = 0.1


def distance_to_boundary(shape: Shape) -> NDArray[np.float64]:
    """Return the Euclidean distance from the nodes to the surface, as the cuts have it.

    Through each cut goes a plane, fitted to the cuts around it. A node's distance is that to the plane of
    its nearest cut; or to the cut, where cuts lie round an edge or the plane is met farther off. Second
    order where the surface is smooth.

    Parameters
    ----------
    shape
        Any shape.

    Returns
    -------
    distance
        ``(n_nodes,)``, in the unit of the spacing.

    Raises
    ------
    ParameterError
        If there is no `Shape`.

    Examples
    --------
    >>> distance_to_boundary(Shape.from_mask(np.ones(5), spacing=2.0))
    array([1., 3., 5., 3., 1.])
    """
    require_kind(shape, Shape, "read it first: spem.read(...)")
    domain = surface_domain(shape)
    step = np.asarray(shape.spacing)
    points = shape.points
    node, direction = domain.boundary_edges
    outward = np.zeros((node.size, shape.ndim))
    outward[np.arange(node.size), direction // 2] = 2.0 * (direction % 2) - 1.0
    cuts = points[node] + outward * step * domain.fraction[:, None]
    beside = _beside(cuts, outward, float(step.max()))
    normal, off = _planes(cuts[beside], outward)
    foot = spread(points, domain.neighbours, node, cuts, beside)
    way = cuts[foot] - points
    squared = np.einsum("nd,nd->n", way, way)
    along = np.einsum("nd,nd->n", way, normal[foot])
    on_plane = (along > 0) & (squared - along**2 <= (_REACH * step.max()) ** 2)
    on_plane &= off[foot] < _FLAT * step.max()
    return np.asarray(np.where(on_plane, along, np.sqrt(squared)))


def screened_distance(v: ArrayLike, rho: float) -> NDArray[np.float64]:
    """Return −ρ log v, which tends to the distance to the boundary as ρ → 0 (3.2).

    It is d + (ρ/2) Σ log(1 − κ_i d) + O(ρ²) where one boundary point of principal curvatures κ_i, positive
    on a ball, is nearest by far; and less by ρ log 2 where two are. So it falls short by O(ρ), on the whole.
    A grid of spacing h resolves ρ of a few h and more: along an axis its field decays by
    2 arsinh(h/2ρ) an edge, a share of h²/24ρ² too slowly.

    Parameters
    ----------
    v
        A field; as solved by `Direct`, which is right in every entry however small.
    rho
        Its ρ.

    Returns
    -------
    distance
        As `v`, in the unit of ρ; infinite where v is 0, below the range of float64.

    Raises
    ------
    ParameterError
        If ρ is not positive and finite, or a value is negative or NaN.

    Examples
    --------
    >>> screened_distance(np.exp([0.0, -2.0, -4.0]), 0.5) + 0.0
    array([0., 1., 2.])
    """
    values = np.asarray(v, np.float64)
    if np.ndim(rho) or not 0 < rho < np.inf:
        msg = f"rho={rho!r}: a distance needs a positive, finite ρ"
        raise ParameterError(msg)
    if not (values >= 0).all():
        msg = "v must not be negative or NaN; solve with solver=spem.Direct(), right in every entry"
        raise ParameterError(msg)
    with np.errstate(divide="ignore"):
        return np.asarray(-rho * np.log(values))


def _beside(cuts: NDArray[np.float64], outward: NDArray[np.float64], step: float) -> NDArray[np.int64]:
    """Return the numbers ``(n_cuts, k)`` of each cut and of the nearest of its side of a wall."""
    count = min(4 * cuts.shape[1] - 3, len(cuts))  # the least that fits spheres well, of every dimension
    place = np.hstack([cuts / step, _SIDES * outward])
    _, near = cKDTree(place).query(place, count)
    return np.asarray(near.reshape(len(cuts), count))


def _planes(
    cuts: NDArray[np.float64], outward: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Fit planes to groups of cuts ``(n, k, d)``: unit outward normals, and root mean squares off them."""
    about_mean = cuts - cuts.mean(axis=1, keepdims=True)
    values, vectors = np.linalg.eigh(np.einsum("nki,nkj->nij", about_mean, about_mean))
    normal = vectors[:, :, 0]
    sign = np.where(np.einsum("nd,nd->n", normal, outward) < 0, -1.0, 1.0)
    off = np.sqrt(np.maximum(values[:, 0], 0.0) / cuts.shape[1])
    return sign[:, None] * normal, off
