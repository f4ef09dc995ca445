"""What (2.1) leaves out: the expansion of a field in the curvature of its level curves, as ρ shrinks."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from spem.api.fields import field
from spem.fields.boundary_distance import distance_to_boundary, screened_distance
from spem.fields.gradients import gradient
from spem.fields.level_curves import level_curvature
from spem.fields.operator import assemble
from spem.fields.solvers.direct import Direct
from spem.shapes.creatures import creature
from spem.shapes.shape import Shape
from spem.shapes.synthetic import disk, implicit_shape

# Depths, as shares of the inner radius, that are clear of the boundary's cuts and of most of the skeleton.
BAND = (0.1, 0.4)


def smooth_shapes(radius: float) -> tuple[Shape, ...]:
    """Return a disk, an ellipse and a creature.

    Parameters
    ----------
    radius
        Inner radius of disk and ellipse in voxels; the creature has as many voxels as a square of four.

    Examples
    --------
    >>> [shape.name for shape in smooth_shapes(10)]
    ['disk', 'ellipse', 'creature']
    """
    half = np.array([1.5, 1.0])
    ellipse = implicit_shape(
        lambda x: 1 - np.linalg.norm(x / half, axis=1), -half, half, 1 / radius, name="ellipse"
    )
    voxels, rng = int((4 * radius) ** 2), np.random.default_rng(1)
    return disk(1.0, 1 / radius), ellipse, creature("dog", rng=rng, voxels=voxels, name="creature")


def left_out(shape: Shape, shares: Sequence[float]) -> NDArray[np.float64]:
    """Return the median share of v that ρ (1 + ρ/2 curv) ∂v/∂n, and ρ ∂v/∂n alone, miss (2.1).

    Along a normal v'' + curv v' = v/ρ² and so v = ρ v' (1 + ρ/2 curv + 3/8 ρ² curv² + …) on a disk: a share
    O(ρ²) of v is left out, and O(ρ) without the curvature. A ρ below five voxels or so is not resolved: the
    grid then makes v fall too slowly, by the share h²/24ρ².

    Parameters
    ----------
    shape
        Any shape.
    shares
        ``(n_rho,)`` ρ over the inner radius.

    Returns
    -------
    share
        ``(n_rho, 2)`` medians over the nodes of a band: with the term of curvature, and without.

    Examples
    --------
    >>> left_out(disk(1.0, 0.02), [0.2]).round(2)
    array([[0.04, 0.17]])
    """
    system, distance = assemble(shape), distance_to_boundary(shape)
    depth = distance / distance.max()
    band = (BAND[0] < depth) & (depth < BAND[1])
    rows = []
    for share in shares:
        rho = share * float(distance.max())
        u = screened_distance(field(shape, rho, solver=Direct()), rho)
        slope = np.linalg.norm(gradient(system, u, boundary=0.0), axis=1)[band]  # ρ |∇v| / v
        curvature = -level_curvature(system, u, boundary=0.0)[band]  # u falls where v grows
        with np.errstate(divide="ignore"):
            rest = 1 / slope - 1
        both = np.stack([rest - rho / 2 * curvature, rest])
        rows.append(np.nanmedian(np.abs(both), axis=1))
    return np.array(rows)
