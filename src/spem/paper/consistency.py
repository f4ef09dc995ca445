"""How alike the maps of several shapes are, measured without a correspondence between their nodes."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from spem.embedding.maps import Maps
from spem.paper.findings import Claim, judged
from spem.plots.figures import map_name
from spem.shapes.distance import signed_distance
from spem.shapes.shape import Shape

# The paper samples ρ from 2 to 30 pixels of shapes of an inner radius of 20.
PAPER_RHO = np.linspace(2.0, 30.0, 64)
PAPER_RADIUS = 20.0
# Components down to 1e-9 of the strongest take a sweep of this tolerance.
RTOL = 1e-10
_LEVELS = np.linspace(0.01, 0.99, 99)


def paper_rho(shape: Shape) -> NDArray[np.float64]:
    """Return the paper's ρ for a shape of any size: 2 to 30 twentieths of its inner radius.

    Examples
    --------
    >>> rho = paper_rho(Shape.from_mask(np.ones((41, 41))))
    >>> print(round(rho[0], 2), round(rho[-1], 2))
    2.05 30.75
    """
    return PAPER_RHO * (float(signed_distance(shape).max()) / PAPER_RADIUS)


def quantiles(several: Sequence[Maps]) -> NDArray[np.float64]:
    """Return the quantile functions of maps: ``(n_shapes, n_levels, n_maps)`` values.

    Examples
    --------
    >>> from types import SimpleNamespace
    >>> quantiles([SimpleNamespace(values=np.linspace(0, 1, 101)[:, None])])[0, :3, 0].round(2).tolist()
    [0.01, 0.02, 0.03]
    """
    return np.array([np.quantile(maps.values, _LEVELS, axis=0) for maps in several])


def distribution_distances(several: Sequence[Maps]) -> NDArray[np.float64]:
    """Return how far the distributions of each map are apart, for every two shapes.

    That is the mean difference of their quantile functions (the first Wasserstein distance) in units of the
    standard deviation of the map, averaged over the shapes.

    Parameters
    ----------
    several
        Maps of shapes, as many of each.

    Returns
    -------
    distances
        ``(n_shapes, n_shapes, n_maps)``.

    Examples
    --------
    >>> from types import SimpleNamespace
    >>> values = np.linspace(-1, 1, 101)[:, None]
    >>> shifted = distribution_distances([SimpleNamespace(values=values), SimpleNamespace(values=values + 1)])
    >>> round(float(shifted[0, 1, 0] * values.std()), 6)
    1.0
    """
    curves = quantiles(several)
    spread = np.mean([maps.values.std(axis=0) for maps in several], axis=0)
    return np.asarray(np.abs(curves[:, None] - curves[None]).mean(axis=2) / spread)


def basis_cosines(several: Sequence[Maps]) -> NDArray[np.float64]:
    """Return the cosines between corresponding basis vectors of every two shapes.

    Returns
    -------
    cosines
        ``(n_shapes, n_shapes, n_maps)``, not negative: the sign of a basis vector is free.

    Examples
    --------
    >>> from types import SimpleNamespace
    >>> basis_cosines([SimpleNamespace(basis=np.eye(2)), SimpleNamespace(basis=-np.eye(2))])[0, 1].tolist()
    [1.0, 1.0]
    """
    bases = np.array([maps.basis for maps in several])
    return np.asarray(np.clip(np.abs(np.einsum("irn,jrn->ijn", bases, bases)), 0.0, 1.0))


def largest_subspace_angle(several: Sequence[Maps]) -> float:
    """Return the largest principal angle, in degrees, between the spaces that the bases of two shapes span.

    Examples
    --------
    >>> from types import SimpleNamespace
    >>> turned = [SimpleNamespace(basis=np.eye(3)[:, :2]), SimpleNamespace(basis=np.eye(3)[:, 1:])]
    >>> round(largest_subspace_angle(turned))
    90
    """
    bases = [maps.basis for maps in several]
    least = min(
        float(np.linalg.svd(a.T @ b, compute_uv=False).min()) for i, a in enumerate(bases) for b in bases[:i]
    )
    return float(np.degrees(np.arccos(np.clip(least, 0.0, 1.0))))


def pairs(values: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the entries of every two different shapes: ``(n_pairs, ...)`` of ``(n_shapes, n_shapes, ...)``.

    Examples
    --------
    >>> pairs(np.arange(9.0).reshape(3, 3)).tolist()
    [1.0, 2.0, 5.0]
    """
    return np.asarray(values[np.triu_indices(len(values), 1)])


def judge_poses(statement: str, distances: NDArray[np.float64], n_poses: int, others: str) -> Claim:
    """Judge whether every map is nearer between poses of one kind than between that kind and others.

    Parameters
    ----------
    statement
        What the paper claims.
    distances
        ``(n_shapes, n_shapes, n_maps)`` from `distribution_distances`; the poses come first.
    n_poses
        Number of poses.
    others
        What the other shapes are.

    Examples
    --------
    >>> distances = np.array([[0, 1, 3], [1, 0, 3], [3, 3, 0]], float)[..., None]
    >>> judge_poses("Poses are alike.", distances, 2, "hands").ours
    'distance of distributions between poses against that to hands, in standard deviations: P₁ 1.000 (3.000)'
    """
    near = pairs(distances[:n_poses, :n_poses]).mean(axis=0)
    far = distances[:n_poses, n_poses:].mean(axis=(0, 1))
    each = [f"{map_name(j)} {a:.3f} ({b:.3f})" for j, (a, b) in enumerate(zip(near, far, strict=True))]
    worse = [map_name(j) for j in range(len(near)) if near[j] >= far[j]]
    return judged(
        statement,
        "consistent, as seen",
        f"distance of distributions between poses against that to {others}, in standard deviations: "
        + ", ".join(each),
        not worse,
        note=f"{', '.join(worse)} differs between poses as much as between kinds.",
    )
