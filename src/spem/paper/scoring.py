"""Retrieval experiments: node features of a collection once, then codes and scores over seeds."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from os import cpu_count
from pathlib import Path
from typing import TypeVar

import numpy as np
from joblib import Parallel, delayed
from numpy.typing import NDArray

from spem.codes.bands import Bands
from spem.codes.kinds import shape_features
from spem.codes.model import Model
from spem.codes.settings import Settings
from spem.codes.sources import read_shapes
from spem.codes.workers import count_processes, run_all
from spem.errors import ReadError, SpemError
from spem.paper.data import Collection
from spem.retrieval.distances import correlation_distance
from spem.retrieval.evaluation import MEASURES, Scores, evaluate
from spem.shapes.creatures import creature, creature_kinds
from spem.shapes.shape import Shape

T = TypeVar("T")
_RESAMPLES = 2000


@dataclass(frozen=True)
class Features:
    """Node features of the shapes of a collection.

    Parameters
    ----------
    bands
        For each shape the maps of each band of ρ.
    labels
        Class of each shape.
    """

    bands: tuple[Bands, ...]
    labels: tuple[str, ...]

    def of(self, classes: Sequence[str]) -> list[Bands]:
        """Return the features of the shapes of some classes."""
        return [bands for bands, label in zip(self.bands, self.labels, strict=True) if label in classes]

    def first(self, n_maps: int) -> Features:
        """Return the first maps of each shape; those of fewer maps are the first of more."""
        return replace(self, bands=tuple(tuple(maps[:, :n_maps] for maps in each) for each in self.bands))


@dataclass(frozen=True)
class Repeated:
    """Scores over the seeds of a vocabulary, in percent.

    Parameters
    ----------
    mean, deviation
        Measure → mean over seeds, standard deviation over seeds.
    class_error
        Standard error of the mean FT under another draw of classes.
    scores
        Scores of each seed.
    matrices
        ``(n, n)`` distances of each seed.
    """

    mean: dict[str, float]
    deviation: dict[str, float]
    class_error: float
    scores: tuple[Scores, ...]
    matrices: tuple[NDArray[np.float64], ...]

    @property
    def distances(self) -> NDArray[np.float64]:
        """``(n, n)`` distances of the first seed."""
        return self.matrices[0]

    def row(self) -> list[str]:
        """Return the five measures with one decimal."""
        return [f"{self.mean[measure]:.1f}" for measure in MEASURES]

    def hardest(self, count: int = 3) -> str:
        """Name the classes of the least first tier, with it."""
        tiers = sorted((score["FT"], str(label)) for label, score in self.scores[0].per_class().items())
        return ", ".join(f"{label} {tier:.0f}" for tier, label in tiers[:count])

    def to_json(self) -> dict[str, object]:
        """Return means, deviations and the error by classes."""
        return {"mean": self.mean, "deviation": self.deviation, "class_error_FT": self.class_error}


def collect(collection: Collection, settings: Settings) -> Features:
    """Compute the node features of every shape of a collection, on all cores.

    Raises
    ------
    ReadError
        If a shape gives none.
    """
    return Features(features_of(collection.items, settings), collection.labels)


def features_of(items: Sequence[Path | Shape], settings: Settings) -> tuple[Bands, ...]:
    """Compute the node features of shapes and files, on all cores.

    Raises
    ------
    ReadError
        If a shape gives none.
    """
    return tuple(compute_all(partial(_features, items=tuple(items), settings=settings), items))


def compute_all(work: Callable[[int], T], items: Sequence[Path | Shape]) -> list[T]:
    """Compute something of every item, on all cores.

    Parameters
    ----------
    work
        Function of a module; takes the number of an item.
    items
        Shapes and files, named where one fails.

    Raises
    ------
    ReadError
        If an item gives nothing.

    Examples
    --------
    >>> from spem.shapes.synthetic import disk
    >>> compute_all(float, [disk(2.0, 1.0), disk(3.0, 1.0)])
    [0.0, 1.0]
    """
    found: dict[int, T] = {}
    for index, made, reason in run_all(work, range(len(items)), count_processes(len(items))):
        if made is None:
            msg = f"{items[index]}: no features ({reason}); mend the file or take it out of the collection"
            raise ReadError(msg)
        found[index] = made
    return [found[index] for index in range(len(items))]


def creature_features(ndim: int, each: int, settings: Settings) -> tuple[Bands, ...]:
    """Compute the features of articulated creatures, to learn an outside vocabulary of."""
    rng = np.random.default_rng(1)
    kinds = [kind for kind in creature_kinds() for _ in range(each)]
    return features_of(
        [creature(kind, ndim=ndim, voxels=settings.voxels, rng=rng) for kind in kinds], settings
    )


def repeat(
    features: Features,
    settings: Settings,
    seeds: int,
    training: Callable[[int], Sequence[Bands]] | None = None,
) -> Repeated:
    """Score one kind of code over the seeds of its vocabulary.

    Parameters
    ----------
    features
        What is searched.
    settings
        The code.
    seeds
        Number of vocabularies.
    training
        Seed → features to learn the vocabulary of; those that are searched by default.
    """
    learnt = training or (lambda _: features.bands)
    jobs = (
        delayed(_distances)(features.bands, list(learnt(seed)), replace(settings, seed=seed))
        for seed in range(seeds)
    )
    # Threads: the kernels of k-means and of the codes leave the interpreter's lock.
    matrices = Parallel(n_jobs=min(cpu_count() or 1, seeds), prefer="threads")(jobs)
    return summarise(matrices, features.labels)


def summarise(matrices: Sequence[NDArray[np.float64]], labels: Sequence[str]) -> Repeated:
    """Score distance matrices, one a seed."""
    found = [evaluate(matrix, labels) for matrix in matrices]
    values = np.array([[scores.mean()[measure] for measure in MEASURES] for scores in found])
    spread = values.std(axis=0, ddof=1) if len(found) > 1 else np.zeros(len(MEASURES))
    return Repeated(
        dict(zip(MEASURES, values.mean(axis=0).tolist(), strict=True)),
        dict(zip(MEASURES, spread.tolist(), strict=True)),
        class_error(found),
        tuple(found),
        tuple(matrices),
    )


def class_error(found: Sequence[Scores]) -> float:
    """Return the standard error of the mean FT under another draw of classes."""
    per_class = np.mean([[entry["FT"] for entry in s.per_class().values()] for s in found], axis=0)
    rng = np.random.default_rng(0)
    return float(rng.choice(per_class, (_RESAMPLES, per_class.size)).mean(axis=1).std())


def half_of_classes(features: Features, seed: int) -> list[Bands]:
    """Return the features of a random half of the classes."""
    classes = sorted(set(features.labels))
    return features.of(np.random.default_rng(seed).permutation(classes)[: len(classes) // 2].tolist())


def _distances(bands: Sequence[Bands], training: Sequence[Bands], settings: Settings) -> NDArray[np.float64]:
    """Learn a vocabulary, encode and compare."""
    model = Model.fit(settings, training)
    vectors = np.stack([model.encode(each) for each in bands])
    return correlation_distance(vectors, vectors)


def _features(index: int, items: Sequence[Path | Shape], settings: Settings) -> Bands:
    """Compute the features of one shape."""
    ((_, shape),) = read_shapes(items[index], settings)
    if isinstance(shape, SpemError):
        raise shape
    return shape_features(shape, settings)
