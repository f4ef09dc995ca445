"""Tests of writes to an index."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from threading import Thread

import numpy as np
import pytest

from spem.codes.model import Model
from spem.errors import ParameterError, ReadError
from spem.index.changes import Plan, plan
from spem.index.filters import literal
from spem.index.index import Index
from spem.index.row import Row
from spem.index.updates import annotate, known, relocate, remove, remove_where, write

Maker = Callable[..., Row]

# A process that becomes two before either opens the index; both write shared and own rows in small steps.
_WRITERS = """
import os, sys, hashlib, numpy as np
from spem.index.store import Store
from spem.index.row import Row, row_id
from spem.index.updates import write
child = os.fork()
me = "b" if child else "a"
store = Store.open(sys.argv[1])
[digest] = store.digests()
for i in range(15):
    keys = [hashlib.sha256(word.encode()).hexdigest() for word in (f"shared {i}", f"{me} {i}")]
    rows = [Row(row_id(k), k, k[:4], f"/{me}/{k[:9]}.png", np.arange(64, dtype="f4")) for k in keys]
    write(store, digest, rows)
sys.stdout.flush()
os._exit(os.waitpid(child, 0)[1] if child else 0)
"""


def test_equal_contents_become_one_row(filled: Index, tiny_model: Model, ready_row: Maker) -> None:
    """The same content under two paths is one row that has both."""
    write(filled.store, tiny_model.digest, [ready_row("cat", path="/elsewhere/cat.png")])
    [row] = filled.rows("name = 'cat'")
    assert (row.path, row.copies) == ("/nowhere/cat.png", ("/elsewhere/cat.png",))
    assert (row.label, dict(row.metadata)) == ("cats", {"site": "Oslo", "the age": "3"})
    write(filled.store, tiny_model.digest, [ready_row("cat", path="/elsewhere/cat.png", label="tiger")])
    [row] = filled.rows("name = 'cat'")
    assert (row.label, len(row.copies)) == ("tiger", 1)
    assert len(filled) == 4


def test_one_batch_may_hold_a_content_twice(filled: Index, tiny_model: Model, ready_row: Maker) -> None:
    """Rows of one id within a batch become one."""
    write(filled.store, tiny_model.digest, [ready_row("hen", path=f"/{i}.png") for i in range(3)])
    [row] = filled.rows("name = 'hen'")
    assert (row.path, row.copies) == ("/0.png", ("/1.png", "/2.png"))


def test_codes_of_another_length_are_refused(filled: Index, tiny_model: Model, ready_row: Maker) -> None:
    """A row whose code cannot be of the model is not written."""
    row = replace(ready_row("hen"), code=np.ones(3, np.float32))
    with pytest.raises(ParameterError, match=r"hen: a code of 3 numbers, those of model .* have 64"):
        write(filled.store, tiny_model.digest, [row])


def test_paths_start_from_the_index(
    tmp_path: Path, tiny_model: Model, ready_row: Maker, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Index and shapes may be moved together; relative paths are found from any working directory."""
    (tmp_path / "one").mkdir()
    (tmp_path / "one" / "hen.png").touch()
    monkeypatch.chdir(tmp_path / "one")
    index = Index.open("shapes.db")
    index.store.save_model(tiny_model)
    write(index.store, tiny_model.digest, [ready_row("hen", path="hen.png"), ready_row("disk", path="disk")])
    assert {row.path for row in index.rows()} == {"hen.png", "disk"}
    monkeypatch.chdir(tmp_path)
    (tmp_path / "one").rename(tmp_path / "two")
    moved = Index.open(Path("two", "shapes.db"))
    assert {row.path for row in moved.rows()} == {str(Path("two", "hen.png")), "disk"}
    assert moved.find([str(Path("two", "hen.png"))]) == [ready_row("hen").id]


def test_names_that_are_no_text_are_kept_as_escapes(
    tmp_path: Path, tiny_model: Model, ready_row: Maker
) -> None:
    """A file whose name is no UTF-8 has a row, and is found again."""
    index = Index.open(tmp_path / "db")
    index.store.save_model(tiny_model)
    odd = os.fsdecode(b"/nowhere/caf\xe9.png")
    row = replace(ready_row("odd"), path=odd, name=os.fsdecode(b"caf\xe9"))
    write(index.store, tiny_model.digest, [row, ready_row("cow")])
    assert plan(known(index.store, tiny_model.digest), [(Path(odd), row.hash)]).n_unchanged == 1
    assert index.find([odd]) == [row.id]
    assert index.rows(f"path = {literal(odd)}")[0].name == "caf\\udce9"


def test_relocate_moves_paths_and_deletes_rows_without(filled: Index, tiny_model: Model) -> None:
    """A plan's paths are gained and lost; a row without a path goes, with all labels of its content."""
    hashes = {row.name: row.hash for row in filled.rows()}
    moves = Plan(
        gained={hashes["cat"]: ("/new/cat.png",), hashes["dog"]: ("/new/dog.png",)},
        lost={hashes["cat"]: ("/nowhere/cat.png",), hashes["cow"]: ("/nowhere/cow.png",)},
    )
    assert relocate(filled.store, tiny_model.digest, moves) == 1
    rows = {row.name: row for row in filled.rows()}
    assert set(rows) == {"cat", "dog", "d'oh"}
    assert (rows["cat"].path, rows["cat"].copies) == ("/new/cat.png", ())
    assert rows["dog"].copies == ("/new/dog.png",)
    assert {known.paths for known in known(filled.store, tiny_model.digest)} >= {("/new/cat.png",)}
    assert filled.check() == ()


def test_annotate_writes_only_what_changes(filled: Index, tiny_model: Model) -> None:
    """Rows that have the label already are left alone, others told as changed, codes and all kept."""
    ids = [row.id for row in filled.rows()]
    before = filled.get(ids[0])
    assert annotate(filled.store, tiny_model.digest, lambda row: replace(row, label="cats"), ids=ids) == 3
    assert filled.count("label = 'cats'") == 4
    after = filled.get(ids[0])
    assert np.array_equal(after.code, before.code)
    assert after.shape == before.shape


def test_remove_counts_what_there_was(filled: Index, tiny_model: Model) -> None:
    """Ids that are no rows count for nothing."""
    [cat] = filled.rows("name = 'cat'")
    assert remove(filled.store, tiny_model.digest, [cat.id, cat.id, "nothing"]) == 1
    assert remove_where(filled.store, tiny_model.digest, "metadata.site = 'Rome'") == 1
    assert len(filled) == 2
    with pytest.raises(ReadError, match="neither id nor path"):
        filled.find(["nothing"])


def test_threads_write_at_once(filled: Index, tiny_model: Model, ready_row: Maker) -> None:
    """Threads that share an index lose nothing."""
    threads = [
        Thread(
            target=write, args=(filled.store, tiny_model.digest, [ready_row(f"{i % 5}", path=f"/{i}.png")])
        )
        for i in range(12)
    ]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    rows = [row for row in filled.rows() if row.name.isdigit()]
    assert sorted(row.name for row in rows) == ["0", "1", "2", "3", "4"]
    assert {path for row in rows for path in (row.path, *row.copies)} == {f"/{i}.png" for i in range(12)}


@pytest.mark.skipif(not hasattr(os, "fork"), reason="no fork on this system")
def test_processes_write_at_once(filled: Index) -> None:
    """Two processes that write the same and other contents lose nothing and double nothing."""
    done = subprocess.run([sys.executable, "-c", _WRITERS, filled.store.address], check=True, timeout=120)
    assert done.returncode == 0
    rows = filled.rows("path LIKE '/a/%' OR path LIKE '/b/%'")
    assert len(rows) == len({row.id for row in rows}) == 45
    assert sum(len(row.copies) for row in rows) == 15
