"""Node features of contours: roots of shares, one row a point, and what they are worth in retrieval."""

from __future__ import annotations

import numpy as np
import pytest

from spem.codes.contour_features import contour_features
from spem.codes.model import Model
from spem.codes.settings import Settings
from spem.embedding.shape_context import inner_distance_shape_context, shape_context
from spem.errors import ShapeError
from spem.retrieval.distances import correlation_distance
from spem.retrieval.evaluation import evaluate
from spem.retrieval.labels import read_labels
from spem.shapes.creatures import collection, creature
from spem.shapes.read import read
from spem.shapes.shape import Shape
from spem.shapes.synthetic import ball

KINDS = pytest.mark.parametrize("kind", ["shape-context", "inner-distance"])


@pytest.fixture(scope="module")
def creatures():
    """Return silhouettes of all kinds of creatures, three each, with their kinds."""
    return collection(n_per_class=3, ndim=2, voxels=500, rng=np.random.default_rng(0))


@KINDS
def test_features_are_roots_of_the_shares(kind):
    """By default 128 points and their mirror images have 64 values each, whose squares add up to one."""
    hand = creature("hand", ndim=2, voxels=1500, rng=np.random.default_rng(3))
    (found,) = contour_features(hand, Settings(features=kind))
    context = shape_context if kind == "shape-context" else inner_distance_shape_context
    assert (found.shape, found.dtype) == ((256, 64), np.float32)
    np.testing.assert_allclose(np.square(found[:128]), context(hand), atol=1e-6)
    (outer,) = contour_features(hand, Settings(features=kind, boundary="voxel"))
    np.testing.assert_allclose(np.square(outer[:128]), context(hand, boundary="voxel"), atol=1e-6)


@KINDS
def test_mirror_images_have_the_features_of_the_shape(kind):
    """Each row of a hand has its like among those of its mirror image, but for where points start."""
    hand = Shape.from_mask(creature("hand", ndim=2, voxels=2500, rng=np.random.default_rng(3)).mask)
    turned = Shape.from_mask(hand.mask[::-1])
    (one,), (two,) = (contour_features(shape, Settings(features=kind)) for shape in (hand, turned))
    to_own = np.linalg.norm(one[:128, None] - two[None, :128], axis=2).min(axis=1).mean()
    to_mirrored = np.linalg.norm(one[:128, None] - two[None, 128:], axis=2).min(axis=1).mean()
    assert to_mirrored < 0.6 * to_own
    means = [np.sort(features.mean(axis=0)) for features in (one, two)]
    np.testing.assert_allclose(*means, atol=0.01)


@KINDS
def test_solids_have_none(kind):
    """A solid has no contours."""
    with pytest.raises(ShapeError, match="3-D shape has no contours"):
        contour_features(ball(1.0, 0.25), Settings(features=kind))


@KINDS
def test_codes_do_not_change_with_the_number_of_pixels(kind):
    """A hand of four times as many pixels has nearly the same features."""
    small, large = (creature("hand", ndim=2, voxels=n, rng=np.random.default_rng(3)) for n in (1500, 6000))
    first, second = (
        contour_features(hand, Settings(features=kind))[0].mean(axis=0) for hand in (small, large)
    )
    assert np.abs(first - second).max() < 0.02


@KINDS
def test_creatures_are_found_by_their_contours(kind, creatures):
    """With words learnt of them, most creatures are next to one of their kind."""
    settings = Settings(features=kind, n_centers=16)
    bands = [contour_features(shape, settings) for shape, _ in creatures]
    model = Model.fit(settings, bands)
    vectors = np.stack([model.encode(each) for each in bands])
    scores = evaluate(correlation_distance(vectors, vectors), [label for _, label in creatures])
    assert scores.mean()["NN"] > 80


@pytest.mark.data
def test_real_silhouettes_are_found_by_their_contours(data_dir):
    """Of eight kinds of kimia216, five each, hardly a silhouette is next to one of another kind."""
    folder = data_dir / "kimia216"
    chosen: dict[str, list[str]] = {}
    for file, label in read_labels(folder / "labels.csv").items():
        chosen.setdefault(label, []).append(file)
    kept = [(file, label) for label in sorted(chosen)[:8] for file in chosen[label][:5]]
    settings = Settings(features="inner-distance", n_centers=32)
    bands = [contour_features(read(folder / file, voxels=None), settings) for file, _ in kept]
    model = Model.fit(settings, bands)
    vectors = np.stack([model.encode(each) for each in bands])
    scores = evaluate(correlation_distance(vectors, vectors), [label for _, label in kept])
    assert scores.mean()["NN"] >= 98
    assert scores.bulls_eye >= 92
