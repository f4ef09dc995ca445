"""The view of words: what is shown on two shapes, and where."""

from __future__ import annotations

import json

import numpy as np
import pytest

import spem
from spem.codes.collection import encode_collection, encode_file
from spem.codes.settings import Settings
from spem.errors import ModelError, ParameterError, ReadError
from spem.index.row import pack
from spem.retrieval.distances import correlation_distance
from spem.server.arrays import pack_arrays
from spem.server.tasks import TASKS
from spem.server.views.words import kind_of, pack_pair, unpack_pair, view_words


@pytest.fixture(scope="module")
def stars():
    """Return stars, of grids of their own, and the joined model of them."""
    shapes = [spem.synthetic.star_polygon(points, 2, spacing=0.08) for points in (5, 6, 7)]
    chosen = Settings(features="spem+sources", voxels=None, n_centers=16)
    return shapes, encode_collection(shapes, chosen).model


def test_correlation_is_that_of_the_codes(stars):
    """It is one minus the distance that a search has, and kinds divide it."""
    (one, two, _), model = stars
    header, _ = view_words(one, two, model, {})
    codes = np.stack([encode_file(shape, model) for shape in (one, two)])
    assert header["correlation"] == pytest.approx(1 - correlation_distance(codes, codes)[0, 1], abs=1e-5)
    assert sum(kind["share"] for kind in header["kinds"]) == pytest.approx(header["correlation"])
    assert sum(kind["weight"] for kind in header["kinds"]) == pytest.approx(1.0)
    assert header["n_words"] == 32
    json.dumps(header, allow_nan=False)


def test_points_of_each_word_stand_together(stars):
    """Ranges of points follow each other without gaps on either shape, and no place stands twice."""
    (one, two, _), model = stars
    header, arrays = view_words(one, two, model, {"n": 6, "n_points": 40})
    shares = [word["share"] for word in header["words"]]
    assert shares == sorted(shares, reverse=True)
    for side in ("query", "answer"):
        points, end = arrays[f"{side}_points"], 0
        for word in header["words"]:
            start, stop = word[side]
            assert start == end
            assert stop - start <= 40
            assert len(np.unique(points[start:stop], axis=0)) == stop - start
            end = stop
        assert end == len(points)
    assert pack_arrays(header, arrays)


def test_points_lie_on_the_shapes(stars):
    """In indices of the grid of the geometry they are at nodes, or within a voxel or two of one."""
    (one, two, _), model = stars
    _, arrays = view_words(one, two, model, {"n": 32})
    for shape, side in ((one, "query_points"), (two, "answer_points")):
        index = np.stack(np.unravel_index(shape.voxels, shape.mask.shape), axis=1)
        apart = np.linalg.norm(arrays[side][:, None] - index[None], axis=2).min(axis=1)
        assert apart.max() < 3.0


def test_points_follow_a_coarser_view(stars):
    """Where the geometry is shown coarser, points are in indices of that grid."""
    (one, two, _), model = stars
    (_, fine), (_, coarse) = (view_words(one, two, model, {"max_nodes": n}) for n in (60_000, 100))
    spread = [np.ptp(arrays["query_points"], axis=0) for arrays in (fine, coarse)]
    assert (spread[1] < 0.8 * spread[0]).all()


def test_query_and_answer_may_change_places(stars):
    """The other way round the same words have their points on the other sides."""
    (one, two, _), model = stars
    (there, first), (back, second) = view_words(one, two, model, {}), view_words(two, one, model, {})
    assert [word["word"] for word in there["words"]] == [word["word"] for word in back["words"]]
    np.testing.assert_array_equal(first["query_points"], second["answer_points"])


def test_pairs_of_shapes_go_in_one_body(stars):
    """Two packed shapes are unpacked as they were; what is damaged is refused."""
    (one, two, _), _ = stars
    body = pack_pair(pack(one), pack(two))
    assert [shape.n_nodes for shape in unpack_pair(body)] == [one.n_nodes, two.n_nodes]
    with pytest.raises(ReadError, match="damaged"):
        unpack_pair(pack_pair(b"no shape", pack(two)))


def test_shapes_of_another_dimension_are_refused(stars):
    """A solid has no words of a model of silhouettes."""
    shapes, model = stars
    with pytest.raises(ModelError, match="a 3-D shape, but the vocabulary is of 2-D ones"):
        view_words(shapes[0], spem.synthetic.ball(3.0, 1.0), model, {})
    with pytest.raises(ParameterError, match="n=33: expected a whole number from 1 to 32"):
        view_words(shapes[0], shapes[1], model, {"n": 33})


@pytest.mark.parametrize("kind", ["si-hks", "surface-si-hks", "inner-distance", "spem"])
def test_kinds_are_told_in_words_that_stand_alone(kind):
    """No text refers to the one before."""
    assert "the same" not in kind_of(kind)


def test_workers_know_the_task(stars, tmp_path):
    """Of two packed shapes and the file of a model a worker makes the same reply."""
    (one, two, _), model = stars
    model.save(tmp_path / "model.spem")
    header = {"model_file": str(tmp_path / "model.spem"), "n": 3, "name": "star"}
    found, arrays = TASKS["words"](header, pack_pair(pack(one), pack(two)))
    expected, points = view_words(*unpack_pair(pack_pair(pack(one), pack(two))), model, {"n": 3})
    assert found == expected
    np.testing.assert_array_equal(arrays["query_points"], points["query_points"])
