"""One creature in several poses, with points of its body that correspond from pose to pose."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from spem.errors import ParameterError
from spem.shapes.capsules import Capsules
from spem.shapes.creatures import body_shape
from spem.shapes.poses import random_poses
from spem.shapes.shape import Shape
from spem.shapes.skeletons import mirror_axis


@dataclass(frozen=True, eq=False)
class CreaturePoses:
    """One creature in several poses.

    Parameters
    ----------
    shapes
        One shape a pose.
    points
        ``(n_poses, n_points, d)`` the same points of the body in all poses, inside every shape's body.
    mirror
        ``(n_points,)`` number of the point on the other side of the body; its own where a body, or a
        silhouette from the side, has no left and right.
    """

    shapes: tuple[Shape, ...]
    points: NDArray[np.float64]
    mirror: NDArray[np.int64]

    def __repr__(self) -> str:
        name = self.shapes[0].name.rpartition(" ")[0]
        n_points, ndim = self.points.shape[1:]
        return f"CreaturePoses({name!r}, {ndim}-D, {len(self.shapes)} poses, {n_points} points)"


def creature_poses(
    kind: str,
    n_poses: int,
    *,
    ndim: int = 2,
    voxels: int | None = None,
    n_points: int = 1000,
    rng: np.random.Generator,
) -> CreaturePoses:
    """Return one creature in random poses, with corresponding points.

    The points fill the body at rest evenly, in pairs that are mirror images where left and right bones are,
    and move with the bone in which they are deepest.

    Parameters
    ----------
    kind
        One of `spem.creatures.creature_kinds`.
    n_poses
        Number of poses.
    ndim
        2 for silhouettes, 3 for bodies.
    voxels
        Number of nodes of each shape, as for `spem.creatures.creature`.
    n_points
        Number of points, an even one.
    rng
        Source of chance.

    Raises
    ------
    ParameterError
        If there is no such kind or dimension, no pose is wanted, or the number of points is odd or below two.

    Examples
    --------
    >>> poses = creature_poses("fish", 2, voxels=900, n_points=50, rng=np.random.default_rng(0))
    >>> len(poses.shapes), poses.points.shape
    (2, (2, 50, 2))
    """
    if n_poses < 1 or n_points < 2 or n_points % 2:
        msg = f"n_poses={n_poses}, n_points={n_points}: expected a pose or more, and an even number of points"
        raise ParameterError(msg)
    rest, *poses = random_poses(kind, ndim, n_poses, rng)
    at_rest, mirror = _in_pairs(rest.body, _reflection(kind, ndim), n_points, rng)
    return CreaturePoses(
        tuple(body_shape(pose.body, voxels, name=f"{kind} {i}") for i, pose in enumerate(poses, 1)),
        np.stack([rest.carry(at_rest, pose) for pose in poses]),
        mirror,
    )


def _reflection(kind: str, ndim: int) -> NDArray[np.float64]:
    """Return what the mirror multiplies coordinates with; silhouettes from the side show no sides."""
    sign, axis = np.ones(3), mirror_axis(kind)
    if axis is not None:
        sign[axis] = -1
    return sign if ndim == 3 else sign[[1, 0]]


def _in_pairs(
    body: Capsules, sign: NDArray[np.float64], count: int, rng: np.random.Generator
) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Draw points and their mirror images, and number each one's image; without a mirror, points alone."""
    if (sign > 0).all():
        return _inside(body, sign, count, rng), np.arange(count)
    side = _inside(body, sign, count // 2, rng)
    half = np.arange(len(side))
    return np.concatenate([side, side * sign]), np.concatenate([half + half.size, half])


def _inside(
    body: Capsules, sign: NDArray[np.float64], count: int, rng: np.random.Generator
) -> NDArray[np.float64]:
    """Draw points evenly from the part of a body that its mirror image covers."""
    low, high = body.bounds()
    found = np.empty((0, low.size))
    while len(found) < count:
        drawn = rng.uniform(low, high, (4 * count, low.size))
        depth = np.minimum(body.level(drawn, 0.0), body.level(drawn * sign, 0.0))
        found = np.concatenate([found, drawn[depth > 0]])
    return found[:count]
