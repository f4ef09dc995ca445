"""Whether an index is whole: every row readable and what it says it is."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from spem.codes.codes import file_hash
from spem.errors import ReadError, SpemError
from spem.index import updates
from spem.index.database_errors import brief, told
from spem.index.filters import literal
from spem.index.row import ID_DIGITS, names_file, unpack
from spem.index.schema import HEAVY, LIGHT, layout_of
from spem.index.store import Store

# A code of unit length is one to this, in float32.
_UNIT = 1e-4
_AT_ONCE = 256


@dataclass(frozen=True)
class Finding:
    """Something that is wrong.

    Parameters
    ----------
    where
        Id of the row, or what else it is about.
    reason
        What is wrong, and what to do.
    model
        Digest of the model of the row, empty for others.
    repairable
        Whether removing the row mends it.
    """

    where: str
    reason: str
    model: str = ""
    repairable: bool = False

    def __str__(self) -> str:
        return f"{self.where}: {self.reason}"


def check(store: Store, *, files: bool = False, repair: bool = False) -> tuple[Finding, ...]:
    """Read everything in an index and return what is wrong.

    Every model is whole and of its digest. Every row can be read, its code is finite and of unit length, its
    id is that of its hash and of no other row, its shape unpacks to what it says.

    Parameters
    ----------
    store
        The database.
    files
        Whether the files that shapes came from are looked at too: gone, or changed.
    repair
        Whether rows that are damaged or doubled are removed; of doubled ones one stays.
    """
    findings: list[Finding] = []
    for digest in store.digests():
        found = [*_check_model(store, digest), *_check_rows(store, digest)]
        if repair:
            _repair(store, digest, found)
        findings += found
        if files:
            findings += _check_files(store, digest)
    return tuple(findings)


def _check_model(store: Store, digest: str) -> Iterator[Finding]:
    """Yield what is wrong with a model and the layout of its table."""
    try:
        layout = layout_of(store.table(digest).schema)
        if layout is None:
            yield Finding(digest, "its table has no layout number; not made by spem")
        store.load_model(digest, again=True)
    except SpemError as error:
        yield Finding(digest, str(error))


def _check_rows(store: Store, digest: str) -> Iterator[Finding]:
    """Yield what is wrong with the rows of a model."""
    seen: set[str] = set()
    try:
        for record in _records(store, digest):
            row_id = record["id"]
            if row_id in seen:
                yield Finding(row_id, "is there twice; --repair keeps one of them", digest, repairable=True)
            seen.add(row_id)
            for reason in _faults(record):
                yield Finding(row_id, f"{reason}; --repair removes it", digest, repairable=True)
    except SpemError as error:
        yield Finding(f"model {digest}", str(error))


def _records(store: Store, digest: str) -> Iterator[dict[str, Any]]:
    """Yield the rows of a model with all their columns, some at a time."""
    query = store.query(digest).select([*LIGHT, *HEAVY])
    with told(store.address):
        for batch in query.to_batches(_AT_ONCE):
            yield from batch.to_pylist()


def _faults(record: Mapping[str, Any]) -> Iterator[str]:
    """Yield what is wrong with a row."""
    vector = np.asarray(record["vector"] or (), np.float64)
    length = float(np.linalg.norm(vector))
    if not abs(length - 1) < _UNIT:
        yield f"its code has length {length:g}, not 1"
    elif abs(vector.sum()) > _UNIT * len(vector) ** 0.5:
        yield "its code is not centred"
    content = record["hash"] or ""
    if not record["id"].startswith(content[:ID_DIGITS]) or len(content) < ID_DIGITS:
        yield f"its id is not that of its hash {content[:ID_DIGITS]}"
    if not record["shape"]:
        return
    try:
        shape = unpack(record["shape"], record["id"])
    except SpemError as error:
        yield str(error).removeprefix(f"{record['id']}: ").split(";")[0]
        return
    if (shape.ndim, shape.n_nodes) != (record["ndim"], record["n_nodes"]):
        yield f"its shape has {shape.n_nodes} nodes, not {record['n_nodes']}"


def _repair(store: Store, digest: str, findings: list[Finding]) -> None:
    """Remove the rows of findings; of doubled ones one is written again."""
    ids = list(dict.fromkeys(one.where for one in findings if one.repairable))
    twice = [one.where for one in findings if "twice" in one.reason]
    damaged = {one.where for one in findings if one.repairable and "twice" not in one.reason}
    kept = [
        store.rows(digest, f"id = {literal(row_id)}", columns=[*LIGHT, *HEAVY], limit=1)[0]
        for row_id in twice
    ]
    updates.remove(store, digest, ids)
    again = {row.id: row for row in kept if row.id not in damaged}
    updates.write(store, digest, list(again.values()))


def _check_files(store: Store, digest: str) -> Iterator[Finding]:
    """Yield the files of rows that are gone or hold something else."""
    for known in updates.known(store, digest):
        for path in filter(names_file, known.paths):
            if not Path(path).exists():
                yield Finding(path, "no such file any more; --prune of spem index add removes its row")
                continue
            try:
                changed = file_hash(path) != known.hash
            except ReadError as error:
                yield Finding(path, brief(error).removeprefix(f"{path}: "))
                continue
            if changed:
                yield Finding(path, "has changed since it was added; add it again")
