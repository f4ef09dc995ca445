"""Codes of SPEM and of heat and wave signatures on the same shapes, these from one spectrum each (3.3)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any, Literal, get_args

import numpy as np
from numpy.typing import NDArray

from spem.codes.bands import Bands
from spem.codes.kinds import shape_features
from spem.codes.settings import Settings
from spem.codes.sources import read_shapes
from spem.codes.spectral import shape_spectrum, spectral_features
from spem.errors import SpemError
from spem.paper.data import Collection
from spem.paper.scoring import Features, Repeated, compute_all, repeat
from spem.shapes.shape import Shape

# Features of these kinds at a smaller number are the first of those at a larger; other signatures spread
# theirs over the same times or energies.
_NESTED = ("spem", "si-hks")
_CONSTANT = 1e-5

Kind = Literal["spem", "hks", "si-hks", "wks"]
Made = dict[tuple[Kind, int], Bands]


@dataclass(frozen=True)
class KindScores:
    """What codes of each kind of features score on one collection.

    Parameters
    ----------
    collection
        The shapes.
    rows
        Kind → scores over seeds, with most features.
    tiers
        Kind → number of features → mean first tier, in percent.
    shared
        Shares of the variance over a shape: of HKS, which are linear in the SPEM maps; and of fields, which
        are linear in HKS.
    """

    collection: Collection
    rows: dict[Kind, Repeated]
    tiers: dict[Kind, dict[int, float]]
    shared: tuple[float, float]

    def rival(self, count: int) -> tuple[Kind, float]:
        """Return the best kind other than SPEM with some number of features, and its first tier."""
        others: dict[Kind, float] = {k: tier[count] for k, tier in self.tiers.items() if k != "spem"}
        best = max(others, key=lambda kind: others[kind])
        return best, others[best]

    def most_apart(self, kind: Kind) -> tuple[str, float, float]:
        """Return the class over which another kind is most ahead of SPEM, and the first tiers of both."""
        ours, theirs = self.rows["spem"].scores[0].per_class(), self.rows[kind].scores[0].per_class()
        label = max(ours, key=lambda each: theirs[each]["FT"] - ours[each]["FT"])
        return str(label), ours[label]["FT"], theirs[label]["FT"]

    def to_json(self) -> dict[str, Any]:
        """Return all figures."""
        return {
            "scores": {kind: row.to_json() for kind, row in self.rows.items()},
            "first tier by number of features": self.tiers,
            "variance shared by HKS and SPEM": self.shared,
        }


def score_kinds(
    collection: Collection,
    counts: Sequence[int],
    seeds: int,
    *,
    voxels: int,
    n_pairs: int = 100,
    n_centers: int = 64,
) -> KindScores:
    """Score codes of every kind, in several numbers of features, over seeds of the vocabulary.

    Parameters
    ----------
    collection, counts, voxels, n_pairs
        As `collect_kinds` has them.
    seeds
        Number of vocabularies.
    n_centers
        Centres of a vocabulary.
    """
    made = collect_kinds(collection, counts, voxels=voxels, n_pairs=n_pairs)
    rows: dict[Kind, Repeated] = {}
    tiers: dict[Kind, dict[int, float]] = {kind: {} for kind in get_args(Kind)}
    for (kind, count), features in made.items():
        settings = kind_settings(kind, count, voxels=voxels, n_pairs=n_pairs, n_centers=n_centers)
        row = repeat(features, settings, seeds)
        tiers[kind][count] = row.mean["FT"]
        if count == max(counts):
            rows[kind] = row
    spem, heat = made["spem", max(counts)], made["hks", max(counts)]
    shared = shared_variance(spem, heat, equal=True), shared_variance(heat, spem, equal=False)
    return KindScores(collection, rows, tiers, shared)


def collect_kinds(
    collection: Collection, counts: Sequence[int], *, voxels: int, n_pairs: int
) -> dict[tuple[Kind, int], Features]:
    """Compute the features of every kind, in several numbers a node, on all cores.

    Parameters
    ----------
    collection
        The shapes.
    counts
        Numbers of features.
    voxels
        Number of voxels of each shape, the same for all kinds.
    n_pairs
        Number of eigenpairs of the signatures.

    Returns
    -------
    dict
        Kind and number → features of the collection.

    Raises
    ------
    ReadError
        If a shape gives none.
    """
    items = collection.items
    work = partial(_made, items=items, counts=tuple(counts), voxels=voxels, n_pairs=n_pairs)
    found = compute_all(work, items)
    return {key: Features(tuple(made[key] for made in found), collection.labels) for key in found[0]}


def kind_settings(kind: Kind, count: int, *, voxels: int, n_pairs: int, n_centers: int = 64) -> Settings:
    """Return the default settings of a kind, with some number of features.

    Examples
    --------
    >>> kind_settings("wks", 4, voxels=900, n_pairs=50).n_pairs
    50
    """
    settings = Settings(features="spem", n_maps=count, voxels=voxels, n_centers=n_centers, levels=1)
    return settings if kind == "spem" else replace(settings, features=kind, n_pairs=n_pairs)


def signature_bands(shape: Shape, count: int, *, n_pairs: int = 100) -> dict[Kind, Bands]:
    """Compute the features of every kind of one shape.

    Examples
    --------
    >>> from spem.shapes.synthetic import disk
    >>> list(signature_bands(disk(radius=8.0, spacing=1.0), 4, n_pairs=30))
    ['spem', 'hks', 'si-hks', 'wks']
    """
    made = _all_kinds(shape, (count,), shape.n_nodes, n_pairs)
    return {kind: bands for (kind, _), bands in made.items()}


def shared_variance(known: Features, wanted: Features, *, equal: bool, n_shapes: int = 20) -> float:
    """Return which share of the variance of features over a shape is a linear function of other ones.

    Parameters
    ----------
    known, wanted
        What explains, and what is explained.
    equal
        Whether every wanted feature weighs the same; otherwise by its variance, by which SPEM maps stand for
        the fields that they are made of.
    n_shapes
        Over how many shapes, evenly chosen, it is averaged.

    Examples
    --------
    >>> x = np.linspace(0, 1, 9)[:, None]
    >>> line, lines = (Features(((values,),), ("a",)) for values in (x, np.hstack([x, 1 - 2 * x])))
    >>> round(shared_variance(line, lines, equal=True), 6)
    1.0
    """
    chosen = np.unique(np.linspace(0, len(known.bands) - 1, n_shapes).astype(int))
    shares = [_explained(known.bands[i][0], wanted.bands[i][0], equal=equal) for i in chosen]
    return float(np.mean(shares))


def _explained(known: NDArray[np.floating], wanted: NDArray[np.floating], *, equal: bool) -> float:
    """Regress the wanted features, about their means, on the known ones."""
    ours, theirs = _varying(known), _varying(wanted)
    ours /= ours.std(axis=0)
    theirs /= theirs.std(axis=0) if equal else 1.0
    fitted = ours @ np.linalg.lstsq(ours, theirs, rcond=1e-6)[0]
    return float(np.square(fitted).sum() / np.square(theirs).sum())


def _varying(features: NDArray[np.floating]) -> NDArray[np.float64]:
    """Take features about their means, without those that are constant up to single precision."""
    values = features.astype(np.float64)
    values = values[:, values.std(axis=0) > _CONSTANT * np.abs(values).max(axis=0)]
    return np.asarray(values - values.mean(axis=0))


def _made(
    index: int, items: Sequence[Path | Shape], counts: tuple[int, ...], voxels: int, n_pairs: int
) -> Made:
    """Compute the features of one item."""
    ((_, shape),) = read_shapes(items[index], Settings(features="spem", voxels=voxels))
    if isinstance(shape, SpemError):
        raise shape
    return _all_kinds(shape, counts, voxels, n_pairs)


def _all_kinds(shape: Shape, counts: tuple[int, ...], voxels: int, n_pairs: int) -> Made:
    """Solve once for the fields and once for the spectrum."""
    made: Made = {}
    settings = partial(kind_settings, voxels=voxels, n_pairs=n_pairs)
    spectrum = shape_spectrum(shape, settings("hks", max(counts)))
    for kind in get_args(Kind):
        whole: Bands | None = None
        for count in sorted(counts, reverse=True):
            if whole is not None and kind in _NESTED:
                made[kind, count] = tuple(np.ascontiguousarray(block[:, :count]) for block in whole)
            elif kind == "spem":
                made[kind, count] = shape_features(shape, settings(kind, count))
            else:
                made[kind, count] = spectral_features(spectrum, settings(kind, count))
            whole = whole or made[kind, count]
    return made
