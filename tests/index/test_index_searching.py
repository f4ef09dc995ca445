"""Tests of search: exact against all distances, filters, queries of every kind, several threads."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from datetime import timedelta
from pathlib import Path

import numpy as np
import pytest

from spem.codes.collection import encode_file
from spem.codes.model import Model
from spem.codes.settings import Settings
from spem.errors import ModelError, ParameterError, ReadError, ShapeError
from spem.index.index import Index
from spem.index.pinned import Pinned
from spem.index.row import Row
from spem.index.schema import LIGHT
from spem.index.snapshot import Snapshots
from spem.index.store import Store
from spem.index.updates import write
from spem.retrieval.distances import correlation_distance
from spem.shapes.shape import Shape


def _codes(index: Index) -> tuple[list[str], np.ndarray]:
    """Return the ids and codes of all rows, in order of id."""
    digest = index.digest()
    rows = index.store.rows(digest, columns=[*LIGHT, "vector"])
    rows.sort(key=lambda row: row.id)
    return [row.id for row in rows], np.stack([row.code for row in rows])


def _ids(answers: object) -> list[str]:
    """Return the ids of answers."""
    return [one.row.id for one in answers]  # type: ignore[attr-defined]


@pytest.mark.parametrize("memory", [2**30, 0])
def test_exact_search_has_the_order_of_all_distances(crowd: Index, memory: int) -> None:
    """In memory and in the database, answers are those of the full matrix of correlation distances."""
    index = replace(crowd, snapshots=Snapshots(memory))
    ids, codes = _codes(index)
    distances = correlation_distance(codes, codes)
    for at in (0, 17, 250):
        order = np.argsort(distances[at], kind="stable")[:25]
        answers = index.search(ids[at], 25)
        assert _ids(answers) == [ids[i] for i in order]
        assert np.allclose([one.distance for one in answers], distances[at][order], atol=1e-7)
        assert (answers.method, answers.recall, answers.model) == ("exact", None, index.digest())


def test_a_row_finds_itself_at_no_distance(crowd: Index) -> None:
    """The query of an id is its own first answer, at exactly zero."""
    found = crowd.search("shape 7", 1)[0]
    assert (found.rank, found.distance, found.row.name) == (1, 0.0, "shape 7")
    assert found.row.code.size == 0


def test_equal_codes_are_ordered_by_id(
    filled: Index, tiny_model: Model, ready_row: Callable[..., Row]
) -> None:
    """Codes that are equal, or differ by a factor and a constant, come in the order of their ids."""
    code = np.random.default_rng(1).standard_normal(tiny_model.n_code).astype(np.float32)
    rows = [replace(ready_row(name), code=2 * code + 1) for name in "abcdefgh"]
    write(filled.store, tiny_model.digest, rows)
    found = filled.search(code, 8)
    assert _ids(found) == sorted(row.id for row in rows)
    assert [one.distance for one in found] == pytest.approx([0] * 8, abs=1e-12)
    assert _ids(filled.search(code, 3)) == sorted(row.id for row in rows)[:3]


@pytest.mark.parametrize("memory", [2**30, 0])
def test_filters_come_before_the_nearest(crowd: Index, memory: int) -> None:
    """A filter leaves as many answers as are asked for, the nearest of the rows it lets through."""
    index = replace(crowd, snapshots=Snapshots(memory))
    found = index.search("shape 7", 10, where="label = '3' AND metadata.half = '0'")
    assert len(found) == 5
    assert {one.row.label for one in found} == {"3"}
    assert not index.search("shape 7", 10, where="label = 'nothing'")
    with pytest.raises(ParameterError, match="where='lable = 3': no filter of rows"):
        index.search("shape 7", where="lable = 3")


def test_matched_size_keeps_volumes_within_a_ratio(crowd: Index) -> None:
    """Volumes of answers are within the ratio, either way; a bare code has no volume."""
    volumes = [one.row.volume for one in crowd.search("shape 99", 300, volume_within=1.25)]
    assert (min(volumes), max(volumes), len(volumes)) == (80.0, 125.0, 46)
    both = crowd.search("shape 99", 300, volume_within=1.25, where="metadata.half = '1'")
    assert len(both) == 23
    with pytest.raises(ParameterError, match="a code has no volume"):
        crowd.search(np.ones(64), volume_within=1.25)
    with pytest.raises(ParameterError, match=r"volume_within=0.8: expected a ratio of volumes of at least 1"):
        crowd.search("shape 99", volume_within=0.8)


def test_search_sees_what_is_written_and_removed(
    filled: Index, tiny_model: Model, ready_row: Callable[..., Row]
) -> None:
    """Rows that another connection adds, replaces or removes count at the next search."""
    other = Index.open(filled.store.address)
    assert len(filled.search("cat", 10)) == 4
    write(other.store, tiny_model.digest, [ready_row("new", label="late")])
    assert {one.row.name for one in filled.search("cat", 10)} == {"cat", "dog", "cow", "d'oh", "new"}
    other.annotate(where="name = 'new'", label="later")
    assert filled.search("new", 1)[0].row.label == "later"
    other.remove(where="name = 'dog'")
    assert {one.row.name for one in filled.search("cat", 10)} == {"cat", "cow", "d'oh", "new"}
    moved = replace(ready_row("cow"), code=ready_row("cat").code)
    write(other.store, tiny_model.digest, [moved])
    assert filled.search("cat", 4)[1].distance == pytest.approx(0, abs=1e-12)


def test_queries_by_name_path_and_id(filled: Index, ready_row: Callable[..., Row]) -> None:
    """A shape of the index is meant by its id, its name or its path, quotes and all."""
    expected = ready_row("d'oh").id
    for query in (expected, "d'oh", "/nowhere/d'oh.png", Path("/nowhere/d'oh.png")):
        assert filled.search(query, 1)[0].row.id == expected
    with pytest.raises(ReadError, match="nobody: no such file, and no shape of the index has that id"):
        filled.search("nobody")


def test_ambiguous_names_are_refused(filled: Index, tiny_model: Model, ready_row: Callable[..., Row]) -> None:
    """A name that two rows have asks for the id of one."""
    write(filled.store, tiny_model.digest, [replace(ready_row("other"), name="cat")])
    with pytest.raises(ParameterError, match=r"cat: several shapes of the index have that name: .*id of one"):
        filled.search("cat")


def test_queries_by_file_and_shape(tmp_path: Path) -> None:
    """A file is encoded with the model of the index, unless the index has its content."""
    index = Index.open(tmp_path / "db")
    settings = Settings(features="spem", voxels=None, n_maps=2, n_centers=4, n_rho=8)
    for name, sides in (("wide", (6, 14)), ("square", (9, 9))):
        np.save(tmp_path / f"{name}.npy", np.ones(sides))
    index.add(tmp_path / "*.npy", settings=settings)
    assert index.search(tmp_path / "wide.npy", 1)[0].row.name == "wide"
    np.save(tmp_path / "new.npy", np.ones((9, 10)))
    shape = Shape.from_mask(np.ones((9, 10)))
    by_file, by_shape = index.search(str(tmp_path / "new.npy"), 2), index.search(shape, 2)
    by_code = index.search(encode_file(shape, index.model()), 2)
    assert _ids(by_file) == _ids(by_shape) == _ids(by_code)
    assert by_file[0].distance == pytest.approx(by_code[0].distance, abs=1e-6)
    assert len(index.search(shape, volume_within=1.1)) == 1
    np.save(tmp_path / "two.npy", np.pad(np.array([[1, 1, 0, 2, 2]]).repeat(3, 0), 1))
    with pytest.raises(ShapeError, match="holds 2 labels; add the file"):
        index.search(tmp_path / "two.npy")
    with pytest.raises(ModelError, match=r"a code of float64 of shape \(3,\), expected 64 finite numbers"):
        index.search(np.ones(3))


def test_arguments_out_of_range(filled: Index) -> None:
    """Numbers and wishes without meaning are told by name."""
    with pytest.raises(ParameterError, match="k=0 must be a whole number of at least 1"):
        filled.search("cat", 0)
    with pytest.raises(ParameterError, match="no approximate index; make it with: spem index optimize"):
        filled.search("cat", exact=False)
    with pytest.raises(ModelError, match="model 0123 is none of"):
        filled.search("cat", model="0123")


def test_many_threads_and_a_writer(crowd: Index, tiny_model: Model, ready_row: Callable[..., Row]) -> None:
    """Searches of several threads are right while rows are being added."""
    ids, _ = _codes(crowd)

    def ask(row_id: str) -> bool:
        return crowd.search(row_id, 3)[0].row.id == row_id

    with ThreadPoolExecutor(8) as threads:
        asked = threads.map(ask, ids[::5])
        for i in range(4):
            write(crowd.store, tiny_model.digest, [ready_row(f"late {i}")])
        assert all(asked)
    assert crowd.search("late 3", 1)[0].row.name == "late 3"


def test_an_empty_index_has_no_answers(tmp_path: Path, tiny_model: Model) -> None:
    """A table without rows is searched without complaint."""
    index = Index.open(tmp_path / "db")
    index.store.save_model(tiny_model)
    assert len(index.search(np.arange(64.0))) == 0


def test_a_version_that_is_cleaned_up_meanwhile(
    crowd: Index, tiny_model: Model, ready_row: Callable[..., Row], monkeypatch: pytest.MonkeyPatch
) -> None:
    """A search whose version of the table is deleted while it goes on is made again."""
    index = replace(crowd, snapshots=Snapshots(0))
    crowd.search("shape 7")
    old = index.snapshots.pinned(index.store, index.digest())
    write(index.store, tiny_model.digest, [ready_row("new")])
    index.optimize(older_than=timedelta(0))
    kept, once = index.snapshots.pinned, [old]

    def pinned(store: Store, digest: str) -> Pinned:
        return once.pop() if once else kept(store, digest)

    monkeypatch.setattr(index.snapshots, "pinned", pinned)
    assert index.search("new", 1)[0].row.name == "new"


@pytest.mark.parametrize("code", [np.array(["a"] * 64), np.zeros(64, complex), np.zeros(64, object)])
def test_codes_that_are_no_numbers_are_refused(filled, code):
    """A code is a vector of real numbers."""
    with pytest.raises(ModelError, match="finite numbers"):
        filled.search(code)


def test_a_filter_is_text(filled):
    """What is no SQL is refused before the database sees it."""
    with pytest.raises(ParameterError, match="a filter is SQL"):
        filled.search("cat", where=5)
