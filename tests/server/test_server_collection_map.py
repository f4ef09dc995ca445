"""The map of a collection as JSON: all shapes of a small one, a sample of a large one."""

from __future__ import annotations

import json

import numpy as np
import pytest

pytest.importorskip("lancedb")
pytest.importorskip("starlette")

import spem
from spem.index.index import Index
from spem.server import collection_map as module
from spem.server.catalogue import Catalogue
from spem.server.collection_map import collection_map


@pytest.fixture(scope="module")
def catalogue(tmp_path_factory):
    index = Index.open(tmp_path_factory.mktemp("map") / "db")
    shapes = [spem.synthetic.disk(radius=4.0 + n, spacing=1.0) for n in range(5)]
    index.add([*shapes, spem.synthetic.star_polygon(5, 2)], features="spem", voxels=None, n_centers=4)
    return Catalogue(index)


def _map(catalogue):
    return json.loads(collection_map(catalogue, catalogue.digest(None)))


def test_every_shape_of_a_small_collection_has_a_place(catalogue):
    """Points come in the order of their ids, with finite places in the square from -1 to 1."""
    found = _map(catalogue)
    ids = [point["id"] for point in found["points"]]
    assert found["total"] == len(ids) == 6
    assert ids == sorted(ids)
    assert np.abs([[point["x"], point["y"]] for point in found["points"]]).max() <= 1


def test_of_a_large_collection_there_is_a_sample(catalogue, monkeypatch):
    """The number of all is told; the sample is the same each time, whatever is read at once."""
    monkeypatch.setattr(module, "MOST_POINTS", 4)
    monkeypatch.setattr(module, "_AT_ONCE", 3)
    found = _map(catalogue)
    assert (found["total"], len(found["points"])) == (6, 4)
    assert found == _map(catalogue)
    assert len({point["id"] for point in found["points"]}) == 4
