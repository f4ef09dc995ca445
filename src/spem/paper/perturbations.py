"""Silhouettes altered as in Fig. 14: limbs taken off or shortened, noise on the boundary, protrusions."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from spem.errors import ShapeError

Mask = NDArray[np.bool_]

# Limbs are what opening by a disk of this share of the inner radius removes, of this share of the area.
CORE = 0.5
LEAST = 0.015
# Standard deviation of the boundary's noise, and length and half width of a protrusion, in inner radii.
NOISE = {"noise": 0.04, "strong noise": 0.08}
LENGTH, WIDTH = 1.0, 0.22
# What a shortened limb keeps of its reach beyond the trunk.
KEPT = 0.5


def limbs(mask: Mask) -> list[Mask]:
    """Return the limbs of a silhouette, largest first: what an opening by half its inner radius removes.

    Examples
    --------
    >>> y, x = np.mgrid[:60, :90]
    >>> mask = ((y - 30) ** 2 + (x - 30) ** 2 < 400) | ((abs(y - 30) < 4) & (x > 30) & (x < 80))
    >>> [int(limb.sum()) for limb in limbs(mask)]
    [205]
    """
    radius = round(CORE * depth(mask).max())
    y, x = np.mgrid[-radius : radius + 1, -radius : radius + 1]
    core = ndimage.binary_opening(mask, x * x + y * y <= radius * radius + 0.5)
    label, count = ndimage.label(mask & ~core)
    area = ndimage.sum(mask, label, np.arange(1, count + 1))
    order = np.argsort(-area, kind="stable")
    return [label == i + 1 for i in order if area[i] >= LEAST * mask.sum()]


def conditions(mask: Mask, rng: np.random.Generator) -> dict[str, Mask]:
    """Return altered silhouettes by name, one alteration each.

    Parameters
    ----------
    mask
        A silhouette, with room around it for the protrusions.
    rng
        Which limb, which noise, where protrusions stand.

    Examples
    --------
    >>> y, x = np.mgrid[:60, :90]
    >>> mask = ((y - 30) ** 2 + (x - 30) ** 2 < 400) | ((abs(y - 30) < 4) & (x > 30) & (x < 80))
    >>> list(conditions(mask, np.random.default_rng(0)))
    ['noise', 'strong noise', 'two protrusions']
    """
    found, altered = limbs(mask), {}
    if len(found) > 1:
        altered["longest limb off"] = without(mask, found[0])
        altered["another limb off"] = without(mask, found[rng.integers(1, len(found))])
        altered["limb shortened"] = shortened(mask, found[-1:])
    for name, share in NOISE.items():
        altered[name] = noisy(mask, share, rng)
    altered["two protrusions"] = protruded(mask, 2, rng)
    return altered


def without(mask: Mask, limb: Mask) -> Mask:
    """Return the silhouette without one of its limbs.

    Examples
    --------
    >>> mask = np.array([[0, 0, 0, 0, 0], [0, 1, 1, 1, 0], [0, 0, 0, 0, 0]], bool)
    >>> int(without(mask, np.arange(5) == 3 + np.zeros((3, 1))).sum())
    2
    """
    return largest(mask & ~limb)


def shortened(mask: Mask, which: Sequence[Mask], trunk: Mask | None = None) -> Mask:
    """Return the silhouette with limbs cut to half their reach.

    Parameters
    ----------
    mask
        The silhouette.
    which
        Some of its `limbs`.
    trunk
        What their reach is measured from; by default all that is not the limb, other limbs included.

    Examples
    --------
    >>> y, x = np.mgrid[:60, :90]
    >>> mask = ((y - 30) ** 2 + (x - 30) ** 2 < 400) | ((abs(y - 30) < 4) & (x > 30) & (x < 80))
    >>> int(mask.sum() - shortened(mask, limbs(mask)).sum())
    105
    """
    kept = mask
    for limb in which:
        outward = ndimage.distance_transform_edt(~(mask & ~limb if trunk is None else trunk))
        kept = kept & ~(limb & (outward > KEPT * outward[limb].max()))
    return largest(kept)


def noisy(mask: Mask, share: float, rng: np.random.Generator) -> Mask:
    """Move the boundary by smooth noise.

    Parameters
    ----------
    mask
        The silhouette.
    share
        Standard deviation of the noise, in inner radii.
    rng
        The noise.

    Examples
    --------
    >>> mask = np.pad(np.ones((40, 40), bool), 10)
    >>> altered = noisy(mask, 0.05, np.random.default_rng(0))
    >>> bool(0.01 < (altered != mask).sum() / mask.sum() < 0.1)
    True
    """
    noise = ndimage.gaussian_filter(rng.standard_normal(mask.shape), 1.5)
    level = depth(mask) - depth(~mask)
    return largest(level + noise * (share * level.max() / noise.std()) > 0)


def protruded(mask: Mask, count: int, rng: np.random.Generator) -> Mask:
    """Put capsules on random places of the boundary, along the normal, where they touch nothing else.

    Parameters
    ----------
    mask
        The silhouette, with room around it.
    count
        Number of capsules; fewer where there is no room.
    rng
        Where they stand.

    Examples
    --------
    >>> mask = np.pad(np.ones((40, 40), bool), 40)
    >>> grown = protruded(mask, 2, np.random.default_rng(0)) & ~mask
    >>> int(ndimage.label(grown)[1])
    2
    """
    level = depth(mask) - depth(~mask)
    radius = level.max()
    inward = np.stack(np.gradient(ndimage.gaussian_filter(level, 3)))
    grid = np.indices(mask.shape)
    grown = mask.copy()
    places: list[NDArray[np.int64]] = []
    for place in rng.permutation(np.argwhere(mask & (level < 1.5))):
        normal = -inward[:, *place]
        size = np.linalg.norm(normal)
        near = any(np.linalg.norm(place - other) < 2 * WIDTH * radius + 6 for other in places)
        if near or size < 0.5:
            continue
        away = grid - place[:, None, None]
        along = np.clip(np.tensordot(normal / size, away, 1), 0, LENGTH * radius)
        square = np.square(away - (normal / size)[:, None, None] * along).sum(axis=0)
        reach = (square <= (WIDTH * radius + 2) ** 2) & (along > 0.4 * LENGTH * radius)
        if (reach & grown).any():
            continue
        grown |= square <= (WIDTH * radius) ** 2
        places.append(place)
        if len(places) == count:
            break
    return grown


def depth(mask: Mask) -> NDArray[np.float64]:
    """Return the distance of each pixel from the outside.

    Examples
    --------
    >>> depth(np.array([False, True, True, True, False])).tolist()
    [0.0, 1.0, 2.0, 1.0, 0.0]
    """
    return np.asarray(ndimage.distance_transform_edt(mask), np.float64)


def largest(mask: Mask) -> Mask:
    """Return the largest connected piece.

    Examples
    --------
    >>> largest(np.array([True, True, False, True])).tolist()
    [True, True, False, False]
    """
    label, count = ndimage.label(mask)
    return np.asarray(label == 1 + np.argmax(ndimage.sum(mask, label, np.arange(1, count + 1))))


def instances(mask: Mask, rng: np.random.Generator) -> dict[str, Mask]:
    """Return the five instances of a hand that Fig. 14 shows, by name, the hand itself first.

    Parameters
    ----------
    mask
        A silhouette with limbs, with room around it for the protrusions.
    rng
        Which noise, where protrusions stand.

    Raises
    ------
    ShapeError
        If it has no limbs.

    Examples
    --------
    >>> y, x = np.mgrid[:60, :90]
    >>> mask = ((y - 30) ** 2 + (x - 30) ** 2 < 400) | ((abs(y - 30) < 4) & (x > 30) & (x < 80))
    >>> list(instances(mask, np.random.default_rng(0)))
    ['original', 'occluded', 'shortened', 'protrusions', 'noise']
    """
    found = limbs(mask)
    if not found:
        msg = "a silhouette without limbs has none to take off or to shorten; choose one with limbs"
        raise ShapeError(msg)
    return {
        "original": mask,
        "occluded": without(mask, found[0]),
        "shortened": shortened(mask, found[:3], mask & ~np.any(found, axis=0)),
        "protrusions": protruded(mask, 2, rng),
        "noise": noisy(mask, NOISE["noise"], rng),
    }
