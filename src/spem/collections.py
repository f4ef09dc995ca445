"""The facade of collections: codes of files, ranked answers, scores."""

from __future__ import annotations

from collections.abc import Hashable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from spem.codes.batches import require_device
from spem.codes.codes import Codes
from spem.codes.collection import encode_collection, encode_file
from spem.codes.model import Model
from spem.codes.settings import Settings
from spem.codes.sources import as_source, find_files, source_hash
from spem.errors import LabelError, ParameterError, ReadError, require_kind
from spem.fields.solvers.engine import Backend
from spem.retrieval.classification import Classification, classify_vectors
from spem.retrieval.distances import correlation_distance
from spem.retrieval.evaluation import Scores
from spem.retrieval.evaluation import evaluate as evaluate_distances
from spem.retrieval.labels import labelled, match_labels, read_labels
from spem.retrieval.ranking import Answer, rank
from spem.retrieval.sizes import of_one_size
from spem.shapes.shape import Shape


def encode(
    sources: str | Path | Shape | Sequence[str | Path | Shape],
    *,
    settings: Settings | None = None,
    model: Model | None = None,
    n_jobs: int = 1,
    work: str | Path | None = None,
    device: Backend | None = None,
    **options: Any,
) -> Codes:
    """Make the codes of a collection: fields, maps, a vocabulary, VLAD (5.5).

    Parameters
    ----------
    sources
        Files, folders, patterns, shapes, or one of them.
    settings
        How a shape becomes a code.
    model
        The model of other codes, whose vocabulary and settings are used.
    n_jobs
        Number of processes.
    work
        Folder from which an interrupted call goes on; delete it when the codes are saved.
    device
        Where to sweep shapes, in batches, such as ``spem.Cuda()``; the processor when None.
    **options
        Settings by name, in place of `settings`.

    Returns
    -------
    Codes
        One row a shape; files that gave none are its ``failures``.

    Raises
    ------
    ReadError
        When no source gave a shape; it carries the failures.
    ParameterError
        When there is no source, or a setting is out of its range or unknown.

    Examples
    --------
    >>> import spem
    >>> shapes = [spem.synthetic.disk(radius=r, spacing=1.0) for r in (8.0, 9.0)]
    >>> len(spem.encode(shapes, voxels=None, n_centers=8))
    2
    """
    if options and (settings is not None or model is not None):
        msg = f"{', '.join(options)}: a model or settings were given too; give one or the other"
        raise ParameterError(msg)
    if model is not None:
        require_kind(model, Model, "give the model of codes: codes.model")
    chosen = Settings.of(options) if options else settings
    given = [sources] if isinstance(sources, (str, Path, Shape)) else list(sources)
    listed: list[str | Path | Shape] = []
    for source in given:
        listed.extend([source] if isinstance(source, Shape) else find_files([source]))
    return encode_collection(listed, chosen, model=model, n_jobs=n_jobs, work=work, device=device)


def search(
    codes: Codes | str | Path,
    query: str | Path | Shape,
    k: int | None = 10,
    *,
    device: Backend | None = None,
) -> list[Answer]:
    """Rank the shapes of a collection by their distance to a query.

    Parameters
    ----------
    codes
        Codes, or the file that holds them.
    query
        A file or a shape, coded with the model of the codes unless it is one of the collection;
        or the name or path of a shape of the collection.
    k
        Number of answers; all with None.
    device
        Where to sweep the query; the processor when None.

    Returns
    -------
    list of Answer
        Nearest first; a query of the collection finds itself.

    Raises
    ------
    SpemError
        When the codes or the query cannot be read.

    Examples
    --------
    >>> import spem
    >>> shapes = [spem.synthetic.disk(radius=8.0, spacing=1.0), spem.synthetic.star_polygon(5, 2)]
    >>> codes = spem.encode(shapes, voxels=None, n_centers=8)
    >>> spem.search(codes, shapes[0])[0].name
    'disk'
    """
    collection = codes if isinstance(codes, Codes) else Codes.load(codes)
    if device is not None:
        require_device(device)
    row = _row(collection, query)
    vector = encode_file(query, collection.model, device=device) if row is None else collection.vectors[row]
    return rank(vector, collection, k)


def evaluate(
    codes: Codes | ArrayLike | str | Path,
    labels: str | Path | Mapping[str, str] | Sequence[Hashable],
    *,
    matched_size: float | None = None,
    ignore_unlabelled: bool = False,
) -> Scores:
    """Score a collection: each shape is a query in turn, those of its class are to be found.

    Parameters
    ----------
    codes
        Codes, or the file that holds them; or ``(n, n)`` distances of any kind, queries along the rows, with
        one label each.
    labels
        A labels file, a mapping of files to labels, or one label for each row of the codes. The shapes of
        a label volume are looked up by their names, such as ``"teeth-3"``.
    matched_size
        Compare shapes of one size only: volumes at most this many times each other. What size alone would
        score is told by ``spem.evaluate(spem.size_distance(codes.volumes), labels)``.
    ignore_unlabelled
        Leave out shapes that a file or mapping has no label for.

    Raises
    ------
    LabelError
        When a shape has no label, or no class has two shapes.
    ParameterError
        When distances and labels do not fit, or sizes are to be matched that are not known.

    Examples
    --------
    >>> import spem
    >>> shapes = [spem.synthetic.disk(radius=r, spacing=1.0) for r in (8.0, 9.0, 10.0)]
    >>> codes = spem.encode(shapes, voxels=None, n_centers=8)
    >>> spem.evaluate(codes, ["disk", "disk", "disk"]).mean()["NN"]
    100.0
    """
    if not isinstance(codes, (Codes, str, Path)):
        if matched_size is not None:
            msg = "matched_size: distances have no sizes; give codes"
            raise ParameterError(msg)
        return evaluate_distances(codes, _listed(labels, "distances"))
    collection, classes = _with_classes(codes, labels, ignore_unlabelled=ignore_unlabelled)
    candidates = None if matched_size is None else of_one_size(collection.volumes, matched_size)
    distances = correlation_distance(collection.vectors, collection.vectors)
    return evaluate_distances(distances, classes, candidates=candidates)


def classify(
    codes: Codes | ArrayLike | str | Path,
    labels: str | Path | Mapping[str, str] | Sequence[Hashable],
    *,
    n_train: int = 10,
    repeats: int = 10,
    classifier: Any = None,
    ignore_unlabelled: bool = False,
    rng: np.random.Generator | None = None,
) -> Classification:
    """Train a classifier on some shapes of each class and test it on the others, several times.

    Parameters
    ----------
    codes
        Codes, or the file that holds them; or ``(n_shapes, n_code)`` vectors of any kind, with one label
        each.
    labels, ignore_unlabelled
        As for `evaluate`.
    n_train
        Number of shapes drawn from each class for training; all others are tests.
    repeats
        Number of splits.
    classifier
        A classifier of scikit-learn; by default a linear support vector machine on standardised entries.
    rng
        Draws the splits; seed 0 by default.

    Returns
    -------
    Classification
        Mean and deviation of the accuracy, accuracy of each class, what was taken for what.

    Raises
    ------
    LabelError
        When a shape has no label, there are fewer than two classes, or one has no shape left to test.
    ParameterError
        When vectors and labels do not fit, or a number is below 1.

    Examples
    --------
    >>> import numpy as np, spem
    >>> rng = np.random.default_rng(0)
    >>> pairs = spem.creatures.collection(n_per_class=3, kinds=["fish", "hand"], voxels=800, rng=rng)
    >>> shapes, kinds = zip(*pairs)
    >>> found = spem.classify(spem.encode(shapes, voxels=None), kinds, n_train=2, repeats=20)
    >>> found.classes, found.accuracies.size, found.mean > 50
    (('fish', 'hand'), 20, True)
    """
    if isinstance(codes, (Codes, str, Path)):
        collection, classes = _with_classes(codes, labels, ignore_unlabelled=ignore_unlabelled)
        vectors: ArrayLike = collection.vectors
    else:
        vectors, classes = codes, _listed(labels, "vectors")
    return classify_vectors(
        vectors, classes, n_train=n_train, repeats=repeats, classifier=classifier, rng=rng
    )


def row_keys(codes: Codes) -> list[str]:
    """Return what labels are looked up by: the path of each shape, its name where a file holds several.

    Examples
    --------
    >>> import spem
    >>> row_keys(spem.encode(spem.synthetic.disk(radius=8.0, spacing=1.0), voxels=None, n_centers=8))
    ['disk']
    """
    held: dict[str, set[str]] = {}
    for name, path in zip(codes.names, codes.paths, strict=True):
        held.setdefault(path, set()).add(name)
    return [
        path if len(held[path]) == 1 else name for name, path in zip(codes.names, codes.paths, strict=True)
    ]


def _listed(labels: str | Path | Mapping[str, str] | Sequence[Hashable], what: str) -> list[Hashable]:
    """Return one label for each row of an array, which has no names."""
    if isinstance(labels, (str, Path, Mapping)):
        msg = f"{what} have no names to look labels up by; give one label for each, or codes"
        raise LabelError(msg)
    return list(labels)


def _with_classes(
    codes: Codes | str | Path,
    labels: str | Path | Mapping[str, str] | Sequence[Hashable],
    *,
    ignore_unlabelled: bool,
) -> tuple[Codes, list[Hashable]]:
    """Return codes and the class of each, without those that have none where these are to be ignored."""
    collection = codes if isinstance(codes, Codes) else Codes.load(codes)
    if isinstance(labels, (str, Path)):
        labels = read_labels(labels)
    if ignore_unlabelled and isinstance(labels, Mapping):
        collection = collection.take(labelled(row_keys(collection), labels))
    keys = row_keys(collection)
    classes: list[Hashable] = [*match_labels(keys, labels)] if isinstance(labels, Mapping) else list(labels)
    if len(classes) != len(collection):
        msg = f"{len(classes)} labels for {len(collection)} shapes; give one for each row of the codes"
        raise LabelError(msg)
    return collection, classes


def _row(codes: Codes, query: str | Path | Shape) -> int | None:
    """Find a query among the shapes of the codes: by content, or by path or name where it is no file."""
    source = as_source(query)
    if isinstance(source, Path) and not source.is_file():
        pairs = zip(codes.names, codes.paths, strict=True)
        rows = [i for i, pair in enumerate(pairs) if str(query) in pair]
        if len(rows) == 1:
            return rows[0]
        reason = f"{len(rows)} shapes of the codes have that name" if rows else "no such file or coded shape"
        msg = f"{query}: {reason}; give a file, or the name of one shape of the codes"
        raise ReadError(msg)
    key = source_hash(source)
    rows = [i for i, known in enumerate(codes.hashes) if known == key]
    single = len({codes.names[i] for i in rows if codes.paths[i] == codes.paths[rows[0]]}) == 1
    return rows[0] if rows and single else None
