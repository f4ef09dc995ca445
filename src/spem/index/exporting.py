"""Rows of an index as files: CSV, Parquet, or codes that `spem evaluate` takes."""

from __future__ import annotations

import io
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from spem.codes.codes import Codes
from spem.errors import ParameterError
from spem.files import write_whole
from spem.index.database_errors import told
from spem.index.extra import require
from spem.index.schema import LIGHT
from spem.index.store import Store

if TYPE_CHECKING:
    import pyarrow

EXPORT_SUFFIXES = (".csv", ".parquet", ".spem")
_BETWEEN_COPIES = ";"


def export(
    store: Store, digest: str, path: Path, where: str | None = None, *, with_codes: bool = False
) -> int:
    """Write rows to a file and return how many, in order of name.

    CSV and Parquet hold the light columns; metadata is a column ``metadata.KEY`` for each key, and with codes
    there is ``code_0`` and so on in CSV, a list in Parquet. A ``.spem`` file holds codes and model alone.

    Parameters
    ----------
    store
        The database.
    digest
        The model.
    path
        File that ends in ``.csv``, ``.parquet`` or ``.spem``.
    where
        Filter of rows.
    with_codes
        Whether codes are written too.

    Raises
    ------
    ParameterError
        When the file has another ending or cannot be written.
    """
    suffix = path.suffix.lower()
    if suffix not in EXPORT_SUFFIXES:
        msg = f"{path}: expected a file that ends in {', '.join(EXPORT_SUFFIXES)}"
        raise ParameterError(msg)
    if suffix == ".spem":
        codes = codes_of(store, digest, where)
        codes.save(path)
        return len(codes)
    table = flat_table(store, digest, where, with_codes=with_codes, as_list=suffix == ".parquet")
    buffer = io.BytesIO()
    if suffix == ".csv":
        require("pyarrow.csv").write_csv(table, buffer)
    else:
        require("pyarrow.parquet").write_table(table, buffer)
    write_whole(path, lambda file: file.write(buffer.getbuffer()))
    return int(table.num_rows)


def codes_of(store: Store, digest: str, where: str | None = None) -> Codes:
    """Return the codes of rows, centred and of unit length, in order of name.

    Their correlation distances are those of the codes that they were made of.

    Raises
    ------
    ParameterError
        When a filter lets no row through.
    """
    return labelled_codes(store, digest, where)[0]


def labelled_codes(store: Store, digest: str, where: str | None = None) -> tuple[Codes, list[str]]:
    """Return codes as `codes_of` does, and the label of each, empty where there is none."""
    table = _read(store, digest, where, ("name", "path", "hash", "volume", "vector", "label"))
    if not table.num_rows:
        of = f"model {digest}" + (f" where {where}" if where else "")
        msg = f"{store.address}: no shape of {of}, so there are no codes to write"
        raise ParameterError(msg)
    names, paths, hashes = (table.column(name).to_pylist() for name in ("name", "path", "hash"))
    volumes = table.column("volume").to_numpy()
    files = tuple(map(store.found, paths))
    codes = Codes(names, files, hashes, _vectors(table), store.load_model(digest), volumes=volumes)
    return codes, [label or "" for label in table.column("label").to_pylist()]


def flat_table(
    store: Store, digest: str, where: str | None, *, with_codes: bool, as_list: bool
) -> pyarrow.Table:
    """Return rows as a table without nested columns, but for codes as lists."""
    pa = require("pyarrow")
    found = _read(store, digest, where, (*LIGHT, "vector") if with_codes else LIGHT)
    columns: dict[str, Any] = {}
    for name in LIGHT:
        if name == "metadata":
            columns |= dict(_metadata(found.column(name).to_pylist()))
        elif name == "copies":
            copies = found.column(name).to_pylist()
            columns[name] = [_BETWEEN_COPIES.join(map(store.found, each or ())) for each in copies]
        elif name == "path":
            columns[name] = [store.found(path) for path in found.column(name).to_pylist()]
        else:
            columns[name] = found.column(name)
    if with_codes and as_list:
        columns["code"] = found.column("vector")
    elif with_codes:
        columns |= {f"code_{i}": values for i, values in enumerate(_vectors(found).T)}
    return pa.table(columns)


def _metadata(records: list[list[tuple[str, str]] | None]) -> Iterator[tuple[str, list[str | None]]]:
    """Yield a column for each key of metadata."""
    tables = [dict(record or ()) for record in records]
    for key in sorted({key for table in tables for key in table}):
        yield f"metadata.{key}", [table.get(key) for table in tables]


def _read(store: Store, digest: str, where: str | None, columns: tuple[str, ...]) -> pyarrow.Table:
    """Read columns of rows in order of name."""
    query = store.query(digest, where).select(list(dict.fromkeys((*columns, "name", "id"))))
    with told(store.address, where=where):
        return query.to_arrow().sort_by([("name", "ascending"), ("id", "ascending")])


def _vectors(table: pyarrow.Table) -> np.ndarray[Any, np.dtype[np.float32]]:
    """Return the ``(n, n_code)`` codes of a table."""
    column = table.column("vector").combine_chunks()
    flat = column.flatten().to_numpy(zero_copy_only=False)
    return np.ascontiguousarray(flat.reshape(len(column), column.type.list_size), np.float32)
