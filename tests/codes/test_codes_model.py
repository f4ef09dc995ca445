"""The model: fitting, coding, and its file."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from spem.codes import settings as settings_module
from spem.codes.container import write_container
from spem.codes.model import Model
from spem.codes.settings import Settings
from spem.codes.vlad import VLAD
from spem.errors import ModelError, ParameterError, ReadError
from spem.retrieval.distances import correlation_distance

SETTINGS = Settings(features="spem", n_maps=3, n_centers=4, rho_ranges=((0.02, 0.2), (0.1, 0.5)))


def shapes(seed=0):
    """Return two bands of random maps of five shapes."""
    rng = np.random.default_rng(seed)
    return [tuple(rng.random((50, 3)).astype(np.float32) for _ in range(2)) for _ in range(5)]


@pytest.fixture
def model():
    """Return a model of two bands."""
    return Model.fit(SETTINGS, shapes())


def test_model_codes_as_the_estimator_does(model):
    """A model's codes are those of VLAD with the same parameters."""
    expected = VLAD(4, levels=4, random_state=0).fit(shapes()).transform(shapes(1))
    np.testing.assert_allclose([model.encode(bands) for bands in shapes(1)], expected, atol=1e-6)
    assert model.n_code == 192


def test_saved_model_is_the_same_model(model, tmp_path):
    """A loaded model has the digest of the saved one and gives bit-identical codes."""
    model.save(tmp_path / "m.spem")
    loaded = Model.load(tmp_path / "m.spem")
    assert loaded.digest == model.digest
    assert loaded.settings == model.settings
    for bands in shapes(2):
        np.testing.assert_array_equal(loaded.encode(bands), model.encode(bands))


def test_model_from_before_kinds_of_features_is_one_of_maps(tmp_path):
    """A file without the newer settings gives the model that it gave, and the same codes."""
    settings = Settings(features="spem", n_maps=3, n_centers=4, rho_ranges=SETTINGS.rho_ranges, levels=1)
    model = Model.fit(settings, shapes())
    late = ("features", "n_pairs", "levels")
    header = model.to_header()
    header["settings"] = {k: v for k, v in header["settings"].items() if k not in late}
    write_container(tmp_path / "old.spem", "model", header, model.to_arrays())
    loaded = Model.load(tmp_path / "old.spem")
    assert loaded.settings == model.settings
    np.testing.assert_array_equal(loaded.encode(shapes(2)[0]), model.encode(shapes(2)[0]))


def test_small_collections_have_fewer_words():
    """Where no number is asked for: 64 training nodes for each, no fewer than eight; the file has them."""
    few = Model.fit(Settings(features="spem", n_maps=3), [bands[:1] for bands in shapes()])
    asked = Model.fit(Settings(features="spem", n_maps=3, n_centers=20), [bands[:1] for bands in shapes()])
    assert (few.parts[0].n_centers, asked.parts[0].n_centers) == (8, 20)
    rng = np.random.default_rng(0)
    many = Model.fit(Settings(features="spem", n_maps=3), [rng.random((500, 3)) for _ in range(4)])
    assert many.parts[0].n_centers == 31
    again = Model.from_parts(many.to_header(), many.to_arrays(), "file")
    assert (again.digest, again.n_code) == (many.digest, 4 * 2 * 31 * 3)


def test_digest_tells_settings_and_vocabularies_apart(model):
    """Another setting or another collection gives another digest, the same ones the same."""
    assert Model.fit(SETTINGS, shapes()).digest == model.digest
    assert Model.fit(SETTINGS, shapes(3)).digest != model.digest
    other = Settings(features="spem", n_maps=3, n_centers=4, rho_ranges=SETTINGS.rho_ranges, voxels=99)
    assert Model(other, (replace(model.parts[0], settings=other),)).digest != model.digest
    assert len(model.digest) == 12


def test_maps_of_other_bands_are_refused(model):
    """Maps that do not fit the model are named with the shape and the digest."""
    with pytest.raises(ParameterError, match=rf"cat has \[3\] maps .* {model.digest} expects \[3, 3\]"):
        model.encode(np.ones((5, 3)), "cat")


def test_arrays_must_fit_the_settings(model):
    """A model is refused whose arrays are not those of its settings."""
    [part] = model.parts
    with pytest.raises(ModelError, match="2 bands, 4 centres and 3 maps got arrays"):
        replace(part, centers=(part.centers[0], part.centers[1][:2]))
    with pytest.raises(ModelError, match="got arrays"):
        replace(part, spreads=())
    with pytest.raises(ModelError, match=r"a model of spem got parts spem\+spem and 1 weights"):
        Model(SETTINGS, (part, part))


def test_model_of_one_moment_has_no_spreads(tmp_path):
    """The paper's codes are half as long, need no spreads, and survive their file."""
    settings = Settings.paper(n_maps=3, n_centers=4, rho_ranges=SETTINGS.rho_ranges)
    model = Model.fit(settings, shapes())
    model.save(tmp_path / "p.spem")
    loaded = Model.load(tmp_path / "p.spem")
    assert (model.n_code, loaded.parts[0].spreads, loaded.digest) == (24, (), model.digest)
    np.testing.assert_array_equal(loaded.encode(shapes(1)[0]), model.encode(shapes(1)[0]))


def test_model_of_a_later_method_is_refused(model, tmp_path, monkeypatch):
    """A whole file with codes of a later format asks for an upgrade."""
    later = {"settings": SETTINGS.to_json() | {"code_format": settings_module.CODE_FORMAT + 1}}
    write_container(tmp_path / "m.spem", "model", later, model.to_arrays())
    with pytest.raises(ModelError, match="upgrade spem"):
        Model.load(tmp_path / "m.spem")


def test_model_that_lacks_an_array_is_refused(model, tmp_path):
    """A whole file without one of the vocabularies is refused."""
    arrays = model.to_arrays()
    arrays.pop("centers.1")
    write_container(tmp_path / "m.spem", "model", {"settings": SETTINGS.to_json()}, arrays)
    with pytest.raises(ModelError, match=r"lacks the array 'centers.1'"):
        Model.load(tmp_path / "m.spem")


def test_settings_that_are_no_table_are_refused(model, tmp_path):
    """A whole file whose settings are a list is refused."""
    write_container(tmp_path / "m.spem", "model", {"settings": [1]}, model.to_arrays())
    with pytest.raises(ModelError, match="no table of names and values"):
        Model.load(tmp_path / "m.spem")


def test_truncated_model_is_refused(model, tmp_path):
    """Half a file is not a model."""
    path = tmp_path / "m.spem"
    model.save(path)
    path.write_bytes(path.read_bytes()[:-100])
    with pytest.raises(ReadError, match="truncated"):
        Model.load(path)


JOINED = Settings(features="spem+wks", n_maps=3, n_centers=4)


def test_joined_model_adds_the_distances_of_its_parts():
    """Correlation distances of joined codes are those of each kind's own codes, by the model's weights."""
    model = Model.fit(JOINED, shapes(), ndim=2)
    alone = [Model.fit(part, [(bands[i],) for bands in shapes()]) for i, part in enumerate(JOINED.parts(2))]
    joined = np.stack([model.encode(bands) for bands in shapes(1)])
    parts = [np.stack([each.encode(bands[i]) for bands in shapes(1)]) for i, each in enumerate(alone)]
    expected = sum(w * correlation_distance(p, p) for w, p in zip(model.weights, parts, strict=True))
    np.testing.assert_allclose(correlation_distance(joined, joined), expected, atol=1e-6)
    assert model.n_code == joined.shape[1] == 48
    assert sum(model.weights) == pytest.approx(1)


def test_joined_model_survives_its_file(tmp_path):
    """Digest, weights and codes are the same; without the weights it is refused."""
    model = Model.fit(JOINED, shapes(), ndim=2)
    model.save(tmp_path / "m.spem")
    loaded = Model.load(tmp_path / "m.spem")
    assert (loaded.digest, loaded.weights, loaded.ndim) == (model.digest, model.weights, 2)
    np.testing.assert_array_equal(loaded.encode(shapes(1)[0]), model.encode(shapes(1)[0]))
    arrays = model.to_arrays()
    del arrays["weights"]
    write_container(tmp_path / "m.spem", "model", model.to_header(), arrays)
    with pytest.raises(ModelError, match="lacks the array 'weights'"):
        Model.load(tmp_path / "m.spem")


@pytest.mark.parametrize(
    ("weights", "message"),
    [
        ([np.nan, 0.5], r"weights=\(nan, 0.5\): expected 2 numbers of at least 0"),
        ([-1.0, 2.0], "expected 2 numbers of at least 0"),
        ([0.0, 0.0], "not all 0"),
        (["a", "b"], "m.spem: the weights are no row of numbers; make it again"),
        (0.5, "no row of numbers"),
    ],
)
def test_weights_that_weigh_nothing_are_refused(weights, message, tmp_path):
    """A whole file whose weights are no shares is refused when it is read, not when it is used."""
    model = Model.fit(JOINED, shapes(), ndim=2)
    arrays = model.to_arrays() | {"weights": np.array(weights)}
    write_container(tmp_path / "m.spem", "model", model.to_header(), arrays)
    with pytest.raises(ModelError, match=message):
        Model.load(tmp_path / "m.spem")


def test_joined_model_knows_what_it_is_made_of():
    """A generator will do to learn it, its kinds are named, and features of one kind alone are refused."""
    model = Model.fit(JOINED, iter(shapes()), ndim=2)
    assert model.digest == Model.fit(JOINED, shapes(), ndim=2).digest
    assert repr(model).startswith(f"Model({model.digest}, spem 0.")
    assert [part.settings.features for part in model.parts] == ["spem", "wks"]
    with pytest.raises(ParameterError, match=f"cat has 1 bands, model {model.digest} expects 2"):
        model.encode(np.ones((5, 3)), "cat")
    with pytest.raises(ParameterError, match=rf"cat has \[2\] maps in its bands, model {model.digest}"):
        model.encode((np.ones((5, 3)), np.ones((9, 2))), "cat")


@pytest.mark.parametrize(
    ("bands", "found"), [(np.ones((50, 3)), "one array"), ((np.ones((50, 3)),) * 3, "3 bands")]
)
def test_joined_model_is_not_learnt_of_other_bands(bands, found):
    """Two kinds need a tuple of two bands a shape."""
    with pytest.raises(ParameterError, match=f"a training shape has {found}; give a tuple of 2"):
        Model.fit(JOINED, [bands], ndim=2)


def test_settings_that_leave_the_kind_open_are_resolved():
    """A model names the kinds that "auto" stood for, so that it is the same tomorrow."""
    model = Model.fit(Settings(n_maps=3, n_centers=4), [bands[:1] for bands in shapes()], ndim=4)
    assert model.settings == Settings(features="spem", n_maps=3, n_centers=4)
