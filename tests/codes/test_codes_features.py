"""Node features: the maps of each band from one sweep, and what they are worth in retrieval."""

from __future__ import annotations

import numpy as np
import pytest

import spem
from spem.codes.features import node_features, sweep_bands
from spem.codes.model import Model
from spem.codes.settings import Settings
from spem.embedding.maps import compute_maps
from spem.errors import ShapeError
from spem.fields.domain import surface_domain
from spem.fields.rho import sample_rho
from spem.retrieval.distances import correlation_distance
from spem.retrieval.evaluation import evaluate
from spem.retrieval.labels import read_labels
from spem.shapes.creatures import collection, creature
from spem.shapes.shape import Shape

RANGES = ((0.05, 0.15), (0.1, 0.4))


@pytest.fixture(scope="module")
def hand():
    """Return a shape without symmetry."""
    return creature("hand", voxels=2000, rng=np.random.default_rng(3))


@pytest.mark.parametrize("scheme", ["linear", "log"])
def test_bands_are_those_of_separate_sweeps(hand, scheme):
    """Bands taken from one sweep over their union are the maps of a sweep for each alone."""
    settings = Settings(features="spem", voxels=None, rho_ranges=RANGES, scheme=scheme, n_rho=20, n_maps=4)
    bands = node_features(sweep_bands(hand, settings), settings)
    for (low, high), found in zip(RANGES, bands, strict=True):
        rho = sample_rho(hand.size, low * hand.size, high * hand.size, 20, scheme)
        expected = compute_maps(spem.sweep(hand, rho, rtol=1e-8), 4).values
        np.testing.assert_allclose(found, expected, atol=1e-4)


def test_features_are_single_precision_over_all_nodes(hand):
    """By default there is one band of eight maps, of every node, in float32."""
    (found,) = node_features(sweep_bands(hand, Settings(features="spem")), Settings(features="spem"))
    assert (found.shape, found.dtype) == ((hand.n_nodes, 8), np.float32)


def test_nodes_next_to_the_boundary_are_dropped_on_request(hand):
    """Without the boundary, what is left are the rows of nodes that have no boundary edge."""
    every, some = (
        Settings(features="spem", rho_ranges=RANGES),
        Settings(features="spem", rho_ranges=RANGES, drop_boundary=True),
    )
    field = sweep_bands(hand, every)
    inner = (surface_domain(hand).neighbours < hand.n_nodes).all(axis=1)
    for whole, part in zip(node_features(field, every), node_features(field, some), strict=True):
        np.testing.assert_array_equal(part, whole[inner])


def test_a_shape_that_is_all_boundary_has_nothing_to_keep():
    """Dropping the boundary of a line of voxels says what to do."""
    line = Shape.from_mask(np.ones((9, 1)), name="line")
    settings = Settings(features="spem", drop_boundary=True)
    with pytest.raises(ShapeError, match="line: every node is next to the boundary"):
        node_features(sweep_bands(line, settings), settings)


def test_turned_or_scaled_shape_has_the_same_code(hand):
    """A quarter turn, a reflection or another unit of length moves no code."""
    settings = Settings(features="spem", voxels=None, n_centers=16)
    original = node_features(sweep_bands(hand, settings), settings)
    model = Model.fit(settings, [original])
    plain = Shape.from_mask(hand.mask)
    expected = model.encode(node_features(sweep_bands(plain, settings), settings))
    for mask, unit in ((np.rot90(hand.mask), 1.0), (hand.mask[::-1], 1.0), (hand.mask, 0.037)):
        moved = Shape.from_mask(mask, spacing=unit)
        code = model.encode(node_features(sweep_bands(moved, settings), settings))
        assert correlation_distance([code], [expected]).item() < 1e-3


def score(shapes, labels, settings):
    """Return the scores of shapes among each other."""
    features = [node_features(sweep_bands(shape, settings), settings) for shape in shapes]
    model = Model.fit(settings, features)
    codes = [model.encode(bands) for bands in features]
    return evaluate(correlation_distance(codes, codes), labels).mean()


def test_poses_of_a_creature_find_each_other():
    """Creatures of five kinds, articulated at random: nearest ones are of the same kind."""
    kinds = ["hand", "dog", "spider", "fish", "starfish"]
    pairs = collection(n_per_class=5, kinds=kinds, voxels=1500, rng=np.random.default_rng(0))
    found = score(
        [shape for shape, _ in pairs], [label for _, label in pairs], Settings(features="spem", voxels=None)
    )
    assert found["NN"] == 100
    assert found["FT"] > 95


@pytest.mark.data
def test_default_codes_retrieve_better_than_those_of_the_paper(data_dir):
    """On twelve classes of kimia216 the default codes gain twelve points of FT over those of 5.5."""
    labels = read_labels(data_dir / "kimia216" / "labels.csv")
    kept = sorted(set(labels.values()))[:12]
    files = [file for file, label in labels.items() if label in kept]
    shapes = [spem.read(data_dir / "kimia216" / file) for file in files]
    classes = [labels[file] for file in files]
    plain = {"voxels": None, "nodes_per_shape": 100}
    paper = Settings.paper(boundary="surface", drop_boundary=False, **plain)
    assert (
        score(shapes, classes, Settings(features="spem", **plain))["FT"]
        > score(shapes, classes, paper)["FT"] + 12
    )
