"""VLAD: the formula, its invariants and the estimator."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from sklearn.base import clone
from sklearn.utils.estimator_checks import parametrize_with_checks

from spem.codes.normalise import Normalisation, peak_share
from spem.codes.vlad import VLAD, aggregate, concatenate, encode, vlad
from spem.codes.vocabulary import sum_residuals
from spem.errors import ParameterError


def collection(n_shapes: int = 4, n_bands: int = 1, seed: int = 0) -> list[Any]:
    """Return random maps of shapes with different numbers of nodes."""
    rng = np.random.default_rng(seed)
    sizes = rng.integers(40, 80, n_shapes)
    return [tuple(rng.random((n, 3)).astype(np.float32) for _ in range(n_bands)) for n in sizes]


def test_vlad_by_hand():
    """Two centres, three nodes: residual sums (3, 4) and nothing, power one half."""
    nodes = np.array([[1.0, 1.0], [2.0, -3.0], [0.0, -2.0]])
    centers = np.array([[0.0, 0.0], [50.0, 50.0]])
    root = np.sqrt([3 / 5, 4 / 5])
    expected = np.array([root[0], -root[1], 0, 0]) / np.linalg.norm(root)
    np.testing.assert_allclose(vlad(nodes, centers, power=0.5), expected, rtol=1e-14)


def test_second_moments_by_hand():
    """Squares (4, 0) and (0, 16), two nodes of mean squares (1, 11): an excess of (2, -6) beside R = 0."""
    nodes, center = np.array([[2.0, 0.0], [-2.0, 0.0], [0.0, 4.0], [0.0, -4.0]]), np.zeros((1, 2))
    code = vlad(nodes, center, 1.0, spreads=np.array([[1.0, 11.0]]))
    np.testing.assert_allclose(code, [0, 0, 4 / np.hypot(4, 12), -12 / np.hypot(4, 12)], atol=1e-14)


def test_second_moments_tell_apart_what_first_ones_do_not():
    """Two shapes whose nodes lie about a centre equally far, but along different axes."""
    wide, tall = np.array([[1.0, 0.1], [-0.9, 0.1]]), np.array([[0.05, 1.0], [0.05, -0.8]])
    center, spreads = np.zeros((1, 2)), np.full((1, 2), 0.5)
    assert vlad(wide, center, 1.0) @ vlad(tall, center, 1.0) > 0.99
    assert vlad(wide, center, 1.0, spreads) @ vlad(tall, center, 1.0, spreads) < 0.1


def test_moments_and_paper_settings_share_the_first_half():
    """The first moments of a code of two are those of the code of one, but for the total length."""
    shapes = collection()
    one, two = (VLAD(5, moments=m, random_state=0).fit_transform(shapes) for m in (1, 2))
    first = two.reshape(4, 5, 2, 3)[:, :, 0].reshape(4, -1)
    np.testing.assert_allclose(first / np.linalg.norm(first, axis=1, keepdims=True), one, rtol=1e-12)


def test_levels_by_hand():
    """Nodes of two levels are summed apart, and each sum has unit length before the power."""
    nodes, center = np.array([[1.0, 0.0], [2.0, 0.0], [4.0, 3.0]]), np.zeros((1, 2))
    code = vlad(nodes, center, 1.0, levels=np.array([0, 0, 1]), n_levels=2)
    np.testing.assert_allclose(code, np.array([1, 0, 0.8, 0.6]) / np.sqrt(2), rtol=1e-14)


@settings(max_examples=20, deadline=None)
@given(st.integers(0, 1000), st.integers(1, 5), st.integers(1, 2))
def test_a_level_is_the_code_of_its_nodes(seed, n_levels, moments):
    """Level by level a code is that of the nodes of this level alone, but for the total length."""
    rng = np.random.default_rng(seed)
    nodes, centers, spreads = rng.normal(size=(200, 3)), rng.normal(size=(4, 3)), np.ones((4, 3))
    second, levels = spreads if moments == 2 else None, rng.integers(0, n_levels, 200)
    parts = vlad(nodes, centers, 0.5, second, levels, n_levels).reshape(n_levels, -1)
    for level, part in enumerate(parts):
        alone = vlad(nodes[levels == level], centers, 0.5, second)
        np.testing.assert_allclose(part / np.linalg.norm(part), alone, atol=1e-12)


def test_levels_hold_equally_many_training_nodes():
    """A third of the training nodes is in each of three levels, and a code has a share for each."""
    shapes = collection(12)
    learner = VLAD(5, levels=3, random_state=0).fit(shapes)
    shares = np.concatenate([peak_share(maps) for (maps,) in shapes])
    counts = np.bincount(np.searchsorted(learner.cuts_[0], shares))
    np.testing.assert_allclose(counts / shares.size, 1 / 3, atol=0.01)
    assert learner.transform(shapes).shape == (12, 3 * 5 * 3 * 2)


def test_one_level_is_the_plain_code():
    """A single level has no cut, and codes are those of all nodes together."""
    shapes = collection(n_bands=2)
    learner = VLAD(5, random_state=0).fit(shapes)
    centers = [words.cluster_centers_ for words in learner.vocabularies_]
    assert [cuts.size for cuts in learner.cuts_] == [0, 0]
    plain = [encode(bands, learner.normalisations_, centers, 0.5, learner.spreads_) for bands in shapes]
    np.testing.assert_array_equal(learner.transform(shapes), plain)


def test_levels_do_not_depend_on_the_unit_of_the_maps():
    """Maps of another unit, or of a shape with more nodes of the same values, give the same levels."""
    shapes = [(np.float64(maps),) for (maps,) in collection()]
    learner = VLAD(5, levels=4, random_state=0).fit(shapes)
    again = [np.tile(1000 * maps, (2, 1)) for (maps,) in shapes]
    np.testing.assert_allclose(learner.transform(again), learner.transform(shapes), atol=1e-9)


@pytest.mark.parametrize("moments", [1, 2])
def test_sums_over_words_are_enough(moments):
    """A code comes from the sums of each band and level without the nodes, bit by bit."""
    rng = np.random.default_rng(3)
    maps, words = rng.random((2, 60, 3)), rng.random((2, 5, 3))
    normals, cuts = [Normalisation.standard([rng.random((9, 3))])] * 2, [np.array([0.3, 0.7])] * 2
    spreads = list(rng.random((2, 5, 3))) if moments == 2 else None
    whole = encode(tuple(maps), normals, words, 0.5, spreads, cuts)
    parts = []
    for band, normal, centers, spread in zip(maps, normals, words, spreads or [None] * 2, strict=True):
        levels = np.searchsorted(cuts[0], peak_share(band))
        parts.append(aggregate(sum_residuals(normal.apply(band), centers, levels, 3), 0.5, spread))
    assert np.array_equal(concatenate(parts), whole)


def test_vlad_of_nodes_on_their_centres_is_zero():
    """Where all differences vanish the code is zero and nothing is divided by zero."""
    centers = np.array([[0.0, 1.0], [2.0, 3.0]])
    assert not vlad(centers, centers).any()


@settings(max_examples=20)
@given(st.integers(0, 1000))
def test_order_of_nodes_changes_no_code(seed):
    """Permuting the nodes of a shape leaves its code unchanged."""
    shapes = collection(n_bands=2)
    learner = VLAD(5, random_state=0).fit(shapes)
    order = np.random.default_rng(seed).permutation(len(shapes[0][0]))
    permuted = tuple(maps[order] for maps in shapes[0])
    np.testing.assert_allclose(learner.transform([permuted]), learner.transform(shapes[:1]), atol=1e-6)


@settings(max_examples=20)
@given(st.integers(1, 4), st.floats(1e-3, 1e3))
def test_voxel_budget_and_unit_change_no_code(copies, unit):
    """More nodes with the same values, or maps in another unit, give the same code."""
    shapes = [tuple(np.float64(maps) for maps in bands) for bands in collection()]
    learner = VLAD(5, random_state=0).fit(shapes)
    finer = [np.tile(unit * maps, (copies, 1)) for (maps,) in shapes]
    np.testing.assert_allclose(learner.transform(finer), learner.transform(shapes), atol=1e-9)


def test_codes_have_unit_length_and_equal_bands():
    """A code has unit L2 norm, and each band the same share in it."""
    learner = VLAD(5, random_state=0)
    codes = learner.fit_transform(collection(n_bands=3)).reshape(4, 3, -1)
    np.testing.assert_allclose((codes**2).sum(-1), 1 / 3, rtol=1e-12)


def test_scaling_is_chosen():
    """Each scaling makes its normalisation: identity, deviations, their inverse or a full one."""
    shapes = [(np.float64(maps) * [9, 1, 1],) for (maps,) in collection()]
    transforms = {
        scaling: VLAD(3, scaling=scaling, random_state=0).fit(shapes).normalisations_[0].transform
        for scaling in ("none", "deviation", "whiten", "standard")
    }
    assert transforms["none"].tolist() == np.eye(3).tolist()
    assert transforms["deviation"][0, 0] / transforms["deviation"][1, 1] == pytest.approx(9, rel=0.2)
    assert np.count_nonzero(transforms["whiten"]) == 9
    assert np.count_nonzero(transforms["standard"]) == 3


def test_one_band_may_come_as_an_array_and_shapes_as_a_generator():
    """Arrays stand for tuples of one band, and the input is read once only."""
    shapes = [maps for (maps,) in collection()]
    learner = VLAD(3, random_state=0).fit(maps for maps in shapes)
    codes = learner.transform((maps,) for maps in shapes)
    np.testing.assert_array_equal(codes, learner.transform(shapes))


def test_same_seed_same_codes_and_other_seed_others():
    """Codes depend on the seed and on nothing else that is random."""
    shapes = collection()
    first, again, other = (
        VLAD(5, nodes_per_shape=20, random_state=s).fit_transform(shapes) for s in (0, 0, 1)
    )
    np.testing.assert_array_equal(first, again)
    assert np.abs(first - other).max() > 0.01


def test_words_take_a_number_of_nodes_each():
    """Of 600 nodes thirty words of 20 nodes, never more than asked for nor fewer than eight."""
    shapes = [np.random.default_rng(i).random((200, 2)) for i in range(3)]
    for least, expected in ((1, 40), (15, 40), (20, 30), (300, 8)):
        made = VLAD(40, nodes_per_center=least, random_state=0).fit(shapes)
        assert len(made.vocabularies_[0].cluster_centers_) == expected


def test_codes_as_a_data_frame_with_named_columns():
    """Pandas output has one named column for each entry of a code."""
    learner = VLAD(2, random_state=0).set_output(transform="pandas")
    frame = clone(learner).set_output(transform="pandas").fit_transform(collection())
    assert list(frame.columns) == [f"vlad{i}" for i in range(12)]


@pytest.mark.parametrize(
    ("shapes", "message"),
    [
        ([], "got 0 shapes"),
        ([np.ones((4, 2)), np.ones((4, 3))], r"shape 1 has \(3,\) maps in its bands, expected \(2,\)"),
        ([(np.ones((4, 2)), np.ones((5, 2)))], r"bands of shape 0 have \[4, 5\] nodes"),
        ([()], "at least one band"),
        ([np.ones((0, 2))], "at least one of each"),
        ([np.ones((4, 2)), np.full((4, 2), np.nan)], "maps of shape 1 contain NaN"),
        ([np.ones((4, 2), complex)], "Complex data not supported"),
        ([np.ones((4, 2, 2))], r"must be \(n_nodes, n_maps\)"),
    ],
)
def test_bad_maps_are_refused(shapes, message):
    """Each kind of unfit input is named with the shape it came from."""
    with pytest.raises(ParameterError, match=message):
        VLAD(2).fit(shapes)


@pytest.mark.parametrize(
    "bad",
    [
        {"power": 1.5},
        {"scaling": "z"},
        {"moments": 3},
        {"n_centers": 0},
        {"nodes_per_shape": 0},
        {"levels": 0},
        {"n_init": 0},
    ],
)
def test_bad_parameters_are_refused(bad):
    """Parameters out of their range are named."""
    with pytest.raises(ParameterError, match=next(iter(bad))):
        VLAD(**bad).fit(collection())


def test_encode_wants_weights_and_centres_for_every_band():
    """A missing band is an error and not a shorter code."""
    with pytest.raises(ValueError, match="shorter"):
        encode((np.ones((2, 1)), np.ones((2, 1))), (Normalisation.none(1),), (np.ones((1, 1)),))


# Rows of a two-dimensional array are shapes of one map, and a shape may have any number of nodes.
ANY_LENGTH = "rows are shapes and their columns nodes: shapes may have any number of nodes"
EXPECTED = {
    "check_n_features_in_after_fitting": ANY_LENGTH,
    "check_n_features_in": ANY_LENGTH,
    "check_transformer_general": ANY_LENGTH,
    "check_fit2d_1feature": "a row of one column is a shape of one node, and at unit rms none of them varies",
    "check_estimators_empty_data_messages": "a row without columns is a shape without nodes, refused as such",
}


@parametrize_with_checks([VLAD(n_centers=3)], expected_failed_checks=lambda estimator: EXPECTED)
def test_scikit_learn_contract(estimator, check):
    """VLAD keeps the contract of scikit-learn's estimators as far as it applies to lists of shapes."""
    check(estimator)
