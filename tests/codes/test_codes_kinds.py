"""Kinds of node features: what each gives, and the same way through vocabulary, codes and files for all."""

from __future__ import annotations

import numpy as np
import pytest

import spem
from spem.codes.collection import encode_file
from spem.codes.features import node_features, sweep_bands
from spem.codes.kinds import KINDS, shape_features
from spem.codes.settings import Settings
from spem.codes.spectral import shape_spectrum, spectral_features
from spem.codes.traits import TRAITS
from spem.embedding.signatures import heat_kernel_signature, scale_invariant_signature, shared_times
from spem.errors import ParameterError, ShapeError
from spem.fields.domain import surface_domain
from spem.shapes.creatures import collection, creature
from spem.shapes.shape import Shape

SPECTRAL = ["hks", "si-hks", "wks"]


@pytest.fixture(scope="module")
def hand():
    """Return a shape without symmetry."""
    return creature("hand", voxels=900, rng=np.random.default_rng(3))


def test_every_kind_has_a_row():
    """Words, settings and functions of the kinds are told in one order."""
    assert tuple(KINDS) == tuple(TRAITS)


def test_spem_is_what_it_was(hand):
    """The default kind are the maps of the sweep."""
    settings = Settings(features="spem", n_maps=5)
    (expected,) = node_features(sweep_bands(hand, settings), settings)
    np.testing.assert_array_equal(shape_features(hand, settings)[0], expected)


@pytest.mark.parametrize("kind", SPECTRAL)
def test_signatures_are_one_band_in_single_precision(hand, kind):
    """With as many values as are asked for, from one spectrum or each from its own, and off the boundary."""
    settings = Settings(features=kind, n_maps=11, n_pairs=40)
    (found,) = shape_features(hand, settings)
    assert (found.shape, found.dtype) == ((hand.n_nodes, 11), np.float32)
    np.testing.assert_array_equal(spectral_features(shape_spectrum(hand, settings), settings)[0], found)
    inner = (surface_domain(hand).neighbours < hand.n_nodes).all(axis=1)
    some = Settings(features=kind, n_maps=11, n_pairs=40, drop_boundary=True)
    np.testing.assert_array_equal(shape_features(hand, some)[0], found[inner])


def test_signatures_are_those_of_the_embedding(hand):
    """At times in units of the shape's size."""
    spectrum = spem.solve_spectrum(hand, 40)
    times = shared_times(hand.size, 2, 40, 8)
    expected = heat_kernel_signature(spectrum, times)
    found = shape_features(hand, Settings(features="hks", n_pairs=40))[0]
    np.testing.assert_allclose(found, expected, rtol=1e-5)
    found = shape_features(hand, Settings(features="si-hks", n_pairs=40))[0]
    expected = scale_invariant_signature(spectrum, 8)
    assert np.corrcoef(found[:, 0], expected[:, 0])[0, 1] > 0.9


@pytest.mark.parametrize("kind", SPECTRAL)
def test_unit_of_length_does_not_matter(hand, kind):
    """Codes are of the shape, not of its unit: features at most change by a common factor."""
    settings = Settings(features=kind, n_pairs=30)
    moved = Shape(hand.mask, tuple(0.037 * h for h in hand.spacing), hand.origin, cuts=hand.cuts)
    (ours,), (theirs,) = (shape_features(shape, settings) for shape in (hand, moved))
    np.testing.assert_allclose(ours / np.linalg.norm(ours), theirs / np.linalg.norm(theirs), rtol=1e-3)


@pytest.mark.parametrize("kind", SPECTRAL)
def test_codes_of_signatures_are_made_saved_and_searched(kind, tmp_path):
    """Poses of a creature find each other; a saved model codes another shape, and a query says its kind."""
    pairs = collection(n_per_class=3, kinds=["hand", "dog", "fish"], voxels=500, rng=np.random.default_rng(0))
    shapes = [shape for shape, _ in pairs]
    codes = spem.encode(shapes, features=kind, voxels=None, n_pairs=40, n_centers=16)
    assert spem.evaluate(codes, [label for _, label in pairs]).mean()["NN"] > 70
    codes.save(tmp_path / "codes.spem")
    loaded = spem.Codes.load(tmp_path / "codes.spem")
    assert loaded.model.settings.features == kind
    assert loaded.model.digest == codes.model.digest
    np.testing.assert_allclose(encode_file(shapes[0], loaded.model), codes.vectors[0], atol=1e-6)
    assert spem.search(loaded, shapes[4])[0].name == codes.names[4]


def test_small_shapes(hand):
    """With fewer nodes than pairs all pairs are taken; a single node has no signature."""
    settings = Settings(features="wks", n_maps=3)
    small = Shape.from_mask(np.ones((4, 5)), name="small")
    assert shape_features(small, settings)[0].shape == (20, 3)
    with pytest.raises(ParameterError, match="speck: no two values above zero among 1"):
        shape_features(Shape.from_mask(np.ones((1, 1)), name="speck"), settings)
    with pytest.raises(ShapeError, match="every node is next to the boundary"):
        shape_features(
            Shape.from_mask(np.ones((9, 1))), Settings(features="hks", n_pairs=5, drop_boundary=True)
        )
