"""Writes to an index: rows, the paths that share one, labels and metadata; each whole or not at all."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from datetime import UTC, datetime
from typing import Any

from spem.errors import ParameterError, ReadError
from spem.index.changes import Known, Plan, place
from spem.index.database_errors import told
from spem.index.extra import require
from spem.index.filters import any_of, to_sql
from spem.index.row import Row
from spem.index.schema import LIGHT, schema, to_table
from spem.index.store import Store

# Rows that one filter names.
_AT_ONCE = 2000
_PATHS = ("id", "hash", "path", "copies")


def write(store: Store, digest: str, rows: Sequence[Row]) -> None:
    """Write rows in one step; those of an id that is there are replaced.

    A row that is there keeps its paths, and its label and metadata where the new one has none.

    Parameters
    ----------
    store
        The database.
    digest
        The model of their codes.
    rows
        The rows, their paths from the working directory; several of one id become one.

    Raises
    ------
    ParameterError
        When the codes have another length than the model's, or nothing can be written.
    """
    table = store.table(digest)
    with told(store.address):
        n_code = _n_code(table)
    odd = next((row for row in rows if len(row.code) != n_code), None)
    if odd is not None:
        msg = f"{odd.name}: a code of {len(odd.code)} numbers, those of model {digest} have {n_code}"
        raise ParameterError(msg)
    todo = list(rows)
    while todo:
        todo = _written(store, digest, todo)


def known(store: Store, digest: str) -> list[Known]:
    """Return what a plan needs of the rows."""
    query = store.query(digest).select(["hash", "path", "copies"])
    with told(store.address):
        records = query.to_list()
    return [
        Known(record["hash"], tuple(map(store.found, (record["path"], *record["copies"]))))
        for record in records
    ]


def relocate(store: Store, digest: str, plan: Plan) -> int:
    """Give rows the paths that a plan says they gain and lose, and delete those that are left without.

    Returns
    -------
    int
        Number of rows deleted.
    """
    contents = list(dict.fromkeys([*plan.gained, *plan.lost]))
    deleted = 0
    for some in _batches(contents):
        with store.writing():
            records = store.query(digest, any_of("hash", some)).select(list(_PATHS)).to_list()
            changed, without = [], []
            for record in records:
                paths = _moved(store, record, plan)
                if paths:
                    changed.append(
                        {"id": record["id"], "path": paths[0], "copies": paths[1:], "hash": record["hash"]}
                    )
                else:
                    without.append(record["id"])
            _update(store, digest, changed, _PATHS)
            deleted += _delete(store, digest, without)
    return deleted


def ids_of(store: Store, digest: str, names: Sequence[str]) -> list[str]:
    """Return the ids of rows by their ids or paths, in the order of these.

    Raises
    ------
    ReadError
        When one is no row.
    """
    ids = set(_read(store, store.table(digest), names))
    others, by_place = [name for name in names if name not in ids], defaultdict(list)
    if others:
        for row in store.rows(digest):
            for path in _paths(row):
                by_place[place(path)].append(row.id)
    stray = next((name for name in others if place(name) not in by_place), None)
    if stray is not None:
        msg = f"{stray}: neither id nor path of a shape of {store.address}; see: spem index list"
        raise ReadError(msg)
    return list(
        dict.fromkeys(key for name in names for key in ([name] if name in ids else by_place[place(name)]))
    )


def remove(store: Store, digest: str, ids: Sequence[str]) -> int:
    """Delete rows and return how many there were."""
    deleted = 0
    for some in _batches(list(dict.fromkeys(ids))):
        with store.writing():
            deleted += _delete(store, digest, some)
    return deleted


def remove_where(store: Store, digest: str, where: str) -> int:
    """Delete the rows that a filter lets through and return how many there were."""
    count = store.count(digest, where)
    with store.writing():
        store.table(digest).delete(to_sql(where))
    return count


def annotate(
    store: Store,
    digest: str,
    change: Callable[[Row], Row],
    ids: Sequence[str] | None = None,
    *,
    where: str | None = None,
) -> int:
    """Change the labels and metadata of rows, by ids or those that a filter lets through, or of all.

    Returns
    -------
    int
        Number of rows that differ then.
    """
    filters = [where] if ids is None else [any_of("id", some) for some in _batches(list(dict.fromkeys(ids)))]
    changed = 0
    for each in filters:
        with store.writing():
            records = []
            for row in store.rows(digest, each):
                new = change(row)
                if (new.label, dict(new.metadata)) != (row.label, dict(row.metadata)):
                    given = {"id": row.id, "label": new.label, "metadata": sorted(new.metadata.items())}
                    records.append(given)
            _update(store, digest, records, ("id", "label", "metadata"))
            changed += len(records)
    return changed


def _written(store: Store, digest: str, rows: Sequence[Row]) -> list[Row]:
    """Write rows, and return those to be written again since another changed them in between."""
    table = store.table(digest)
    ids = list(dict.fromkeys(row.id for row in rows))
    with store.writing():
        version = table.version
        merged = _merged([*_read(store, table, ids).values(), *rows])
        data = to_table([_stored(store, merged[row_id]) for row_id in ids], _n_code(table))
        result = (
            table.merge_insert("id").when_matched_update_all().when_not_matched_insert_all().execute(data)
        )
    if result.version == version + 1:
        return []
    # On object storage nobody is alone: what was there just before may not be what was read.
    before = _read(store, store.table_at(digest, result.version - 1), ids)
    return [
        _merged([row, merged[row_id]])[row_id]
        for row_id, row in before.items()
        if not set(map(place, _paths(row))) <= set(map(place, _paths(merged[row_id])))
    ]


def _n_code(table: Any) -> int:
    """Return the length of the codes of a table."""
    return int(table.schema.field("vector").type.list_size)


def _read(store: Store, table: Any, ids: Sequence[str]) -> dict[str, Row]:
    """Read rows by their ids, without codes, pictures and shapes."""
    rows: dict[str, Row] = {}
    for some in _batches(ids):
        with told(store.address):
            records = table.search().where(any_of("id", some)).select(list(LIGHT)).to_list()
        rows |= {row.id: row for row in map(store.row, records)}
    return rows


def _merged(rows: Iterable[Row]) -> dict[str, Row]:
    """Join rows of one id: the last one's contents, the paths of all."""
    merged: dict[str, Row] = {}
    for row in rows:
        old = merged.get(row.id)
        if old is None:
            merged[row.id] = row
            continue
        path, *copies = {place(each): each for each in (*_paths(old), *_paths(row))}.values()
        label, metadata = row.label or old.label, {**old.metadata, **row.metadata}
        merged[row.id] = replace(row, path=path, copies=tuple(copies), label=label, metadata=metadata)
    return merged


def _paths(row: Row) -> tuple[str, ...]:
    """Return all paths of a row."""
    return (row.path, *row.copies)


def _stored(store: Store, row: Row) -> Row:
    """Return a row with its paths as the table has them."""
    return replace(row, path=store.stored(row.path), copies=tuple(map(store.stored, row.copies)))


def _moved(store: Store, record: Mapping[str, Any], plan: Plan) -> list[str]:
    """Return the paths of a record after a plan, as the table has them."""
    content = record["hash"]
    lost = {place(path) for path in plan.lost.get(content, ())}
    had = map(store.found, (record["path"], *record["copies"]))
    paths = {place(path): path for path in (*had, *plan.gained.get(content, ()))}
    return [store.stored(path) for where, path in paths.items() if where not in lost]


def _update(store: Store, digest: str, records: Sequence[Mapping[str, Any]], columns: Sequence[str]) -> None:
    """Write some columns of rows that are there, and when."""
    if not records:
        return
    pa = require("pyarrow")
    table = store.table(digest)
    wanted = schema(_n_code(table))
    part = pa.schema([wanted.field(name) for name in (*columns, "added")])
    now = datetime.now(UTC)
    data = pa.Table.from_pylist([{**record, "added": now} for record in records], schema=part)
    table.merge_insert("id").when_matched_update_all().execute(data)


def _delete(store: Store, digest: str, ids: Sequence[str]) -> int:
    """Delete rows by id."""
    if not ids:
        return 0
    where = any_of("id", list(ids))
    count = store.count(digest, where)
    store.table(digest).delete(where)
    return count


def _batches(items: Sequence[str]) -> Iterable[list[str]]:
    """Cut a list into pieces that one filter may name."""
    return (list(items[start : start + _AT_ONCE]) for start in range(0, len(items), _AT_ONCE))
