"""Skeletons of articulated creatures."""

from __future__ import annotations

import tomllib
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spem.errors import ParameterError


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
    _check(kind)
    entry, axis = _table()[kind], mirror_axis(kind)
    bones: list[dict[str, Any]] = []
    last: dict[str, list[int]] = {}
    for part, row in enumerate(entry["bones"]):
        for mirrored in (False, True)[: 1 + row[0].endswith("_l")]:
            _append(bones, last, row, part, axis if mirrored else None)
    return Skeleton(**{name: np.array([bone[name] for bone in bones]) for name in bones[0]})


def mirror_axis(kind: str) -> int | None:
    """Return the axis, 0 to 2, along which left and right of a kind are mirror images at rest; None without.

    Raises
    ------
    ParameterError
        If there is no such kind.

    Examples
    --------
    >>> mirror_axis("human"), mirror_axis("dog"), mirror_axis("hand")
    (0, 2, None)
    """
    _check(kind)
    entry = _table()[kind]
    paired = any(row[0].endswith("_l") for row in entry["bones"])
    return "xyz".index(entry["mirror"]) if paired else None


def _check(kind: str) -> None:
    """Refuse kinds that there are not."""
    if kind not in _table():
        msg = f"kind must be one of {', '.join(_table())}, not {kind!r}"
        raise ParameterError(msg)


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
