"""Shapes added to an index: the model that it learns, what is done again and what is not."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import spem
from spem.codes.work import clear_work
from spem.errors import LabelError, ModelError, ParameterError, ReadError
from spem.index import encoding
from spem.index.adding import work_folder
from spem.index.index import Index

QUICK = {"features": "spem", "voxels": None, "n_maps": 3, "n_centers": 4, "n_rho": 16}


@pytest.fixture
def shapes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return a folder of five bars, two of them equal, in the working directory."""
    monkeypatch.chdir(tmp_path)
    folder = Path("shapes")
    folder.mkdir()
    for n in (7, 8, 9, 10):
        np.save(folder / f"{n}.npy", np.ones((n, 12)))
    np.save(folder / "again.npy", np.ones((7, 12)))
    return folder


@pytest.fixture
def computed(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Return a list that the name of each shape is put in whose features are computed."""
    names: list[str] = []
    features = encoding.shape_features

    def counted(shape: spem.Shape, *rest: object) -> object:
        names.append(shape.name)
        return features(shape, *rest)

    monkeypatch.setattr(encoding, "shape_features", counted)
    return names


def stop_after(count: int) -> Callable[[str, int, int], None]:
    """Return progress that interrupts when so many sources are written."""

    def progress(stage: str, done: int, total: int) -> None:
        if (stage, done) == ("codes", count):
            raise KeyboardInterrupt

    return progress


def test_new_index_has_the_model_and_codes_of_encode(shapes, computed):
    """A folder added to a new index gets the model and the codes that `spem.encode` makes of it."""
    codes = spem.encode([shapes], **QUICK)
    index = Index.open("db")
    added = index.add(shapes, **QUICK)
    assert (added.added, added.unchanged, added.model) == (5, 0, codes.model.digest)
    assert len(index) == 4
    assert len(computed) == 4
    code = index.search(shapes / "9.npy", k=4)[0]
    assert (code.row.name, code.distance) == ("9", pytest.approx(0, abs=1e-6))
    vector = index.get(code.row.id).code
    expected = codes.vectors[codes.names.index("9")]
    assert np.corrcoef(vector, expected)[0, 1] == pytest.approx(1, abs=1e-6)


def test_sample_is_that_of_encode(shapes, computed, monkeypatch):
    """With more files than the sample takes, the model is still that of `spem.encode`, of fewer features."""
    monkeypatch.setattr("spem.codes.collection.TRAINING_SHAPES", 2)
    monkeypatch.setattr("spem.index.adding.TRAINING_SHAPES", 2)
    expected = spem.encode([shapes], **QUICK).model.digest
    stages = []
    added = Index.open("db").add(shapes, progress=lambda *told: stages.append(told), **QUICK)
    assert added.model == expected
    assert max(done for stage, done, _ in stages if stage == "fields") == 2
    assert len(computed) == 4


def test_second_addition_computes_nothing(shapes, computed):
    """Files that are there already are told apart by their bytes alone."""
    index = Index.open("db")
    index.add(shapes, **QUICK)
    computed.clear()
    assert index.add(shapes).unchanged == 5
    assert index.add(shapes, **QUICK).unchanged == 5
    assert computed == []


def test_changed_and_vanished_files(shapes):
    """A file that holds something else is encoded again; one that is gone goes when that is asked."""
    index = Index.open("db")
    index.add(shapes, **QUICK)
    np.save(shapes / "8.npy", np.ones((11, 12)))
    (shapes / "9.npy").unlink()
    added = index.add(shapes)
    assert (added.added, added.updated, added.unchanged, added.removed, added.gone) == (0, 1, 4 - 1, 0, 1)
    assert {row.name: row.n_nodes for row in index.rows()} == {"7": 84, "8": 132, "9": 108, "10": 120}
    assert index.add(shapes, prune=True).removed == 1
    assert "9" not in {row.name for row in index.rows()}


def test_failures_are_told_and_tried_again(shapes, computed):
    """A file that cannot be read costs itself alone, each time until it can."""
    (shapes / "bad.obj").write_text("nothing")
    told = []
    index = Index.open("db")
    added = index.add(shapes, on_failure=told.append, **QUICK)
    assert (added.added, [failure.path for failure in told]) == (5, [str(shapes / "bad.obj")])
    assert added.failures == tuple(told)
    shutil.copy(shapes / "7.npy", "whole.npy")
    (shapes / "bad.obj").unlink()
    np.save(shapes / "bad.npy", np.ones((5, 12)))
    assert index.add(shapes).added == 1


def test_interrupted_addition_goes_on(shapes, computed, monkeypatch):
    """What was told to be written is there after Ctrl-C, and no features are computed twice."""
    monkeypatch.setattr("spem.index.batches.ROWS", 1)
    index = Index.open("db")
    with pytest.raises(KeyboardInterrupt):
        index.add(shapes, progress=stop_after(2), **QUICK)
    assert len(Index.open("db")) >= 2
    assert len(computed) == 4
    again = Index.open("db")
    assert again.add(shapes, **QUICK).model == index.digest()
    assert len(again) == 4
    assert len(computed) == 4
    assert not work_folder("db").exists()


def test_work_before_there_is_a_model_is_kept(shapes, computed):
    """Interrupted while it learns, an index goes on from the features that were computed."""

    def stop(stage: str, done: int, total: int) -> None:
        if done == 3:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        Index.open("db").add(shapes, progress=stop, work="kept", **QUICK)
    assert len(computed) == 3
    Index.open("db").add(shapes, work="kept", **QUICK)
    assert len(computed) == 4
    clear_work("kept")
    assert not Path("kept").exists()


def test_other_dimensions_fail_clearly(shapes):
    """A solid among silhouettes is a failure, when the model is learnt and afterwards."""
    np.save(shapes / "solid.npy", np.ones((5, 5, 5)))
    index = Index.open("db")
    assert "a 3-D shape among 2-D ones" in index.add(shapes, **QUICK).failures[0].reason
    assert "a 3-D shape, but the vocabulary is of 2-D ones" in index.add(shapes).failures[0].reason


def test_each_label_of_a_volume_is_a_row(tmp_path):
    """A label volume gives a row for each of its labels, with labels by name."""
    volume = np.zeros((12, 14, 12), np.uint8)
    volume[1:6, 2:8, 2:9] = 1
    volume[7:11, 2:12, 2:9] = 5
    np.save(tmp_path / "teeth.npy", volume)
    index = Index.open(tmp_path / "db")
    index.add(tmp_path / "teeth.npy", labels={"teeth-5": "molar"}, **QUICK)
    assert {row.name: row.label for row in index.rows()} == {"teeth-1": "", "teeth-5": "molar"}
    assert {row.id[20:] for row in index.rows()} == {"-1", "-5"}


def test_labels_and_metadata(shapes, tmp_path):
    """Rows get the labels of their files and the same metadata; labels may come later."""
    index = Index.open("db")
    index.add(shapes, labels={"8.npy": "wide"}, metadata={"site": "Oslo"}, keep_shapes=False, **QUICK)
    assert {row.name: row.label for row in index.rows()} == {"7": "", "8": "wide", "9": "", "10": ""}
    assert all(row.metadata == {"site": "Oslo"} for row in index.rows())
    assert index.get(index.rows()[0].id).shape == b""
    index.add(shapes, labels={"9.npy": "wider"}, metadata={"by": "Kari"})
    labels = {row.name: row.label for row in index.rows()}
    assert labels == {"7": "", "8": "wide", "9": "wider", "10": ""}
    assert all(row.metadata == {"site": "Oslo", "by": "Kari"} for row in index.rows())
    with pytest.raises(LabelError, match="several labels fit"):
        index.add(shapes, labels={"a/8.npy": "x", "b/8.npy": "y"})
    with pytest.raises(ParameterError, match="expected str, got int; write metadata n as text"):
        index.add(shapes, metadata={"n": 3})


def test_shapes_in_memory_are_added_by_name(tmp_path):
    """Shapes that are no files have their names for paths."""
    index = Index.open(tmp_path)
    disk, star = spem.synthetic.disk(radius=6.0, spacing=1.0), spem.synthetic.star_polygon(5, 2)
    assert index.add([disk, star], **QUICK).added == 2
    assert index.add(disk).unchanged == 1
    assert {row.path for row in index.rows()} == {disk.name, star.name}


def test_several_processes_make_the_same_rows(shapes):
    """Rows do not depend on the number of processes."""
    one, two = Index.open("one"), Index.open("two")
    one.add(shapes, **QUICK)
    two.add(shapes, n_jobs=2, **QUICK)
    first, second = ({row.id: (row.path, row.name) for row in index.rows()} for index in (one, two))
    assert first == second
    for row_id in first:
        np.testing.assert_array_equal(one.get(row_id).code, two.get(row_id).code)


def test_settings_of_a_model_stay(shapes):
    """Settings other than the model's are refused with its own, and so are contradictory ones."""
    index = Index.open("db")
    index.add(shapes, **QUICK)
    with pytest.raises(ParameterError, match=r"n_maps=5: model \w+ has n_maps=3"):
        index.add(shapes, n_maps=5)
    with pytest.raises(ModelError, match=r"was made with other settings .*n_maps 8 against 3"):
        index.add(shapes, settings=spem.Settings(features="spem", voxels=None))
    with pytest.raises(ParameterError, match="settings and voxels exclude each other"):
        index.add(shapes, settings=spem.Settings(), voxels=3)


def test_nothing_to_add(tmp_path):
    """Without a source, or with none that can be read, there is no model and a clear word."""
    index = Index.open(tmp_path / "db")
    with pytest.raises(ParameterError, match="no sources were given"):
        index.add([])
    (tmp_path / "bad.obj").write_text("nothing")
    with pytest.raises(ReadError, match=r"no shape could be read, so there is no model: .*bad.obj") as caught:
        index.add(tmp_path / "bad.obj")
    assert len(caught.value.failures) == 1
    assert index.store.digests() == ()
    assert not work_folder(str(tmp_path / "db")).exists()


def test_work_on_object_storage_is_in_the_cache(monkeypatch):
    """For an address that is no folder, work goes to the user's cache, apart for each address."""
    monkeypatch.setenv("XDG_CACHE_HOME", "/cache")
    first, second = work_folder("s3://bucket/a"), work_folder("s3://bucket/b")
    assert first.parent == second.parent == Path("/cache/spem")
    assert first != second
