"""Codes of silhouettes beside descriptors of others: ``python benchmarks/silhouettes.py``.

Each shape is a query in turn; bull's eye is the mean share of its class among the first 2C answers, the query
included. Classification is by a linear support vector machine, half of each class for training, over random
splits. Vocabularies are learnt without labels: on the shapes that are searched, means over seeds of k-means,
and on those of the other collection. Silhouettes stay on their own grids. Times are of one process, from the
shape to its code or description. Scores after re-ranking by diffusion, which looks at the whole collection,
stand in a table of their own.
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
from spem.errors import MissingExtraError, ParameterError
from spem.paper.data import Data
from spem.paper.scoring import compute_all, features_of
from spem.retrieval.classification import classify_vectors, linear_svm
from spem.retrieval.diffusion import rerank
from spem.retrieval.distances import correlation_distance
from spem.retrieval.evaluation import evaluate
from spem.rivals.elliptic_fourier import EllipticFourier
from spem.rivals.hu import Hu
from spem.rivals.protocol import Rival
from spem.rivals.zernike import Zernike
from spem.shapes.read import read
from spem.shapes.shape import Shape

COLLECTIONS = ("tari1000", "kimia216")
CODES = (
    "spem",
    "sources",
    "spem+sources",
    "shape-context",
    "inner-distance",
    "surface",
    "spem+surface",
    "auto",
)
RIVALS: tuple[Rival, ...] = (Hu(), Zernike(), EllipticFourier())
SEEDS, SPLITS, TIMED = 3, 10, 20
# So few shapes give each word of a large vocabulary to one of them.
QUICK_CLASSES, QUICK_EACH, QUICK_CENTERS = 4, 4, 16
ALONE, BULLS_EYE, ACCURACY = 85.0, 92.0, 97.0

Result = tuple[Row, NDArray[np.float64]]
Results = list[Result]


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
    results: list[Results] = [[] for _ in found]
    for word in CODES:
        try:
            n_centers = {"n_centers": QUICK_CENTERS} if benchmark.quick else {}
            settings = Settings.of({"voxels": None, "features": word} | n_centers).resolved(2)
        except ParameterError as error:
            benchmark.skip(f"{word}: {error}")
            continue
        features = [features_of(shapes.shapes, settings) for shapes in found]
        for i, shapes in enumerate(found):
            outside = features[1 - i] if len(found) == 2 else None
            results[i].append(of_code(benchmark, shapes, features[i], outside, settings, word))
    for rival in RIVALS:
        try:
            for i, shapes in enumerate(found):
                results[i].append(of_rival(benchmark, shapes, rival))
        except MissingExtraError as error:
            benchmark.skip(f"{rival.name}: {error}")
    for shapes, outcome in zip(found, results, strict=True):
        report(benchmark, shapes, outcome)
    benchmark.write()


def report(benchmark: Benchmark, shapes: Silhouettes, outcome: Results) -> None:
    """Print the scores, apart from them those after re-ranking by diffusion, and hold the best code."""
    title = f"{shapes.name}: {len(shapes.labels)} shapes, {len(set(shapes.labels))} classes"
    benchmark.table(title, [row for row, _ in outcome])
    near = QUICK_EACH - 1 if benchmark.quick else 10
    reranked = [
        {"code": row["code"]} | scored(rerank(distances, n_neighbours=near), shapes.labels)
        for row, distances in outcome
    ]
    benchmark.table(f"{title}; answers re-ranked by diffusion", reranked)
    if shapes.name == "tari1000" and not benchmark.quick:
        alone = max(row["bull's eye"] for row, _ in outcome if row["code"] in ("sources", "spem+sources"))
        benchmark.target("tari1000, hyperfield alone: bull's eye", alone, ALONE, at_least=True)
        best = next(row for row, _ in outcome if row["code"].startswith("auto"))
        benchmark.target("tari1000, auto: bull's eye", best["bull's eye"], BULLS_EYE, at_least=True)
        benchmark.target("tari1000, auto: linear SVM, percent", best["SVM"], ACCURACY, at_least=True)


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


def of_code(
    benchmark: Benchmark,
    shapes: Silhouettes,
    features: Sequence[Bands],
    outside: Sequence[Bands] | None,
    settings: Settings,
    word: str,
) -> Result:
    """Score codes with vocabularies of the shapes themselves, over seeds, and of others."""
    seeds = 1 if benchmark.quick else SEEDS
    models = [Model.fit(replace(settings, seed=seed), features, 2) for seed in range(seeds)]
    vectors = [codes(model, features) for model in models]
    distances = [correlation_distance(each, each) for each in vectors]
    rows = [scored(each, shapes.labels) for each in distances]
    row: Row = {"code": word if word == settings.features else f"{word}: {settings.features}"}
    row |= {measure: float(np.mean([r[measure] for r in rows])) for measure in rows[0]}
    if outside is not None:
        other = codes(Model.fit(settings, outside, 2), features)
        words_of_others = scored(correlation_distance(other, other), shapes.labels)
        row["bull's eye, words of others"] = words_of_others["bull's eye"]
    blocks = [part.n_code for part in models[0].parts]
    row["SVM"] = accuracy(benchmark, vectors[0], shapes.labels, blocks if len(blocks) > 1 else [])
    describe = partial(_encode, models[0], settings)
    return row | {"ms": milliseconds(describe, shapes.shapes)}, distances[0]


def of_rival(benchmark: Benchmark, shapes: Silhouettes, rival: Rival) -> Result:
    """Score a descriptor."""
    descriptions = compute_all(partial(_describe, rival=rival, shapes=shapes.shapes), shapes.shapes)
    distances = rival.compare(descriptions)
    row: Row = {"code": rival.name} | scored(distances, shapes.labels)
    row["SVM"] = accuracy(benchmark, np.asarray(descriptions), shapes.labels)
    return row | {"ms": milliseconds(rival.describe, shapes.shapes)}, distances


def codes(model: Model, features: Sequence[Bands]) -> NDArray[np.float64]:
    """Return the codes of all shapes."""
    return np.stack([model.encode(bands) for bands in features]).astype(np.float64)


def scored(distances: NDArray[np.float64], labels: Sequence[str]) -> Row:
    """Return the measures of retrieval."""
    scores = evaluate(distances, labels)
    return {measure: scores.mean()[measure] for measure in ("NN", "FT", "ST")} | {
        "bull's eye": scores.bulls_eye
    }


def accuracy(
    benchmark: Benchmark, vectors: NDArray[np.float64], labels: Sequence[str], blocks: Sequence[int] = ()
) -> float:
    """Return how many shapes are given their class, half of each class being trained on, in percent."""
    half = len(labels) // len(set(labels)) // 2
    splits = 2 if benchmark.quick else SPLITS
    machine = linear_svm(blocks)
    return classify_vectors(vectors, labels, n_train=half, repeats=splits, classifier=machine).mean


def milliseconds(describe: Callable[[Shape], Any], shapes: Sequence[Shape]) -> float:
    """Return the mean processor time a shape, over some of them, after one that is not counted."""
    sample = [shapes[i] for i in np.linspace(0, len(shapes) - 1, TIMED).astype(int)]
    describe(sample[0])
    start = time.process_time()
    for shape in sample:
        describe(shape)
    return 1e3 * (time.process_time() - start) / len(sample)


def _encode(model: Model, settings: Settings, shape: Shape) -> NDArray[np.float32]:
    """Make the code of a shape."""
    return model.encode(shape_features(shape, settings, 1))


def _describe(index: int, rival: Rival, shapes: Sequence[Shape]) -> Any:
    """Describe one shape of a collection."""
    return rival.describe(shapes[index])


if __name__ == "__main__":
    main()
