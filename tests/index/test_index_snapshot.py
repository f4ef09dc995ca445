"""Tests of codes kept in memory."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from spem.codes.model import Model
from spem.index import snapshot
from spem.index.index import Index
from spem.index.pinned import Pinned
from spem.index.row import Row
from spem.index.snapshot import Snapshot, Snapshots, read, renewed
from spem.index.updates import write


def _of(kept: Snapshots, index: Index, digest: str) -> Snapshot | None:
    """Return the snapshot of a table as it is now."""
    return kept.of(kept.pinned(index.store, digest), digest)


def test_a_snapshot_is_kept_until_the_table_changes(crowd: Index, ready_row: Callable[..., Row]) -> None:
    """It is read once; after a write there is another, of the new version."""
    kept, digest = Snapshots(), crowd.digest()
    first = _of(kept, crowd, digest)
    assert first is not None
    assert _of(kept, crowd, digest) is first
    write(crowd.store, digest, [ready_row("new")])
    second = _of(kept, crowd, digest)
    assert second is not None
    assert second.pinned.version > first.pinned.version
    assert (len(first.ids), len(second.ids)) == (300, 301)


@pytest.mark.parametrize("fetched", [500, 2])
def test_a_renewed_snapshot_is_one_read_anew(
    crowd: Index, ready_row: Callable[..., Row], monkeypatch: pytest.MonkeyPatch, fetched: int
) -> None:
    """Added, replaced and removed rows come to the same codes as reading all of them."""
    monkeypatch.setattr(snapshot, "_FETCHED", fetched)
    digest = crowd.digest()
    old = read(Pinned.newest(crowd.store, digest))
    write(
        crowd.store, digest, [ready_row("new"), replace(ready_row("shape 3"), code=ready_row("other").code)]
    )
    write(crowd.store, digest, [ready_row(f"more {i}") for i in range(3)])
    crowd.remove(where="label = '4'")
    newest = Pinned.newest(crowd.store, digest)
    late, fresh = renewed(old, newest), read(newest)
    assert len(late.ids) == len(fresh.ids) == 294
    assert np.array_equal(late.ids[late.order], fresh.ids[fresh.order])
    assert np.array_equal(late.vectors[late.order], fresh.vectors[fresh.order])
    assert len(old.ids) == 300


def test_memory_bounds_what_is_kept(crowd: Index, tiny_model: Model) -> None:
    """Codes over the budget stay in the database; of two models the one that is asked for is kept."""
    digest = crowd.digest()
    size = 300 * tiny_model.n_code * 4
    assert _of(Snapshots(size - 1), crowd, digest) is None
    kept = Snapshots(size)
    rng = np.random.default_rng(9)
    other = Model.fit(tiny_model.settings, [(rng.random((50, 2)),) for _ in range(3)], ndim=2)
    crowd.store.save_model(other)
    first = _of(kept, crowd, digest)
    assert _of(kept, crowd, other.digest) is not None
    assert _of(kept, crowd, digest) is first
    row = Row("9f", "9f", "one", "one", np.arange(64, dtype=np.float32))
    write(crowd.store, other.digest, [row])
    assert _of(kept, crowd, other.digest) is not None
    assert _of(kept, crowd, digest) is not first


def test_filters_are_remembered(crowd: Index) -> None:
    """The rows of a filter are looked up once, and the oldest filters forgotten."""
    held = read(Pinned.newest(crowd.store, crowd.digest()))
    rows = held.matching("label = '3'")
    assert len(rows) == 10
    assert held.matching("label = '3'") is rows
    for i in range(40):
        held.matching(f"volume < {i}")
    assert held.matching("label = '3'") is not rows


def test_records_in_memory_and_from_the_database(crowd: Index, monkeypatch: pytest.MonkeyPatch) -> None:
    """Of many rows only ids are kept, and what answers tell of them is read when it is needed."""
    small = read(Pinned.newest(crowd.store, crowd.digest()))
    monkeypatch.setattr(snapshot, "_ROWS_IN_MEMORY", 10)
    large = read(Pinned.newest(crowd.store, crowd.digest()))
    assert large.rows is None
    ids = [large.ids[place].decode() for place in (5, 200, 7)]
    found = [[record["name"] for record in one.records(one.positions(ids))] for one in (small, large)]
    assert found[0] == found[1]
    assert large.positions(["nothing", ids[0]]).tolist() == [5]


def test_a_model_that_is_added_again_is_read_anew(
    crowd: Index, ready_row: Callable[..., Row], tiny_model: Model
) -> None:
    """Its table counts versions from the start; what was held of the one before is not taken for it."""
    kept, digest = Snapshots(), crowd.digest()
    for label in "ab":
        crowd.annotate(where="volume < 3", label=label)
    before = _of(kept, crowd, digest)
    crowd.drop(digest)
    crowd.store.save_model(tiny_model)
    write(crowd.store, digest, [ready_row("new")])
    after = _of(kept, crowd, digest)
    assert before is not None
    assert after is not None
    assert after.pinned.version < before.pinned.version
    assert [key.decode() for key in after.ids] == [ready_row("new").id]


def test_a_model_that_is_dropped_is_let_go_of(
    crowd: Index, ready_row: Callable[..., Row], tiny_model: Model
) -> None:
    """Of a model that is added again at once nothing old is found, whatever versions its table has."""
    digest, code = crowd.digest(), ready_row("new").code
    assert len(crowd.search(code, 300, model=digest)) == 300
    crowd.drop(digest)
    crowd.store.save_model(tiny_model)
    write(crowd.store, digest, [ready_row("new")])
    assert [answer.row.name for answer in crowd.search(code, 300, model=digest)] == ["new"]
