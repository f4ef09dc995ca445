"""The view "words": why two shapes are alike, and where in each of them the reasons lie."""

from __future__ import annotations

import itertools
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spem.codes.kinds import shape_features
from spem.codes.model import Model
from spem.codes.positions import feature_positions
from spem.codes.traits import TRAITS
from spem.codes.words import Word, explain, speaking_rows
from spem.index.row import unpack
from spem.server.arrays import pack_arrays, unpack_arrays
from spem.server.views.options import Options, Reply, shown_shape, whole_option
from spem.server.views.outline import grid_units
from spem.shapes.shape import Shape

_WORDS, _MOST_WORDS = 4, 32
_POINTS, _MOST_POINTS = 200, 5_000


def view_words(query: Shape, answer: Shape, model: Model, options: Options) -> Reply:
    """Return the visual words that bring most to the correlation of two shapes' codes, and where they lie.

    Parameters
    ----------
    query, answer
        The shapes, on the grids that they were coded on.
    model
        The model of their codes.
    options
        ``n``, the number of words, 4 by default; ``n_points``, the most points of a word on each shape, 200
        by default; ``max_nodes``, as for the view of the geometry.

    Returns
    -------
    header
        ``correlation`` of the codes; ``kinds``, for each the ``share`` of the correlation that it has and
        the ``weight``, which is the most it could have; ``n_words``, of how many there are; and ``words``:
        ``kind``, ``of`` (what such features are of), ``band``, ``level``, ``word`` (number of the centre),
        ``share``, and where its points stand: ``query`` and ``answer`` as ``[start, stop]``.
    arrays
        ``query_points`` and ``answer_points`` ``(p, d)``, in indices of the grid of the view of the geometry;
        of each word those first that say most.

    Raises
    ------
    ModelError
        When a shape is of another dimension than the model's.

    Examples
    --------
    >>> from spem.codes.collection import encode_collection
    >>> from spem.codes.settings import Settings
    >>> from spem.shapes.synthetic import disk, star_polygon
    >>> shapes = [disk(radius=9.0, spacing=1.0), star_polygon(5, 2)]
    >>> model = encode_collection(shapes, Settings(features="spem", voxels=None, n_centers=8)).model
    >>> header, arrays = view_words(shapes[0], shapes[0], model, {"n": 3})
    >>> round(header["correlation"], 3), len(header["words"]), arrays["query_points"].shape[1]
    (1.0, 3, 2)
    """
    count = whole_option(options, "n", _WORDS, 1, _MOST_WORDS)
    most = whole_option(options, "n_points", _POINTS, 1, _MOST_POINTS)
    shapes = (query, answer)
    for shape in shapes:
        model.require_ndim(shape.ndim, shape.name)
    features = [shape_features(shape, model.settings) for shape in shapes]
    codes = [model.encode(bands, shape.name) for bands, shape in zip(features, shapes, strict=True)]
    words = explain(model, *codes)
    listed = words[:count]
    places: list[list[list[int]]] = []
    arrays: dict[str, NDArray[Any]] = {}
    sides = zip(("query_points", "answer_points"), shapes, features, reversed(codes), strict=True)
    for name, shape, bands, other in sides:
        rows = speaking_rows(model, listed, bands, other, most)
        groups = _positions(shape, model, listed, rows, options)
        ends = np.cumsum([0, *map(len, groups)]).tolist()
        places.append([[start, stop] for start, stop in itertools.pairwise(ends)])
        arrays[name] = np.concatenate(groups).astype(np.float32)
    header = {
        "correlation": sum(word.share for word in words),
        "kinds": _kinds(model, words),
        "n_words": len(words),
        "words": [
            {**_told(word), "query": here, "answer": there}
            for word, here, there in zip(listed, *places, strict=True)
        ],
    }
    return header, arrays


def pack_pair(query: bytes, answer: bytes) -> bytes:
    """Return two packed shapes as one body.

    Examples
    --------
    >>> from spem.index.row import pack
    >>> one, two = (Shape.from_mask(np.ones((n, 3)), name=f"slab {n}") for n in (2, 4))
    >>> [shape.name for shape in unpack_pair(pack_pair(pack(one), pack(two)))]
    ['slab 2', 'slab 4']
    """
    arrays = {"query": np.frombuffer(query, np.uint8), "answer": np.frombuffer(answer, np.uint8)}
    return pack_arrays({}, arrays)


def unpack_pair(body: bytes) -> tuple[Shape, Shape]:
    """Return the shapes that `pack_pair` made a body of.

    Raises
    ------
    ReadError
        When the body is no such thing, or a shape is damaged.
    """
    _, arrays = unpack_arrays(body)
    return unpack(arrays["query"].tobytes()), unpack(arrays["answer"].tobytes())


def kind_of(kind: str) -> str:
    """Say what features of a kind are of, in words that stand alone.

    Examples
    --------
    >>> kind_of("inner-distance")
    'what each point of the contour sees, along ways inside'
    """
    text, same = "", "the same"
    for name, traits in TRAITS.items():
        text = text.split(",")[0] + traits.of.removeprefix(same) if traits.of.startswith(same) else traits.of
        if name == kind:
            break
    return text


def _positions(
    shape: Shape, model: Model, words: list[Word], rows: list[NDArray[np.int64]], options: Options
) -> list[NDArray[np.float64]]:
    """Return the places of rows of features for each word, each place once, in indices of the shown grid."""
    shown = shown_shape(shape, options)
    known: dict[int, NDArray[np.float64]] = {}
    groups = []
    for word, own in zip(words, rows, strict=True):
        if word.part not in known:
            settings = model.parts[word.part].settings
            known[word.part] = grid_units(shown, feature_positions(shape, settings))
        places = known[word.part][own]
        # a row and its mirror image lie at one place
        _, first = np.unique(places, axis=0, return_index=True)
        groups.append(places[np.sort(first)])
    return groups


def _kinds(model: Model, words: list[Word]) -> list[dict[str, Any]]:
    """Return what each kind of features brings to the correlation, and the most that it could bring."""
    total = sum(model.weights)
    return [
        {
            "kind": part.settings.features,
            "of": kind_of(part.settings.features),
            "share": sum(word.share for word in words if word.part == number),
            "weight": weight / total,
        }
        for number, (part, weight) in enumerate(zip(model.parts, model.weights, strict=True))
    ]


def _told(word: Word) -> dict[str, Any]:
    """Return a word as JSON has it."""
    return {
        "kind": word.kind,
        "of": kind_of(word.kind),
        "band": word.band,
        "level": word.level,
        "word": word.center,
        "share": word.share,
    }
