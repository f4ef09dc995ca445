"""The systems of Table 1 on the same shapes: descriptions once, then distances, scores and times."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache, partial
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np

from spem.codes.bands import Bands
from spem.codes.kinds import shape_features
from spem.codes.settings import Settings
from spem.codes.sources import read_shapes
from spem.codes.workers import one_line
from spem.errors import ReadError, SpemError
from spem.paper.data import Collection, Data
from spem.paper.scoring import (
    Features,
    Repeated,
    compute_all,
    creature_features,
    half_of_classes,
    repeat,
    summarise,
)
from spem.retrieval.distances import fuse
from spem.rivals.catalogue import RIVALS, make_rival, missing
from spem.shapes.shape import Shape

SPEM, SURFACE, JOINED = "SPEM", "surface", "SPEM+surface"
PAPER, OUTSIDE = "SPEM, the code of 5.5", "words of creatures"
# Features of each of our codes.
KINDS = {SPEM: "spem", SURFACE: "surface", JOINED: "spem+surface"}
SEEDS, EACH = 5, 8
# Of the reduced size: voxels, also of creatures, and classes.
VOXELS, FEW = 1500, 5
HYBRIDS = ("SPEM+SD-GDM", "SPEM+MDS-CM-BOF", "SPEM+meshSIFT", "SD-GDM+meshSIFT")
# What a reduced size has time for, with the parameters that it takes.
QUICK: Mapping[str, dict[str, Any]] = MappingProxyType({"SD-GDM": {"samples": 100}, "Shape-DNA": {}})


@dataclass(frozen=True)
class Described:
    """What one system knows of the shapes of a collection.

    Parameters
    ----------
    values
        For each shape; empty where the system failed.
    seconds
        Median time of one core for a shape.
    failure
        Why there is nothing.
    """

    values: tuple[Any, ...]
    seconds: float = 0.0
    failure: str = ""


@dataclass(frozen=True)
class Row:
    """One system of the table.

    Parameters
    ----------
    scored
        Its scores; None where it was not run.
    seconds
        Time of one core for a shape: that of its description, and its share of the comparison.
    failure
        Why there are none.
    """

    scored: Repeated | None
    seconds: float = 0.0
    failure: str = ""


@dataclass(frozen=True)
class Measured:
    """Everything that Table 1 and Figure 19 show.

    Parameters
    ----------
    source
        One sentence: which shapes.
    real
        Whether they are those of SHREC'11.
    labels
        Class of each shape.
    seeds
        Number of vocabularies that codes were made with.
    rows
        For each system its scores.
    """

    source: str
    real: bool
    labels: tuple[str, ...]
    seeds: int
    rows: dict[str, Row]


@lru_cache(maxsize=1)
def measure(data: Data) -> Measured:
    """Run every system on SHREC'11, or a few in a reduced size; the last outcome is kept.

    Parameters
    ----------
    data
        Where SHREC'11 is; creatures stand in for it.
    """
    found = data.collection("shrec11", ndim=3, per_class=3 if data.quick else None, voxels=VOXELS)
    found = first_classes(found, FEW) if data.quick else found
    sizes: dict[str, Any] = {"voxels": VOXELS, "n_centers": 16} if data.quick else {}
    codes = {name: Settings(features=words, **sizes).resolved(3) for name, words in KINDS.items()}
    parts = {name: code for name, code in codes.items() if name != JOINED}
    known = describe_all(found.items, feature_systems(parts) | rival_systems(data.quick), codes[SPEM])
    seeds, each = (2, 1) if data.quick else (SEEDS, EACH)
    # Creatures in place of SHREC'11 have no outside.
    outside = creature_features(3, each, codes[JOINED]) if found.real else ()
    rows = code_rows(known, found.labels, codes, outside, seeds)
    rows |= rival_rows(known, found.labels)
    return Measured(found.source, found.real, found.labels, seeds, rows | hybrid_rows(rows, found.labels))


def first_classes(collection: Collection, count: int) -> Collection:
    """Keep the shapes of the first classes by name."""
    chosen = sorted(set(collection.labels))[:count]
    kept = [pair for pair in zip(collection.items, collection.labels, strict=True) if pair[1] in chosen]
    return replace(
        collection, items=tuple(item for item, _ in kept), labels=tuple(label for _, label in kept)
    )


def code_rows(
    known: Mapping[str, Described],
    labels: Sequence[str],
    codes: Mapping[str, Settings],
    outside: Sequence[Bands],
    seeds: int,
) -> dict[str, Row]:
    """Score our codes: of maps, of the surface, of both; and with other vocabularies.

    Parameters
    ----------
    known
        What `describe_all` gave of maps and surface.
    labels
        Class of each shape.
    codes
        Settings of each code.
    outside
        Features of shapes that are not searched, of maps and surface; empty for none.
    seeds
        Number of vocabularies.

    Raises
    ------
    ReadError
        If a shape has no features.
    """
    for name in (SPEM, SURFACE):
        if known[name].failure:
            msg = f"{name}: {known[name].failure}; mend the file or take it out of the collection"
            raise ReadError(msg)
    maps, surface = known[SPEM], known[SURFACE]
    spem = Features(maps.values, tuple(labels))
    both = Features(
        tuple(one + other for one, other in zip(maps.values, surface.values, strict=True)), tuple(labels)
    )
    n_bands, seconds = codes[SPEM].n_bands, maps.seconds + surface.seconds
    rows = {
        SPEM: Row(repeat(spem, codes[SPEM], seeds), maps.seconds),
        JOINED: Row(repeat(both, codes[JOINED], seeds), seconds),
        SURFACE: Row(repeat(Features(surface.values, tuple(labels)), codes[SURFACE], seeds), surface.seconds),
        f"{SPEM}, words of half the classes": Row(
            repeat(spem, codes[SPEM], seeds, partial(half_of_classes, spem)), maps.seconds
        ),
        PAPER: Row(repeat(*paper_code(spem, codes[SPEM]), seeds), maps.seconds),
    }
    if outside:
        words = [bands[:n_bands] for bands in outside]
        rows[f"{SPEM}, {OUTSIDE}"] = Row(repeat(spem, codes[SPEM], seeds, lambda _: words), maps.seconds)
        rows[f"{JOINED}, {OUTSIDE}"] = Row(repeat(both, codes[JOINED], seeds, lambda _: outside), seconds)
    return rows


def paper_code(features: Features, settings: Settings) -> tuple[Features, Settings]:
    """Return six maps and the code of 5.5 on the fields at hand."""
    paper = Settings.paper(voxels=settings.voxels, boundary=settings.boundary, drop_boundary=False)
    return features.first(paper.n_maps), paper


def describe_all(
    items: Sequence[Path | Shape], systems: Mapping[str, Callable[[Shape], Any]], settings: Settings
) -> dict[str, Described]:
    """Describe every shape with every system, on all cores; a shape is read once.

    Parameters
    ----------
    items
        Shapes and files.
    systems
        For each name what makes a description of a shape.
    settings
        How files are read.

    Raises
    ------
    ReadError
        If a file cannot be read.

    Examples
    --------
    >>> from spem.shapes.synthetic import disk
    >>> plain = Settings(voxels=None)
    >>> describe_all([disk(3.0, 1.0)], {"nodes": lambda shape: shape.n_nodes}, plain)["nodes"].values
    (25,)
    """
    work = partial(_describe, items=tuple(items), systems=dict(systems), settings=settings)
    found = compute_all(work, items)
    return {name: _gathered([each[name] for each in found]) for name in systems}


def feature_systems(settings: Mapping[str, Settings]) -> dict[str, Callable[[Shape], Any]]:
    """Return what makes the node features of each kind of code."""
    return {name: partial(shape_features, settings=code) for name, code in settings.items()}


def rival_systems(quick: bool) -> dict[str, Callable[[Shape], Any]]:
    """Return what describes a shape for each rival that can be run; in a reduced size, the quick ones."""
    wanted = [name for name in (QUICK if quick else RIVALS) if not missing(name)]
    return {name: make_rival(name, **(QUICK[name] if quick else {})).describe for name in wanted}


def rival_rows(known: Mapping[str, Described], labels: Sequence[str]) -> dict[str, Row]:
    """Compare the descriptions of each rival and score them; one that was not run says why.

    Parameters
    ----------
    known
        What `describe_all` gave.
    labels
        Class of each shape.
    """
    rows = {}
    for name in RIVALS:
        found = known.get(name, Described((), failure=missing(name) or "left out of the reduced size"))
        if found.failure:
            rows[name] = Row(None, failure=found.failure)
            continue
        start = time.process_time()
        distances = make_rival(name).compare(found.values)
        share = (time.process_time() - start) / len(labels)
        rows[name] = Row(summarise([distances], labels), found.seconds + share)
    return rows


def hybrid_rows(rows: Mapping[str, Row], labels: Sequence[str]) -> dict[str, Row]:
    """Sum the distances of two systems, each brought to [0, 1] (5.5), for each seed of the first.

    Parameters
    ----------
    rows
        The systems alone.
    labels
        Class of each shape.
    """
    made = {}
    for name in HYBRIDS:
        one, other = (rows[part] for part in name.split("+"))
        if one.scored is None or other.scored is None:
            made[name] = Row(None, failure=one.failure or other.failure)
            continue
        sums = [fuse(matrix, other.scored.distances) for matrix in one.scored.matrices]
        made[name] = Row(summarise(sums, labels), one.seconds + other.seconds)
    return made


def _describe(
    index: int,
    items: Sequence[Path | Shape],
    systems: Mapping[str, Callable[[Shape], Any]],
    settings: Settings,
) -> dict[str, tuple[Any, float, str]]:
    """Describe one shape: for each system what it gives, seconds, and why it gives nothing."""
    ((_, shape),) = read_shapes(items[index], settings)
    if isinstance(shape, SpemError):
        raise shape
    found: dict[str, tuple[Any, float, str]] = {}
    for name, describe in systems.items():
        start = time.process_time()
        try:
            value, failure = describe(shape), ""
        except SpemError as error:
            value, failure = None, f"{shape.name}: {one_line(error)}"
        found[name] = value, time.process_time() - start, failure
    return found


def _gathered(found: Sequence[tuple[Any, float, str]]) -> Described:
    """Put together what a system gives of each shape; a system that fails on one has failed."""
    failures = [failure for *_, failure in found if failure]
    if failures:
        return Described((), failure=f"{len(failures)} of {len(found)} shapes failed, first {failures[0]}")
    return Described(tuple(value for value, *_ in found), float(np.median([each for _, each, _ in found])))
