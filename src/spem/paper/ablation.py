"""Codes of 5.5 with one parameter varied, or one ingredient left out."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spem.codes.part import N_CENTERS
from spem.codes.settings import Settings
from spem.codes.vlad import vlad
from spem.codes.vocabulary import Vocabulary
from spem.paper.data import Collection
from spem.paper.scoring import Features, Repeated, collect, repeat, summarise
from spem.retrieval.distances import correlation_distance

Rows = dict[str, Repeated]
WHOLE = "as in 5.5"


def vary_codes(
    found: Collection, settings: Settings, seeds: int, values: Mapping[str, Sequence[Any]]
) -> dict[str, Rows]:
    """Vary what does not touch the maps; those of fewer projections are the first of more.

    Parameters
    ----------
    found
        A labelled collection.
    settings
        The code that is varied.
    seeds
        Number of vocabularies.
    values
        Setting → values; `n_maps` among them.

    Returns
    -------
    dict
        Setting → value → scores.
    """
    features = collect(found, replace(settings, n_maps=max(settings.n_maps, *values["n_maps"])))
    results: dict[str, Rows] = {}
    for name, several in values.items():
        codes = {str(value): _changed(settings, name, value) for value in several}
        results[name] = {
            label: repeat(features.first(code.n_maps), code, seeds) for label, code in codes.items()
        }
    return results


def vary_fields(
    found: Collection, settings: Settings, seeds: int, values: Mapping[str, Sequence[Any]]
) -> dict[str, Rows]:
    """Vary what needs other fields or maps; a range of ρ is given by its two ends.

    With few voxels a thin shape has no node off the boundary, so the boundary layer is kept while their
    number is varied.

    Parameters
    ----------
    found, settings, seeds
        As for `vary_codes`.
    values
        Setting → values.
    """
    results: dict[str, Rows] = {}
    for name, several in values.items():
        rows: Rows = {}
        base = replace(settings, drop_boundary=False) if name == "voxels" else settings
        for value in several:
            ranged = name == "rho_ranges"
            code = _changed(base, name, (value,) if ranged else value)
            rows[f"{value[0]:g}–{value[1]:g}" if ranged else str(value)] = repeat(
                collect(found, code), code, seeds
            )
        results[name] = rows
    return results


def leave_out(found: Collection, settings: Settings, seeds: int) -> Rows:
    """Score the code of 5.5, and what is left of it without each ingredient.

    Parameters
    ----------
    found, seeds
        As for `vary_codes`.
    settings
        Those of 5.5.
    """
    features = collect(found, settings)
    whole = collect(found, replace(settings, drop_boundary=False))
    plain = [_plain_distances(features, settings, seed) for seed in range(seeds)]
    return {
        WHOLE: repeat(features, settings, seeds),
        "boundary layer kept": repeat(whole, settings, seeds),
        "intensities as they are": summarise(plain, found.labels),
        "unit length, no deviation": repeat(features, replace(settings, scaling="none"), seeds),
        "no power law": repeat(features, replace(settings, power=1.0), seeds),
    }


def _changed(settings: Settings, name: str, value: Any) -> Settings:
    """Change one setting."""
    change: dict[str, Any] = {name: value}
    return replace(settings, **change)


def _plain_distances(features: Features, settings: Settings, seed: int) -> NDArray[np.float64]:
    """Return distances of codes of the projections as they are, brought to no common length."""
    rng = np.random.default_rng(seed)
    maps = [bands[0] for bands in features.bands]
    drawn = [m[rng.integers(len(m), size=settings.nodes_per_shape)] for m in maps]
    count = settings.n_centers or N_CENTERS
    words = Vocabulary(count, random_state=seed).fit(np.concatenate(drawn)).cluster_centers_
    vectors = np.stack([vlad(m, words.astype(m.dtype), settings.power) for m in maps])
    return correlation_distance(vectors, vectors)
