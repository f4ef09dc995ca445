"""Skeletons of articulated creatures, and their random poses."""

from __future__ import annotations

import tomllib
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spem.errors import ParameterError
from spem.shapes.capsules import Capsules

# Standard deviation, in logarithms, of lengths and radii within a class.
LENGTH_JITTER = 0.05
RADIUS_JITTER = 0.035
# Balls along each bone by which overlap is measured, poses tried, and the gap asked for between
# parts that do not touch at rest.
BALLS = 4
TRIES = 8
CLEARANCE = 0.03


@dataclass(frozen=True, eq=False)
class Skeleton:
    """Bones joined to a tree, at rest; a bone stands after its parent.

    Parameters
    ----------
    parent
        ``(n,)`` index of the bone each is attached to, -1 for the root.
    along
        ``(n,)`` where on the parent, 0 at its start and 1 at its end.
    offset
        ``(n, 3)`` from there to the bone's start.
    heading
        ``(n, 3)`` unit vector of the bone.
    length
        ``(n,)`` length.
    radius
        ``(n, 2)`` radius at its start and end.
    bend
        ``(n, 2)`` range of the joint's angle about z, in radians.
    sway
        ``(n,)`` largest angle out of the plane, in radians.
    part
        ``(n,)`` number of the body part, which bones of one build share: links and mirror images.
    limb
        ``(n,)`` number of the limb, whose links move in one wave.
    place
        ``(n,)`` where in its limb a link lies, in [0, 1); nan for a bone that is no link.
    """

    parent: NDArray[np.int64]
    along: NDArray[np.float64]
    offset: NDArray[np.float64]
    heading: NDArray[np.float64]
    length: NDArray[np.float64]
    radius: NDArray[np.float64]
    bend: NDArray[np.float64]
    sway: NDArray[np.float64]
    part: NDArray[np.int64]
    limb: NDArray[np.int64]
    place: NDArray[np.float64]


def skeleton_kinds() -> tuple[str, ...]:
    """Return the names of all skeletons.

    Examples
    --------
    >>> len(skeleton_kinds())
    14
    """
    return tuple(_table())


@cache
def skeleton(kind: str) -> Skeleton:
    """Return the skeleton of a kind.

    Parameters
    ----------
    kind
        One of `skeleton_kinds`.

    Raises
    ------
    ParameterError
        If there is no such kind.

    Examples
    --------
    >>> len(skeleton("starfish").length)
    21
    """
    if kind not in _table():
        msg = f"kind must be one of {', '.join(_table())}, not {kind!r}"
        raise ParameterError(msg)
    entry = _table()[kind]
    bones: list[dict[str, Any]] = []
    last: dict[str, list[int]] = {}
    for part, row in enumerate(entry["bones"]):
        for mirrored in (False, True)[: 1 + row[0].endswith("_l")]:
            _append(bones, last, row, part, "xyz".index(entry["mirror"]) if mirrored else None)
    return Skeleton(**{name: np.array([bone[name] for bone in bones]) for name in bones[0]})


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
    if ndim not in (2, 3):
        msg = f"creatures live in 2 or 3 dimensions, not {ndim}"
        raise ParameterError(msg)
    bones = skeleton(kind)
    n_parts = bones.part.max() + 1
    length = bones.length * np.exp(LENGTH_JITTER * _bounded_normal(rng, n_parts))[bones.part]
    radius = bones.radius * np.exp(RADIUS_JITTER * _bounded_normal(rng, n_parts))[bones.part, None]
    middle = bones.bend.mean(axis=1)
    best, least = _placed(bones, length, radius, middle, 0 * middle, ndim), np.inf
    rest = _overlap(best)
    for _ in range(TRIES):
        turn, tilt = _random_angles(bones, rng)
        pose = _placed(bones, length, radius, turn, tilt if ndim == 3 else 0 * tilt, ndim)
        excess = float(np.maximum(_overlap(pose) - rest, 0).sum())
        if excess < least:
            best, least = pose, excess
        if excess == 0:
            break
    return best


@cache
def _table() -> dict[str, Any]:
    """Return the table of skeletons."""
    return tomllib.loads(files("spem.shapes").joinpath("creatures.toml").read_text(encoding="utf-8"))


def _append(
    bones: list[dict[str, Any]], last: dict[str, list[int]], row: list[Any], part: int, mirror: int | None
) -> None:
    """Append the links of one row of the table, mirrored along an axis if one is given."""
    name, parent, along, offset, (angle, lift), length, radius, bend, sway, links = row
    sign = np.ones(3)
    if mirror is not None:
        name, sign[mirror] = name.removesuffix("_l") + "_r", -1
        if parent.endswith("_l"):
            parent = parent.removesuffix("_l") + "_r"
    a, e = np.radians(angle), np.radians(lift)
    heading = np.array([np.cos(a) * np.cos(e), np.sin(a) * np.cos(e), np.sin(e)])
    # A reflection in the picture turns angles about z around; one along z leaves them.
    turns = np.radians(bend) if mirror != 0 else -np.radians(bend)[::-1]
    taper = np.linspace(radius[0], radius[1], links + 1)
    chain = last.get(parent, [])
    position = along * len(chain)
    link = min(int(position), len(chain) - 1)
    limb = len({bone["limb"] for bone in bones})
    last[name] = []
    for k in range(links):
        bones.append(
            {
                "parent": (chain[link] if chain else -1) if k == 0 else len(bones) - 1,
                "along": (position - link if chain else 0.0) if k == 0 else 1.0,
                "offset": sign * offset if k == 0 else np.zeros(3),
                "heading": sign * heading,
                "length": length / links,
                "radius": taper[k : k + 2],
                "bend": turns,
                "sway": np.radians(sway),
                "part": part,
                "limb": limb,
                "place": k / links if links > 1 else np.nan,
            }
        )
        last[name].append(len(bones) - 1)


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
) -> Capsules:
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
    return Capsules(start, end, radius)


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
