"""Silhouettes altered as in Fig. 14: limbs taken off or shortened, noise on the boundary, protrusions."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

Mask = NDArray[np.bool_]

# Limbs are what opening by a disk of this share of the inner radius removes, of this share of the area.
CORE = 0.5
LEAST = 0.015
# Standard deviation of the boundary's noise, and length and half width of a protrusion, in inner radii.
NOISE = {"noise": 0.04, "strong noise": 0.08}
LENGTH, WIDTH = 1.0, 0.22


def limbs(mask: Mask) -> list[Mask]:
    """Return the limbs of a silhouette, largest first."""
    radius = round(CORE * depth(mask).max())
    y, x = np.mgrid[-radius : radius + 1, -radius : radius + 1]
    core = ndimage.binary_opening(mask, x * x + y * y <= radius * radius + 0.5)
    label, count = ndimage.label(mask & ~core)
    area = ndimage.sum(mask, label, np.arange(1, count + 1))
    order = np.argsort(-area, kind="stable")
    return [label == i + 1 for i in order if area[i] >= LEAST * mask.sum()]


def conditions(mask: Mask, rng: np.random.Generator) -> dict[str, Mask]:
    """Return altered silhouettes by name; the mask needs room around it for the protrusions."""
    found, altered = limbs(mask), {}
    if len(found) > 1:
        altered["longest limb off"] = largest(mask & ~found[0])
        altered["another limb off"] = largest(mask & ~found[rng.integers(1, len(found))])
        last = found[-1]
        outward = ndimage.distance_transform_edt(~(mask & ~last))
        altered["limb shortened"] = largest(mask & ~(last & (outward > 0.5 * outward[last].max())))
    for name, share in NOISE.items():
        altered[name] = noisy(mask, share, rng)
    altered["two protrusions"] = protruded(mask, 2, rng)
    return altered


def noisy(mask: Mask, share: float, rng: np.random.Generator) -> Mask:
    """Move the boundary by smooth noise."""
    noise = ndimage.gaussian_filter(rng.standard_normal(mask.shape), 1.5)
    level = depth(mask) - depth(~mask)
    return largest(level + noise * (share * level.max() / noise.std()) > 0)


def protruded(mask: Mask, count: int, rng: np.random.Generator) -> Mask:
    """Put capsules on random places of the boundary, along the normal, where they touch nothing else."""
    level = depth(mask) - depth(~mask)
    radius = level.max()
    inward = np.stack(np.gradient(ndimage.gaussian_filter(level, 3)))
    grid = np.indices(mask.shape)
    grown, places = mask.copy(), []
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
    """Return the distance of each pixel from the outside."""
    return np.asarray(ndimage.distance_transform_edt(mask), np.float64)


def largest(mask: Mask) -> Mask:
    """Return the largest connected piece."""
    label, count = ndimage.label(mask)
    return label == 1 + np.argmax(ndimage.sum(mask, label, np.arange(1, count + 1)))
