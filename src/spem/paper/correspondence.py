"""Matching points of poses by the values of several descriptors, and how far the matches are off."""

from __future__ import annotations

import itertools
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from spem.api.fields import maps
from spem.embedding.correspondence import match_nodes, standardised, surroundings
from spem.embedding.signatures import (
    heat_kernel_signature,
    shared_times,
    shared_values,
    wave_kernel_signature,
)
from spem.fields.geodesics import inner_distances
from spem.fields.spectrum import solve_spectrum
from spem.paper.poses import Poses
from spem.shapes.shape import Shape

# Maps down to 1e-14 of the variance: to there they are consistent from pose to pose.
N_MAPS, _RTOL = 10, 1e-10
N_PAIRS, N_VALUES = 100, 16
AROUND = ", surroundings"
CHANCE = "chance"


@dataclass(frozen=True, eq=False)
class Errors:
    """How far matches are off, in units of L = volume^(1/d), along ways inside the target.

    Parameters
    ----------
    exact
        ``(n,)`` distance from the true point.
    either
        ``(n,)`` distance from the true point or its mirror image, whichever is nearer.
    """

    exact: NDArray[np.float64]
    either: NDArray[np.float64]

    @property
    def swapped(self) -> float:
        """Share of the matches that are nearer to the mirror image than to the true point."""
        return float((self.either < self.exact).mean())

    @property
    def figures(self) -> dict[str, float]:
        """Means, medians and shares, by name."""
        return {
            "mean": float(self.exact.mean()),
            "median": float(np.median(self.exact)),
            "mean, either side": float(self.either.mean()),
            "median, either side": float(np.median(self.either)),
            "within 0.25, either side": float((self.either <= 1 / 4).mean()),
            "on the wrong side": self.swapped,
        }

    def within(self, radius: NDArray[np.float64], *, exact: bool) -> NDArray[np.float64]:
        """Return the share of the matches within each distance."""
        errors = np.sort(self.exact if exact else self.either)
        return np.asarray(np.searchsorted(errors, radius, side="right") / errors.size)


def descriptors(shape: Shape, n_pairs: int = N_PAIRS) -> dict[str, NDArray[np.float64]]:
    """Return the standardised descriptors of a shape, of the node alone and of its surroundings too.

    SPEM beside the volumetric heat and wave kernel signatures, which are made of `n_pairs` eigenpairs with a
    free boundary.

    Examples
    --------
    >>> import spem
    >>> list(descriptors(spem.synthetic.disk(radius=8.0, spacing=1.0), 20))[:2]
    ['SPEM', 'SPEM, surroundings']
    """
    spectrum = solve_spectrum(shape, n_pairs)
    size, d = shape.size, shape.ndim
    alone = {
        "SPEM": maps(shape, N_MAPS, rtol=_RTOL).values,
        "HKS": heat_kernel_signature(spectrum, shared_times(size, d, n_pairs, N_VALUES)),
        "WKS": wave_kernel_signature(spectrum, shared_values(size, d, n_pairs, N_VALUES)),
    }
    found = {}
    for name, values in alone.items():
        found[name] = standardised(values)
        found[name + AROUND] = surroundings(shape, found[name])
    return found


def match_errors(poses: Poses, features: list[dict[str, NDArray[np.float64]]]) -> dict[str, Errors]:
    """Match the marks of each pose to the nodes of every other, by each descriptor and by chance.

    Parameters
    ----------
    poses
        The poses.
    features
        Of each pose, by name: ``(n_nodes, n_features)``.

    Examples
    --------
    >>> from spem.paper.poses import load_poses
    >>> from spem.paper.data import Data
    >>> [poses] = load_poses(Data(quick=True), n_inside=2, n_marks=20)
    >>> found = match_errors(poses, [{"place": shape.points} for shape in poses.shapes])
    >>> list(found), found["place"].exact.shape
    (['place', 'chance'], (120,))
    """
    rng = np.random.default_rng(0)
    shapes, nodes = poses.shapes, poses.nodes
    away = [inner_distances(shape, of) / shape.size for shape, of in zip(shapes, nodes, strict=True)]

    pairs = list(itertools.permutations(range(len(shapes)), 2))

    def errors(matches: Iterable[NDArray[np.int64]]) -> Errors:
        exact, mirrored = [], []
        for (_, b), found in zip(pairs, matches, strict=True):
            exact.append(away[b][np.arange(found.size), found])
            mirrored.append(away[b][poses.mirror, found])
        true, image = np.concatenate(exact), np.concatenate(mirrored)
        return Errors(true, np.minimum(true, image))

    found = {
        name: errors(match_nodes(features[a][name][nodes[a]], features[b][name]) for a, b in pairs)
        for name in features[0]
    }
    by_chance = (rng.integers(shapes[b].n_nodes, size=nodes.shape[1:]) for _, b in pairs)
    return found | {CHANCE: errors(by_chance)}
