"""What a search is asked by: a code, a shape, a file, or the id, name or path of a shape of the index."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from threadpoolctl import threadpool_limits

from spem.codes.codes import file_hash
from spem.codes.kinds import shape_features
from spem.codes.model import Model
from spem.codes.sources import Source, read_shapes
from spem.errors import ModelError, ParameterError, ReadError, ShapeError, SpemError
from spem.index.filters import literal
from spem.index.pinned import Pinned
from spem.index.row import row_id
from spem.index.schema import standardised_codes
from spem.index.snapshot import Snapshot
from spem.index.store import Store
from spem.shapes.shape import Shape

# Ids, names or paths that an ambiguous query is told of.
_TOLD = 3
_COLUMNS = ["id", "name", "path", "volume", "vector"]


@dataclass(frozen=True, eq=False)
class Query:
    """A query, ready to be compared.

    Parameters
    ----------
    vector
        ``(n_code,)`` standardised code.
    volume
        Volume of the shape; None where only its code is known.
    id
        Its id, where it is one of the index.
    """

    vector: NDArray[np.float32]
    volume: float | None = None
    id: str | None = None


def resolve(
    query: str | Path | Shape | NDArray[Any],
    store: Store,
    digest: str,
    pinned: Pinned,
    snapshot: Snapshot | None,
) -> Query:
    """Find the code of a query; only what is not in the index is read and encoded.

    Parameters
    ----------
    query
        A file, a shape, a code, or the id, name or path of a shape of the index. A file counts first.
    store
        The database.
    digest
        The model whose table is searched.
    pinned
        The table.
    snapshot
        Its codes in memory, where they are.

    Raises
    ------
    ParameterError
        When several shapes of the index have that name, or a code has another length.
    ReadError
        When there is neither a file nor a shape of the index of that name.
    """
    if isinstance(query, np.ndarray):
        return Query(_standardised(query, pinned.n_code))
    if isinstance(query, Shape):
        return _encoded(query, store.load_model(digest))
    text = str(query)
    if Path(text).is_file():
        key = row_id(file_hash(text))
        return _row(key, pinned.table, snapshot) or _encoded(Path(text), store.load_model(digest))
    return _row(text, pinned.table, snapshot) or _named(text, store.stored(text), pinned.table)


def _standardised(code: NDArray[Any], n_code: int) -> NDArray[np.float32]:
    """Return a code as the database has it, or refuse it."""
    if code.shape != (n_code,) or code.dtype.kind not in "fiu" or not np.isfinite(code).all():
        msg = (
            f"a code of {code.dtype} of shape {code.shape}, expected {n_code} finite numbers; "
            "make it with the index's model"
        )
        raise ModelError(msg)
    return np.asarray(standardised_codes(code[None])[0])


def _encoded(source: Source, model: Model) -> Query:
    """Encode the one shape of a source, on one thread as collections are."""
    found = list(read_shapes(source, model.settings))
    if len(found) != 1:
        msg = f"{source}: holds {len(found)} labels; add the file to the index and ask by one of its shapes"
        raise ShapeError(msg)
    shape = found[0][1]
    if isinstance(shape, SpemError):
        raise shape
    model.require_ndim(shape.ndim, shape.name)
    with threadpool_limits(1):
        code = model.encode(shape_features(shape, model.settings), shape.name)
    return Query(standardised_codes(code[None])[0], float(shape.volume))


def _row(key: str, table: Any, snapshot: Snapshot | None) -> Query | None:
    """Return the shape of this id, if the index has it."""
    if snapshot is not None:
        at = snapshot.positions([key])
        if not len(at):
            return None
        if snapshot.rows is not None:
            volume = float(snapshot.rows.column("volume")[int(at[0])].as_py())
            return Query(snapshot.vectors[at[0]], volume, key)
    return _only(key, table, f"id = {literal(key)}")


def _named(text: str, path: str, table: Any) -> Query:
    """Return the one shape of this name or path."""
    where = f"name = {literal(text)} OR path = {literal(path)} OR array_has(copies, {literal(path)})"
    found = _only(text, table, where)
    if found is None:
        msg = f"{text}: no such file, and no shape of the index has that id, name or path; give one of these"
        raise ReadError(msg)
    return found


def _only(text: str, table: Any, where: str) -> Query | None:
    """Return the one row that a filter lets through, None without one; several are refused."""
    records = table.search().where(where).select(_COLUMNS).limit(_TOLD + 1).to_list()
    if len(records) > 1:
        told = ", ".join(f"{each['id']} ({each['path']})" for each in records[:_TOLD])
        more = ", ..." if len(records) > _TOLD else ""
        msg = f"{text}: several shapes of the index have that name: {told}{more}; give the id of one"
        raise ParameterError(msg)
    if not records:
        return None
    return Query(np.asarray(records[0]["vector"], np.float32), records[0]["volume"], records[0]["id"])
