"""Which of several models a query is asked with."""

from __future__ import annotations

import numpy as np
import pytest

from spem.errors import ModelError, ParameterError
from spem.index.index import Index
from spem.shapes.creatures import write_collection


@pytest.fixture(scope="module")
def mixed(tmp_path_factory):
    """Return an index of silhouettes and solids, each with a model, and the folder of their files."""
    folder = tmp_path_factory.mktemp("mixed")
    images, meshes = write_collection(
        folder, n_per_class=2, kinds=["fish", "hand"], rng=np.random.default_rng(0)
    )
    index = Index.open(folder / "index")
    index.add(images, features="spem", voxels=400, n_centers=4, n_maps=2)
    index.add(meshes, new_model=True, features="spem", voxels=600, n_centers=4, n_maps=3)
    return index, folder


def test_a_query_goes_to_the_model_that_can_answer(mixed):
    """A file, a shape, a code and an id are asked of the model of their dimension, length or table."""
    index, folder = mixed
    flat, solid = sorted(index.models(), key=lambda model: model.ndim)
    assert (flat.ndim, solid.ndim) == (2, 3)
    silhouette, mesh = folder / "images" / "hand_01.png", folder / "meshes" / "hand_01.obj"
    assert (
        index.search(silhouette, k=1)[0].row.path
        == index.get(index.find([str(silhouette)], model=flat.digest)[0], model=flat.digest).path
    )
    answers = index.search(mesh, k=1)
    assert (answers.model, answers[0].row.ndim) == (solid.digest, 3)
    row = answers[0].row
    assert index.search(row.id, k=1)[0].row.id == row.id
    code = index.get(row.id, model=solid.digest).code
    assert index.search(code, k=1)[0].row.id == row.id
    new = folder / "new.obj"
    new.write_bytes(mesh.read_bytes() + b"\n")
    assert index.search(new, k=1).model == solid.digest


def test_where_several_could_answer_one_is_to_be_named(mixed, tmp_path):
    """A name that both have, and a volume that either could be, need the model."""
    index, _ = mixed
    with pytest.raises(ModelError, match="name one of them"):
        index.search("hand_01")
    np.save(tmp_path / "a.npy", np.ones((5, 5)))
    with pytest.raises(ModelError, match="name one of them"):
        index.search(tmp_path / "a.npy")


def test_a_model_is_new_or_given(mixed):
    """A new model is learnt; one that is given is not new."""
    index, folder = mixed
    with pytest.raises(ParameterError, match="leave one of them out"):
        index.add(folder / "images", model=index.models()[0].digest, new_model=True)
