"""Codes of silhouettes beside descriptors of others: ``python benchmarks/silhouettes.py``.

Each shape is a query in turn; bull's eye is the mean share of its class among the first 2C answers, the query
included. Classification is by a linear support vector machine, half of each class for training, over random
splits. Vocabularies are learnt without labels: on the shapes that are searched, means over seeds of k-means,
and on those of the other collection. Silhouettes stay on their own grids. Times are of one process, from the
shape to its code or description.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from _table import Benchmark, Row, data_root
from spem.codes.bands import Bands
from spem.codes.kinds import shape_features
from spem.codes.model import Model
from spem.codes.settings import Settings
from spem.errors import ParameterError
from spem.paper.data import Data
from spem.paper.scoring import compute_all, features_of
from spem.retrieval.classification import classify_vectors, linear_svm
from spem.retrieval.distances import correlation_distance
from spem.retrieval.evaluation import evaluate
from spem.rivals.elliptic_fourier import EllipticFourier
from spem.rivals.extra import MissingExtraError
from spem.rivals.hu import Hu
from spem.rivals.protocol import Rival
from spem.rivals.zernike import Zernike
from spem.shapes.read import read
from spem.shapes.shape import Shape

COLLECTIONS = ("tari1000", "kimia216")
CODES = ("spem", "sources", "shape-context", "inner-distance", "spem+inner-distance", "auto")
RIVALS: tuple[Rival, ...] = (Hu(), Zernike(), EllipticFourier())
SEEDS, SPLITS, TIMED = 3, 10, 20
QUICK_CLASSES, QUICK_EACH = 4, 4
BULLS_EYE, ACCURACY = 92.0, 97.0


@dataclass(frozen=True)
class Silhouettes:
    """Silhouettes of a collection and their classes."""

    name: str
    shapes: tuple[Shape, ...]
    labels: tuple[str, ...]


def main(argv: list[str] | None = None) -> None:
    benchmark = Benchmark("silhouettes", str(__doc__).splitlines()[0], argv)
    found = [
        shapes for name in COLLECTIONS if (shapes := silhouettes(benchmark, name, quick=benchmark.quick))
    ]
    tables: dict[str, list[Row]] = {shapes.name: [] for shapes in found}
    for word in CODES:
        try:
            settings = Settings(voxels=None, features=word).resolved(2)
        except ParameterError as error:
            benchmark.skip(f"{word}: {error}")
            continue
        features = [features_of(shapes.shapes, settings) for shapes in found]
        for i, shapes in enumerate(found):
            outside = features[1 - i] if len(found) == 2 else None
            tables[shapes.name].append(code_row(benchmark, shapes, features[i], outside, settings, word))
    for rival in RIVALS:
        for shapes in found:
            try:
                tables[shapes.name].append(rival_row(benchmark, shapes, rival))
            except MissingExtraError as error:
                benchmark.skip(f"{rival.name}: {error}")
                break
    for shapes in found:
        title = f"{shapes.name}: {len(shapes.labels)} shapes, {len(set(shapes.labels))} classes"
        benchmark.table(title, tables[shapes.name])
    hold(benchmark, tables)
    benchmark.write()


def silhouettes(benchmark: Benchmark, name: str, *, quick: bool) -> Silhouettes | None:
    """Read a collection, or a few classes of it, on its own grids; None where it is absent."""
    root = data_root()
    if root is None or not (root / name / "labels.csv").is_file():
        benchmark.skip(f"{name}: no labels.csv under SPEM_DATA")
        return None
    listed = Data(root).collection(name, ndim=2, per_class=QUICK_EACH if quick else None)
    chosen = list(dict.fromkeys(listed.labels))[: QUICK_CLASSES if quick else None]
    kept = [pair for pair in zip(listed.items, listed.labels, strict=True) if pair[1] in chosen]
    paths, labels = zip(*kept, strict=True)
    return Silhouettes(name, tuple(read(path, voxels=None) for path in paths), labels)


def code_row(
    benchmark: Benchmark,
    shapes: Silhouettes,
    features: Sequence[Bands],
    outside: Sequence[Bands] | None,
    settings: Settings,
    word: str,
) -> Row:
    """Score codes with vocabularies of the shapes themselves, over seeds, and of others."""
    seeds = 1 if benchmark.quick else SEEDS
    models = [Model.fit(replace(settings, seed=seed), features, 2) for seed in range(seeds)]
    vectors = [codes(model, features) for model in models]
    rows = [scored(correlation_distance(each, each), shapes.labels) for each in vectors]
    row: Row = {"code": word if word == settings.features else f"{word}: {settings.features}"}
    row |= {measure: float(np.mean([r[measure] for r in rows])) for measure in rows[0]}
    if outside is not None:
        other = codes(Model.fit(settings, outside, 2), features)
        row["bull's eye, words of others"] = scored(correlation_distance(other, other), shapes.labels)[
            "bull's eye"
        ]
    row["SVM"] = accuracy(benchmark, vectors[0], shapes.labels)
    describe = partial(_encode, models[0], settings)
    return row | {"ms": milliseconds(describe, shapes.shapes)}


def rival_row(benchmark: Benchmark, shapes: Silhouettes, rival: Rival) -> Row:
    """Score a descriptor."""
    descriptions = compute_all(partial(_describe, rival=rival, shapes=shapes.shapes), shapes.shapes)
    row: Row = {"code": rival.name} | scored(rival.compare(descriptions), shapes.labels)
    row["SVM"] = accuracy(benchmark, np.asarray(descriptions), shapes.labels)
    return row | {"ms": milliseconds(rival.describe, shapes.shapes)}


def codes(model: Model, features: Sequence[Bands]) -> NDArray[np.float64]:
    """Return the codes of all shapes."""
    return np.stack([model.encode(bands) for bands in features]).astype(np.float64)


def scored(distances: NDArray[np.float64], labels: Sequence[str]) -> Row:
    """Return the measures of retrieval."""
    scores = evaluate(distances, labels)
    return {measure: scores.mean()[measure] for measure in ("NN", "FT", "ST")} | {
        "bull's eye": scores.bulls_eye
    }


def accuracy(benchmark: Benchmark, vectors: NDArray[np.float64], labels: Sequence[str]) -> float:
    """Return how many shapes are given their class, half of each class being trained on, in percent."""
    half = len(labels) // len(set(labels)) // 2
    splits = 2 if benchmark.quick else SPLITS
    return classify_vectors(vectors, labels, n_train=half, repeats=splits, classifier=linear_svm()).mean


def milliseconds(describe: Callable[[Shape], Any], shapes: Sequence[Shape]) -> float:
    """Return the mean processor time a shape, over some of them, after one that is not counted."""
    sample = [shapes[i] for i in np.linspace(0, len(shapes) - 1, TIMED).astype(int)]
    describe(sample[0])
    start = time.process_time()
    for shape in sample:
        describe(shape)
    return 1e3 * (time.process_time() - start) / len(sample)


def hold(benchmark: Benchmark, tables: dict[str, list[Row]]) -> None:
    """Hold the best code against its targets."""
    rows = {row["code"].partition(":")[0]: row for row in tables.get("tari1000", [])}
    if benchmark.quick or "auto" not in rows:
        return
    best = rows["auto"]
    benchmark.target("tari1000, auto: bull's eye", best["bull's eye"], BULLS_EYE, at_least=True)
    benchmark.target("tari1000, auto: linear SVM, percent", best["SVM"], ACCURACY, at_least=True)


def _encode(model: Model, settings: Settings, shape: Shape) -> NDArray[np.float32]:
    """Make the code of a shape."""
    return model.encode(shape_features(shape, settings, 1))


def _describe(index: int, rival: Rival, shapes: Sequence[Shape]) -> Any:
    """Describe one shape of a collection."""
    return rival.describe(shapes[index])


if __name__ == "__main__":
    main()
