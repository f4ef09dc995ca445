"""Random poses of articulated creatures, and points that move with their bones."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from spem.errors import ParameterError, require_kind
from spem.shapes.capsules import Capsules
from spem.shapes.skeletons import Skeleton, skeleton

# Standard deviation, in logarithms, of lengths and radii within a class.
LENGTH_JITTER = 0.05
RADIUS_JITTER = 0.035
# Balls along each bone by which overlap is measured, poses tried, and the gap asked for between
# parts that do not touch at rest.
BALLS = 4
TRIES = 8
CLEARANCE = 0.03


@dataclass(frozen=True, eq=False)
class Pose:
    """A body and how its bones are turned.

    Parameters
    ----------
    body
        One capsule a bone.
    frame
        ``(n, d, d)`` rotation of each bone from a frame that is the same in all poses.
    """

    body: Capsules
    frame: NDArray[np.float64]

    def carry(self, points: NDArray[np.float64], to: Pose) -> NDArray[np.float64]:
        """Carry points ``(m, d)`` into another pose of the same build, each with the bone it is deepest in.

        A point inside the body stays inside, at the same depth in the same capsule.

        Examples
        --------
        >>> rest, bent = random_poses("fish", 2, 1, np.random.default_rng(0))
        >>> start = rest.body.start
        >>> bool(np.allclose(rest.carry(start[:1], bent), bent.body.start[:1]))
        True
        """
        bone = self.body.deepest(points)
        local = np.einsum("mij,mi->mj", self.frame[bone], points - self.body.start[bone])
        return np.asarray(to.body.start[bone] + np.einsum("mij,mj->mi", to.frame[bone], local))


def random_pose(kind: str, ndim: int, rng: np.random.Generator) -> Capsules:
    """Return a kind's body in a random pose, of a random build.

    Of several poses the one is taken whose parts overlap least, beyond their overlap at rest.

    Parameters
    ----------
    kind
        One of `skeleton_kinds`.
    ndim
        2 for the silhouette, in (row, column), or 3 for the body, in (x, y, z).
    rng
        Source of chance.

    Returns
    -------
    Capsules
        One a bone, of dimension `ndim`.

    Raises
    ------
    ParameterError
        If there is no such kind, or `ndim` is neither 2 nor 3.

    Examples
    --------
    >>> random_pose("ant", 2, np.random.default_rng(0)).start.shape
    (23, 2)
    """
    return random_poses(kind, ndim, 1, rng)[1].body


def random_poses(kind: str, ndim: int, count: int, rng: np.random.Generator) -> list[Pose]:
    """Return a kind's body of one random build, at rest and in random poses.

    Parameters
    ----------
    kind
        One of `skeleton_kinds`.
    ndim
        2 for the silhouette, in (row, column), or 3 for the body, in (x, y, z).
    count
        Number of random poses.
    rng
        Source of chance; the first of them is the `random_pose` of the same state.

    Returns
    -------
    list of Pose
        ``count + 1`` poses, the first at rest: in the middle of the range of every joint.

    Raises
    ------
    ParameterError
        If there is no such kind, or `ndim` is neither 2 nor 3.

    Examples
    --------
    >>> len(random_poses("ant", 2, 3, np.random.default_rng(0)))
    4
    """
    if ndim not in (2, 3):
        msg = f"creatures live in 2 or 3 dimensions, not {ndim}"
        raise ParameterError(msg)
    require_kind(rng, np.random.Generator, "make one: numpy.random.default_rng(seed)")
    bones = skeleton(kind)
    n_parts = bones.part.max() + 1
    length = bones.length * np.exp(LENGTH_JITTER * _bounded_normal(rng, n_parts))[bones.part]
    radius = bones.radius * np.exp(RADIUS_JITTER * _bounded_normal(rng, n_parts))[bones.part, None]
    middle = bones.bend.mean(axis=1)
    rest = _placed(bones, length, radius, middle, 0 * middle, ndim)
    return [rest, *(_random(bones, length, radius, rest, rng) for _ in range(count))]


def _random(
    bones: Skeleton,
    length: NDArray[np.float64],
    radius: NDArray[np.float64],
    rest: Pose,
    rng: np.random.Generator,
) -> Pose:
    """Draw poses until the parts of one overlap no more than at rest; else take the best."""
    ndim = rest.frame.shape[1]
    at_rest = _overlap(rest.body)
    best, least = rest, np.inf
    for _ in range(TRIES):
        turn, tilt = _random_angles(bones, rng)
        pose = _placed(bones, length, radius, turn, tilt if ndim == 3 else 0 * tilt, ndim)
        excess = float(np.maximum(_overlap(pose.body) - at_rest, 0).sum())
        if excess < least:
            best, least = pose, excess
        if excess == 0:
            break
    return best


def _bounded_normal(rng: np.random.Generator, n: int) -> NDArray[np.float64]:
    """Return normal deviates of at most two deviations."""
    return np.clip(rng.normal(size=n), -2, 2)


def _random_angles(
    bones: Skeleton, rng: np.random.Generator
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return angles about z and out of the plane: uniform for single bones, waves along limbs."""
    n = bones.limb.max() + 1
    phase, waves = rng.uniform(0, 2 * np.pi, (2, n)), rng.uniform(0.3, 1.0, (2, n))
    single = rng.uniform(-1, 1, (2, bones.limb.size))
    wave = np.sin(phase[:, bones.limb] + 2 * np.pi * waves[:, bones.limb] * np.nan_to_num(bones.place))
    unit = np.where(np.isnan(bones.place), single, wave)
    half = np.diff(bones.bend, axis=1)[:, 0] / 2
    return bones.bend.mean(axis=1) + half * unit[0], bones.sway * unit[1]


def _placed(
    bones: Skeleton,
    length: NDArray[np.float64],
    radius: NDArray[np.float64],
    turn: NDArray[np.float64],
    tilt: NDArray[np.float64],
    ndim: int,
) -> Pose:
    """Place the bones by their joint angles."""
    up = np.array([0.0, 0.0, 1.0])
    side = np.cross(up, bones.heading)
    side /= np.linalg.norm(side, axis=1, keepdims=True)
    local = _rotations(np.broadcast_to(up, side.shape), turn) @ _rotations(side, tilt)
    n = length.size
    frame, start, end = np.empty((n, 3, 3)), np.zeros((n, 3)), np.empty((n, 3))
    for i, p in enumerate(bones.parent.tolist()):
        if p < 0:
            frame[i], start[i] = local[i], local[i] @ bones.offset[i]
        else:
            frame[i] = frame[p] @ local[i]
            start[i] = start[p] + bones.along[i] * (end[p] - start[p]) + frame[p] @ bones.offset[i]
        end[i] = start[i] + length[i] * (frame[i] @ bones.heading[i])
    if ndim == 2:
        # The silhouette of a ball is a disk, so that of a capsule is one as well.
        start, end = (np.stack([-x[:, 1], x[:, 0]], axis=1) for x in (start, end))
        # Bones turn in the plane alone, and turns in a plane commute with that of its axes.
        frame = frame[:, :2, :2]
    return Pose(Capsules(start, end, radius), frame)


def _rotations(axis: NDArray[np.float64], angle: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the rotations ``(n, 3, 3)`` about unit axes (Rodrigues)."""
    x, y, z = axis.T
    zero = np.zeros_like(x)
    cross = np.array([[zero, -z, y], [z, zero, -x], [-y, x, zero]]).transpose(2, 0, 1)
    s, c = np.sin(angle)[:, None, None], np.cos(angle)[:, None, None]
    return np.asarray(np.eye(3) + s * cross + (1 - c) * (cross @ cross))


def _overlap(pose: Capsules) -> NDArray[np.float64]:
    """Return how deep balls along the bones overlap each other, with some clearance; 0 for none."""
    centre, radius = pose.spheres(BALLS)
    square = np.einsum("nd,nd->n", centre, centre)
    distance = np.sqrt(np.maximum(square[:, None] + square - 2 * centre @ centre.T, 0))
    return np.asarray(np.maximum(radius[:, None] + radius + CLEARANCE - distance, 0))
