"""Tests of the database under an index."""

from __future__ import annotations

import errno
import os
import shutil
from collections.abc import Callable
from datetime import timedelta
from functools import partial
from pathlib import Path

import numpy as np
import pytest

from spem.codes.model import Model
from spem.errors import ModelError, ParameterError, ReadError
from spem.index import schema
from spem.index.database_errors import told
from spem.index.index import Index
from spem.index.row import Row
from spem.index.store import Store
from spem.index.updates import known, write

AsRoot = pytest.mark.skipif(not hasattr(os, "geteuid") or os.geteuid() == 0, reason="root may write anywhere")


def test_open_makes_nothing_before_there_is_a_model(tmp_path: Path) -> None:
    """An index begins with its first model; until then there is none to be read."""
    folder = tmp_path / "db"
    assert Store.open(folder).digests() == ()
    with pytest.raises(ReadError, match=r"no index there; make one with: spem index add"):
        Store.open(folder, create=False)


def test_open_refuses_files_and_folders_of_other_things(tmp_path: Path) -> None:
    """A file, or a folder of shapes, is not taken for an index nor made into one."""
    (tmp_path / "hand.png").touch()
    with pytest.raises(ReadError, match="a file, not an index"):
        Store.open(tmp_path / "hand.png")
    with pytest.raises(ReadError, match=r"a folder of other things \(hand.png\)"):
        Store.open(tmp_path)
    assert [path.name for path in tmp_path.iterdir()] == ["hand.png"]


def test_open_refuses_another_database(tmp_path: Path) -> None:
    """A database that spem did not make is left alone."""
    lancedb, pa = pytest.importorskip("lancedb"), pytest.importorskip("pyarrow")
    lancedb.connect(tmp_path / "one").create_table("things", pa.table({"a": [1]}))
    with pytest.raises(ReadError, match=r"a database of other things \(things\)"):
        Store.open(tmp_path / "one")
    lancedb.connect(tmp_path / "two").create_table("models", pa.table({"a": [1]}))
    with pytest.raises(ReadError, match="a database of other things"):
        Store.open(tmp_path / "two")


def test_open_refuses_a_later_layout(
    tmp_path: Path, tiny_model: Model, monkeypatch: pytest.MonkeyPatch
) -> None:
    """An index of a later spem asks for an upgrade."""
    with monkeypatch.context() as later:
        later.setattr(schema, "LAYOUT", schema.LAYOUT + 1)
        Store.open(tmp_path).save_model(tiny_model)
    with pytest.raises(ModelError, match=r"layout 2 is later than 1; upgrade spem"):
        Store.open(tmp_path)


def test_models_come_back_whole(tmp_path: Path, tiny_model: Model) -> None:
    """A model is read as it was written, by another process too."""
    Store.open(tmp_path).save_model(tiny_model)
    other = Store.open(tmp_path, create=False)
    other.save_model(tiny_model)
    assert other.digests() == (tiny_model.digest,)
    assert other.load_model(tiny_model.digest).digest == tiny_model.digest
    with pytest.raises(ModelError, match=f"no model abc; it has {tiny_model.digest}"):
        other.load_model("abc")


def test_rows_are_sorted_and_paged(filled: Index) -> None:
    """Pages of an order follow one another without gaps."""
    assert [row.name for row in filled.rows(sort="volume")] == ["cow", "dog", "cat", "d'oh"]
    pages = [row.name for i in range(0, 4, 2) for row in filled.rows(sort="name", limit=2, offset=i)]
    assert pages == ["cat", "cow", "d'oh", "dog"]
    assert filled.rows(sort="name", descending=True, limit=1)[0].name == "dog"
    with pytest.raises(ParameterError, match="no order of rows"):
        filled.rows(sort="vector")


def test_tables_follow_what_others_write(
    filled: Index, tiny_model: Model, ready_row: Callable[..., Row]
) -> None:
    """A store that is open sees rows that another one writes."""
    other = Index.open(filled.store.address)
    assert len(other) == 4
    write(filled.store, tiny_model.digest, [ready_row("hen")])
    assert len(other) == 5


def test_compact_keeps_the_rows_and_drops_old_files(
    tmp_path: Path, tiny_model: Model, ready_row: Callable[..., Row]
) -> None:
    """Many small writes become few files that hold the same."""
    index = Index.open(tmp_path)
    index.store.save_model(tiny_model)
    for i in range(12):
        write(index.store, tiny_model.digest, [ready_row(f"{i}")])
    before = sum(1 for path in tmp_path.rglob("*") if path.is_file())
    index.store.compact(timedelta(0))
    assert sum(1 for path in tmp_path.rglob("*") if path.is_file()) < before / 2
    assert {row.name for row in index.rows()} == {f"{i}" for i in range(12)}
    assert index.check() == ()


@pytest.mark.parametrize("damage", ["truncated", "emptied", "deleted", "overwritten"])
def test_damaged_data_are_told_on_one_line(filled: Index, damage: str) -> None:
    """Whatever became of a file of the database, one line says so and names the index."""
    address = Path(filled.store.address)
    for file in address.glob("codes-*.lance/data/*.lance"):
        content = file.read_bytes()
        if damage == "deleted":
            file.unlink()
        else:
            kept = {"truncated": content[: len(content) // 2], "emptied": b""}
            file.write_bytes(kept.get(damage, b"\xff" * len(content)))
    index = Index.open(address)
    for read in (index.rows, lambda: known(index.store, index.digest())):
        with pytest.raises(ReadError, match=r"shapes.db: damaged \(.*\); see: spem index check") as refused:
            read()
        assert "\n" not in str(refused.value)
        assert ".rs" not in str(refused.value)


def test_an_index_that_was_removed_is_told(filled: Index, ready_row: Callable[..., Row]) -> None:
    """Of an index that is gone while it is open, reading and writing say so on one line."""
    digest = filled.digest()
    shutil.rmtree(filled.store.address)
    writes = partial(write, filled.store, digest, [ready_row("cow")])
    for use in (partial(known, filled.store, digest), partial(filled.store.count, digest), writes):
        with pytest.raises(ReadError, match="damaged") as refused:
            use()
        assert ".rs" not in str(refused.value)


def test_no_room_for_temporary_files_is_told(
    filled: Index, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A model is read by way of a file; where that cannot be written, one line says so."""

    def full(_: int) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr("spem.files.os.fsync", full)
    with pytest.raises(ParameterError, match="cannot be written"):
        Index.open(filled.store.address).model()


def test_a_table_half_made_is_made_again(
    tmp_path: Path, tiny_model: Model, ready_row: Callable[..., Row]
) -> None:
    """What a killed writer leaves of a table that it was making does not stand in the way."""
    Store.open(tmp_path).save_model(tiny_model)
    table = next(tmp_path.glob("codes-*.lance"))
    shutil.rmtree(table / "_versions")
    index = Index.open(tmp_path)
    index.store.save_model(tiny_model)
    write(index.store, tiny_model.digest, [ready_row("cat")])
    assert [row.name for row in index.rows()] == ["cat"]


@AsRoot
def test_a_folder_that_is_read_only_is_told(filled: Index, tiny_model: Model) -> None:
    """Reading goes on where writing is forbidden, and writing says why not."""
    folder = Path(filled.store.address)
    folder.chmod(0o500)
    try:
        assert len(filled) == 4
        with pytest.raises(ParameterError, match="cannot be written to"):
            filled.remove(where="volume > 0")
    finally:
        folder.chmod(0o700)


def test_a_full_disk_is_told() -> None:
    """No room is told apart from damage."""
    with pytest.raises(ParameterError, match="no room left to write"), told("db", writing=True):
        raise OSError(28, "No space left on device")
    with (
        pytest.raises(ParameterError, match=r"cannot be written to .*Permission denied"),
        told("db", writing=True),
    ):
        raise OSError(13, "Permission denied (os error 13)")


def test_a_panic_is_told() -> None:
    """A panic of the database, which is no Exception, becomes one of ours."""

    class PanicException(BaseException):
        """As Rust raises it."""

    with pytest.raises(ReadError, match="damaged"), told("db"):
        raise PanicException


def test_nothing_is_written_to_stderr(filled: Index, capfd: pytest.CaptureFixture[str]) -> None:
    """The database keeps its warnings to itself."""
    filled.annotate(label="x")
    filled.store.table(filled.digest()).search(np.ones(64, np.float32)).limit(1).to_list()
    filled.store.compact()
    assert capfd.readouterr().err == ""


def test_an_index_without_its_models_is_told_apart(filled):
    """Where the table of models is gone, the message says so rather than that this is no index."""
    shutil.rmtree(Path(filled.store.address) / "models.lance")
    with pytest.raises(ReadError, match="table of models is gone"):
        Store.open(filled.store.address)
