"""Classification experiments: vectors of a collection, and how often its shapes are given their class."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from spem.codes.bands import Bands
from spem.codes.model import Model
from spem.codes.moments import NodalMoments
from spem.codes.settings import Settings
from spem.embedding.maps import Maps
from spem.paper.data import Collection, duplicate_names
from spem.paper.moments import hyperfields, maps_over
from spem.paper.scoring import creature_features, features_of
from spem.retrieval.classification import Classification, classify_vectors, linear_svm
from spem.shapes.creatures import collection as creature_collection
from spem.shapes.shape import Shape

# Images of 128 x 128 pixels have no more to tell than 5000 nodes; of the reduced size, 1500.
PIXELS, SMALL = 5000, 1500
# Creatures of each kind, to learn vocabulary and thresholds of.
EACH = 6
MOMENTS, CODES, BOTH = "moments of nodal domains", "codes", "codes and moments"
TEN, SIXTEEN = "meshes, 10 for training", "meshes, 16 for training"


def classify_silhouettes(found: Collection, *, quick: bool) -> tuple[list[Shape], dict[str, Classification]]:
    """Classify silhouettes by codes, by moments of nodal domains, and by both side by side.

    Vocabulary and thresholds are learnt on creatures; where creatures stand in for the silhouettes, on these.

    Parameters
    ----------
    found
        The silhouettes.
    quick
        Whether to work in the reduced size.

    Returns
    -------
    tuple
        The silhouettes as they were read, and a classification for each kind of vector.

    Examples
    --------
    >>> from spem.paper.data import Data
    >>> pairs = Data().collection("tari1000", ndim=2, per_class=3, voxels=600)
    >>> few = Collection("few", pairs.items[:6], pairs.labels[:6], "", False)
    >>> len(classify_silhouettes(few, quick=True)[1])
    3
    """
    settings = Settings(features="spem", levels=1, voxels=PIXELS)
    settings = replace(settings, voxels=SMALL, n_centers=16) if quick else settings
    bands, fields = features_of(found.items, settings), hyperfields(found.items)
    maps = maps_over(fields)
    own = words(bands, bands, settings), NodalMoments(random_state=0).fit_transform(maps)
    codes, moments = _outside(bands, maps, settings, quick=quick) if found.real else own
    rows = {
        MOMENTS: classify((moments,), found.labels, quick=quick),
        CODES: classify((codes,), found.labels, quick=quick),
        BOTH: classify((codes, moments), found.labels, quick=quick),
    }
    if found.real:
        kept = [i for i, item in enumerate(found.items) if getattr(item, "name", "") not in duplicate_names()]
        some, labels = (codes[kept], moments[kept]), [found.labels[i] for i in kept]
        rows[f"{BOTH}, duplicates left out"] = classify(some, labels, quick=quick)
        rows[f"{BOTH}, learnt on the silhouettes"] = classify(own, found.labels, quick=quick)
    return [field.shape for field in fields], rows


def classify_meshes(found: Collection, *, quick: bool) -> dict[str, Classification]:
    """Classify meshes by their codes at the two splits of mesh networks, ten times each.

    Examples
    --------
    >>> from spem.paper.data import Data
    >>> pairs = Data().collection("shrec11", ndim=3, per_class=3, voxels=600)
    >>> few = Collection("few", pairs.items[:6], pairs.labels[:6], "", False)
    >>> list(classify_meshes(few, quick=True))
    ['meshes, 10 for training', 'meshes, 16 for training']
    """
    settings = Settings(features="spem", levels=1)
    settings = replace(settings, voxels=SMALL, n_centers=16) if quick else settings
    bands = features_of(found.items, settings)
    outside = creature_features(3, 1 if quick else EACH, settings) if found.real else bands
    codes = words(bands, outside, settings)
    rows = {
        TEN: classify((codes,), found.labels, quick=quick, repeats=10),
        SIXTEEN: classify((codes,), found.labels, quick=quick, n_train=16, repeats=10),
    }
    if found.real:
        own = words(bands, bands, settings)
        rows[f"{TEN}, learnt on the meshes"] = classify((own,), found.labels, quick=quick, repeats=10)
    return rows


def words(bands: Sequence[Bands], training: Sequence[Bands], settings: Settings) -> NDArray[np.float32]:
    """Return codes with a vocabulary learnt from the features of some shapes.

    Examples
    --------
    >>> bands = [(np.random.default_rng(seed).random((20, 8)),) for seed in range(3)]
    >>> words(bands, bands, Settings(features="spem", n_centers=4)).shape
    (3, 256)
    """
    model = Model.fit(settings, training)
    return np.stack([model.encode(each) for each in bands])


def classify(
    blocks: Sequence[NDArray[np.floating]],
    labels: Sequence[str],
    *,
    quick: bool,
    n_train: int = 10,
    repeats: int = 20,
) -> Classification:
    """Classify by vectors of one or more kinds, side by side.

    Parameters
    ----------
    blocks
        For each kind ``(n_shapes, length)`` vectors.
    labels
        Class of each shape.
    quick
        Whether four splits will do.
    n_train
        Shapes of each class for training; all but one where classes are smaller.
    repeats
        Number of splits.

    Examples
    --------
    >>> classify((np.eye(4),), ["a", "a", "b", "b"], quick=True).n_train
    1
    """
    machine = linear_svm([each.shape[1] for each in blocks]) if len(blocks) > 1 else linear_svm()
    fewest = min(list(labels).count(label) for label in set(labels))
    return classify_vectors(
        np.hstack(blocks),
        labels,
        n_train=min(n_train, fewest - 1),
        repeats=4 if quick else repeats,
        classifier=machine,
    )


def _outside(
    bands: Sequence[Bands], maps: Sequence[Maps], settings: Settings, *, quick: bool
) -> tuple[NDArray[np.floating], NDArray[np.floating]]:
    """Return codes and moments with vocabulary and thresholds of creatures."""
    pairs = creature_collection(n_per_class=1 if quick else EACH, voxels=PIXELS, rng=np.random.default_rng(1))
    shapes = [shape for shape, _ in pairs]
    learnt = NodalMoments(random_state=0).fit(maps_over(hyperfields(shapes)))
    return words(bands, features_of(shapes, settings), settings), learnt.transform(maps)
