"""Visual words: their shares of a correlation, the rows that speak for them, and where these lie."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import spem
from spem.codes.kinds import shape_features
from spem.codes.model import Model
from spem.codes.positions import feature_positions
from spem.codes.settings import Settings
from spem.codes.traits import TRAITS
from spem.codes.words import explain, speaking_rows
from spem.errors import ModelError
from spem.retrieval.distances import correlation_distance
from spem.shapes.shape import Shape

PLANE = Settings(features="spem+sources+shape-context", n_centers=8)
SOLID = Settings(features="spem+surface-wks", n_centers=8, n_pairs=40)
BANDS = Settings(features="spem", n_maps=3, n_centers=4, rho_ranges=((0.02, 0.2), (0.1, 0.5)))


def clouds(seed, count=4):
    """Return two bands of random maps of some shapes."""
    rng = np.random.default_rng(seed)
    return [tuple(rng.random((60, 3)).astype(np.float32) for _ in range(2)) for _ in range(count)]


@pytest.fixture(scope="module")
def stars():
    """Return stars and the joined model of them."""
    shapes = [spem.synthetic.star_polygon(points, 2, spacing=0.08) for points in (5, 6, 7)]
    features = [shape_features(shape, PLANE) for shape in shapes]
    return shapes, features, Model.fit(PLANE, features, 2)


@settings(max_examples=8, deadline=None)
@given(st.integers(0, 99), st.sampled_from([(1, 1, 0.5), (2, 4, 0.25), (2, 1, 1.0)]))
def test_shares_add_up_to_the_correlation(seed, choice):
    """Whatever moments, levels and power, the shares of all words are one minus the distance."""
    moments, levels, power = choice
    chosen = Settings(**{**BANDS.to_json(), "moments": moments, "levels": levels, "power": power})
    shapes = clouds(seed)
    model = Model.fit(chosen, shapes)
    codes = np.stack([model.encode(bands) for bands in shapes[:2]])
    words = explain(model, *codes)
    assert len(words) == 2 * levels * 4
    assert sum(w.share for w in words) == pytest.approx(
        1 - correlation_distance(codes, codes)[0, 1], abs=1e-6
    )


def test_query_and_answer_may_change_places(stars):
    """The same words have the same shares, to rounding not even that."""
    _, features, model = stars
    one, two = (model.encode(bands) for bands in features[:2])
    assert explain(model, one, two) == explain(model, two, one)


def test_shares_of_a_kind_are_its_weight_times_its_correlation(stars):
    """In joined codes the words of a kind add up to what the kind has in the whole."""
    _, features, model = stars
    codes = [model.encode(bands) for bands in features[:2]]
    apart = [model.codes(bands) for bands in features[:2]]
    words = explain(model, *codes)
    for number, weight in enumerate(model.weights):
        own = correlation_distance(apart[0][number][None], apart[1][number][None])[0, 0]
        found = sum(word.share for word in words if word.part == number)
        assert found == pytest.approx(weight / sum(model.weights) * (1 - own), abs=1e-6)


def test_standardised_codes_of_an_index_give_the_same(stars):
    """Codes at mean zero and unit length, as an index keeps them, have the same words."""
    _, features, model = stars
    codes = np.stack([model.encode(bands) for bands in features[:2]]).astype(np.float64)
    unit = codes - codes.mean(axis=1, keepdims=True)
    unit /= np.linalg.norm(unit, axis=1, keepdims=True)
    plain, kept = explain(model, *codes), explain(model, *unit)
    np.testing.assert_allclose([w.share for w in plain], [w.share for w in kept], atol=1e-7)


def test_words_are_named_by_where_their_numbers_stand():
    """Codes that are zero but for one word of a band, a level and a centre have that word alone."""
    model = Model.fit(BANDS, clouds(0))
    code = np.zeros(model.n_code)
    blocks = code.reshape(2, 4, 4, 2, 3)
    blocks[1, 2, 3, :, 0] = [1.0, -1.0]
    best = explain(model, code, code)[0]
    assert (best.band, best.level, best.center, best.share) == (1, 2, 3, pytest.approx(1.0))


def test_rows_speak_by_their_difference_from_the_centre():
    """Of two rows at a centre, on either side of it, the one on the side of the other shape speaks."""
    plain = Settings(features="spem", n_maps=1, n_centers=2, moments=1, levels=1, scaling="none", power=1.0)
    train = [np.array([[1.0], [1.2], [3.0], [3.2]])] * 2
    model = Model.fit(plain, train)
    query = np.array([[1.0], [1.2], [1.2], [3.0], [3.2]])
    low = int(model.parts[0].centers[0].argmin())
    code = np.zeros(model.n_code)
    code[low] = 1.0
    word = next(word for word in explain(model, code, code) if word.center == low)
    assert speaking_rows(model, [word], (query,), code)[0].tolist() == [1, 2]
    assert speaking_rows(model, [word], (query,), -code)[0].tolist() == [0]


def test_rows_are_of_the_word_and_strongest_first(stars):
    """There are no more than asked for, and a shorter list is the beginning of a longer."""
    _, features, model = stars
    codes = [model.encode(bands) for bands in features[:2]]
    words = explain(model, *codes)[:6]
    some, few = (speaking_rows(model, words, features[0], codes[1], most) for most in (50, 3))
    for long, short in zip(some, few, strict=True):
        assert long.size <= 50
        np.testing.assert_array_equal(long[:3], short)


def test_rows_of_a_word_that_a_shape_lacks_are_none():
    """A shape without a row at a centre has nothing to show of it."""
    plain = Settings(features="spem", n_maps=1, n_centers=2, moments=1, levels=1, scaling="none")
    model = Model.fit(plain, [np.array([[1.0], [1.2], [9.0], [9.2]])] * 2)
    words = explain(model, *[np.arange(2.0)] * 2)
    rows = speaking_rows(model, words, (np.array([[1.0], [1.1]]),), np.arange(2.0))
    assert min(len(own) for own in rows) == 0


def test_codes_and_features_of_other_models_are_refused(stars):
    """Codes of another length and features of too few bands are named."""
    _, features, model = stars
    code = model.encode(features[0])
    with pytest.raises(ModelError, match=rf"a code of shape \(3,\), but those of model {model.digest} have"):
        explain(model, code, np.zeros(3))
    with pytest.raises(ModelError, match=r"features of 1 bands, but model .* has 3"):
        speaking_rows(model, explain(model, code, code)[:1], features[0][:1], code)


@pytest.mark.parametrize("kind", TRAITS)
def test_every_kind_has_a_position_for_each_row(kind):
    """There are as many positions as rows of features, and none lies off the shape."""
    ndim = max((*TRAITS[kind].ndims, 2))
    shape = spem.synthetic.disk(10.0, 1.0) if ndim == 2 else spem.synthetic.ball(6.0, 1.0)
    chosen = Settings(**{"features": kind, **({"n_pairs": 30} if "n_pairs" in TRAITS[kind].own else {})})
    chosen = chosen.parts(ndim)[0]
    positions = feature_positions(shape, chosen)
    assert len(positions) == len(shape_features(shape, chosen)[0])
    assert np.linalg.norm(positions, axis=1).max() < (11.0 if ndim == 2 else 7.0)


def test_nodes_next_to_the_boundary_may_be_left_out():
    """Positions follow the setting that drops them."""
    shape = Shape.from_mask(np.ones((5, 7)))
    positions = feature_positions(shape, Settings(features="spem", drop_boundary=True))
    assert len(positions) == 15


def test_positions_on_the_surface_are_those_of_the_features():
    """Values of the vertices interpolated there are the features: a coordinate in place of a signature."""
    shape = spem.synthetic.ball(6.0, 1.0)
    positions = feature_positions(shape, SOLID.parts(3)[1])
    np.testing.assert_allclose(np.linalg.norm(positions, axis=1), 6.0, atol=0.35)
    assert np.unique(positions.round(6), axis=0).shape[0] > 3900
