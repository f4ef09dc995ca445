"""Codes of a collection and their file."""

from __future__ import annotations

import numpy as np
import pytest

from spem.codes.codes import Codes, Failure, file_hash
from spem.codes.container import read_container, write_container
from spem.codes.model import Model
from spem.codes.settings import Settings
from spem.errors import ModelError, ParameterError, ReadError

SETTINGS = Settings(features="spem", n_maps=2, n_centers=3)


def make(names="abc", seed=0, settings=SETTINGS):
    """Return codes of random maps under a model fitted to maps of the seed."""
    rng = np.random.default_rng(seed)
    maps = [rng.random((20, settings.n_maps)) for _ in range(4)]
    model = Model.fit(settings, maps)
    vectors = np.stack([model.encode(rng.random((20, settings.n_maps))) for _ in names])
    paths, hashes = [f"{name}.obj" for name in names], ["0" * 64 for _ in names]
    return Codes(names, paths, hashes, vectors, model, [Failure("bad.obj", "no <closed> surface")])


def test_codes_survive_their_file(tmp_path):
    """Everything comes back as it was saved, with the model."""
    codes = make()
    codes.save(tmp_path / "c.codes")
    loaded = Codes.load(tmp_path / "c.codes")
    assert (loaded.names, loaded.paths, loaded.hashes) == (codes.names, codes.paths, codes.hashes)
    assert loaded.failures == (Failure("bad.obj", "no <closed> surface"),)
    assert loaded.model.digest == codes.model.digest
    np.testing.assert_array_equal(loaded.vectors, codes.vectors)
    assert loaded.vectors.dtype == np.float32


def test_other_vocabulary_is_refused():
    """Codes of another vocabulary are refused and the message says what differs."""
    with pytest.raises(ModelError, match="same settings but another vocabulary"):
        make().require_same_model(make(seed=1))
    other = make(settings=Settings(features="spem", n_maps=2, n_centers=3, power=0.75))
    with pytest.raises(ModelError, match=r"the query has model .*power 0.75 against 0.5"):
        make().require_same_model(other.model)
    make().require_same_model(make("xy"))


def test_joined_codes_are_refused_beside_codes_of_maps():
    """The line names the features of both, and nothing that one of them leaves to its parts."""
    rng = np.random.default_rng(0)
    joined = Settings(features="spem+wks", n_maps=2, n_centers=3)
    both = Model.fit(joined, [(rng.random((20, 2)), rng.random((9, 2))) for _ in range(4)], ndim=2)
    with pytest.raises(ModelError, match=r"features spem\+wks against spem\); make both with one model"):
        make().require_same_model(both)


def test_join_and_take():
    """Collections of one model are joined in order, and shapes picked from them."""
    both = make("abc").join(make("de"))
    assert both.names == tuple("abcde")
    assert len(both.failures) == 2
    some = both.take([4, 0])
    assert some.names == ("e", "a")
    np.testing.assert_array_equal(some.vectors, both.vectors[[4, 0]])
    with pytest.raises(ModelError, match="the second collection has model"):
        both.join(make("f", seed=9))


def test_columns_must_agree():
    """Names, paths, hashes and vectors must be one for each shape."""
    codes = make()
    with pytest.raises(ParameterError, match="2 names, 3 paths"):
        Codes(codes.names[:2], codes.paths, codes.hashes, codes.vectors, codes.model)
    with pytest.raises(ParameterError, match=r"vectors \(3, 5\)"):
        Codes(codes.names, codes.paths, codes.hashes, codes.vectors[:, :5], codes.model)


def test_file_without_vectors_and_model_files_are_refused(tmp_path):
    """What is not whole codes is not read as codes."""
    codes = make()
    header = {"settings": SETTINGS.to_json(), "names": [], "paths": [], "hashes": [], "failures": []}
    write_container(tmp_path / "c", "codes", header, codes.model.to_arrays("model."))
    with pytest.raises(ReadError, match="not whole codes"):
        Codes.load(tmp_path / "c")
    codes.model.save(tmp_path / "m")
    with pytest.raises(ReadError, match="is a file of spem model, expected spem codes"):
        Codes.load(tmp_path / "m")


@pytest.mark.parametrize(
    ("header", "arrays"),
    [
        ({}, {"vectors": np.full((3, 12), np.nan, np.float32)}),
        ({}, {"vectors": np.zeros((3, 12), complex)}),
        ({"names": [1, 2, 3]}, {}),
        ({"paths": None}, {}),
        ({"paths": [1, 2, 3]}, {}),
        ({"failures": [["a"]]}, {}),
    ],
)
def test_whole_files_of_wrong_contents_are_refused(tmp_path, header, arrays):
    """A file whose hash fits may still hold what no code is."""
    make().save(tmp_path / "c")
    good_header, good_arrays = read_container(tmp_path / "c", "codes")
    write_container(tmp_path / "c", "codes", good_header | header, good_arrays | arrays)
    with pytest.raises(ReadError, match="not whole codes"):
        Codes.load(tmp_path / "c")


def test_no_shape_at_all_is_a_collection_too(tmp_path):
    """Codes of an empty collection can be saved and read."""
    none = make().take([])
    none.save(tmp_path / "c")
    assert len(Codes.load(tmp_path / "c")) == 0


def test_file_hash(tmp_path):
    """The hash is that of the bytes; an absent file is named."""
    (tmp_path / "abc").write_bytes(b"abc")
    assert file_hash(tmp_path / "abc").startswith("ba7816bf8f01cfea")
    with pytest.raises(ReadError, match="nowhere: no such file"):
        file_hash(tmp_path / "nowhere")
