"""An index put in order: small files joined, old versions deleted, the approximate index built or dropped."""

from __future__ import annotations

import time
from dataclasses import dataclass
from datetime import timedelta
from pathlib import Path
from typing import Any

import numpy as np

from spem.index import approximate
from spem.index.approximate import Approximation
from spem.index.searching import EXACT_ROWS
from spem.index.store import Store

# An index that was trained on so small a part of the rows is built anew.
_GROWN = 2


@dataclass(frozen=True)
class Optimized:
    """What putting the codes of a model in order came to.

    Parameters
    ----------
    model
        Digest.
    n_rows
        Number of rows.
    n_bytes
        What they take on disk, the approximate index included; on object storage without old versions.
    approximate
        The approximate index and its recall; None where all codes are compared.
    seconds
        Time that it took.
    """

    model: str
    n_rows: int
    n_bytes: int
    approximate: Approximation | None
    seconds: float


def optimize(
    store: Store,
    *,
    approximate_index: bool | None,
    older_than: timedelta | None,
    rng: np.random.Generator,
) -> tuple[Optimized, ...]:
    """Put the tables of all models in order.

    Parameters
    ----------
    store
        The database.
    approximate_index
        Whether tables have an approximate index; beyond 100,000 rows where None.
    older_than
        Age of versions that are deleted; that of `Store.compact` where None.
    rng
        Chooses the codes that recall is measured on.

    Raises
    ------
    ParameterError
        When an approximate index is asked for and a table has too few codes for one.
    """
    begin = time.perf_counter()
    store.compact() if older_than is None else store.compact(older_than)
    done = []
    for digest in store.digests():
        way = _approximation(store, digest, approximate_index, rng)
        table = store.table(digest)
        seconds = time.perf_counter() - begin
        done.append(Optimized(digest, int(table.count_rows()), _size(store, table), way, seconds))
        begin = time.perf_counter()
    return tuple(done)


def _approximation(
    store: Store, digest: str, wanted: bool | None, rng: np.random.Generator
) -> Approximation | None:
    """Build, renew or drop the approximate index of a table, and measure it."""
    table = store.table(digest)
    n_rows, known = int(table.count_rows()), Approximation.of(table)
    if wanted is None:
        wanted = n_rows > EXACT_ROWS or known is not None
    if not wanted:
        if known is not None:
            with store.writing():
                approximate.drop(table)
        return None
    if known is None or n_rows > _GROWN * known.n_trained:
        with store.writing():
            approximate.build(table)
            trained = n_rows
    else:
        trained = known.n_trained
    with store.writing():
        return approximate.measure(table, rng, n_trained=trained)


def _size(store: Store, table: Any) -> int:
    """Return the bytes that a table takes."""
    if store.folder is None:
        return int(table.stats()["total_bytes"]) + sum(
            index.size_bytes or 0 for index in table.list_indices()
        )
    folder = Path(store.folder, f"{table.name}.lance")
    return sum(path.stat().st_size for path in folder.rglob("*") if path.is_file())
