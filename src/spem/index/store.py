"""The database under an index: LanceDB in a folder or on object storage, one table for each model."""

from __future__ import annotations

import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Self

from spem.codes.model import Model
from spem.errors import ModelError, ReadError
from spem.index.extra import require
from spem.index.row import Row
from spem.index.schema import LIGHT, schema, to_row, to_table

_MODELS = "models"
_CODES = "codes-"


@dataclass(frozen=True, eq=False)
class Store:
    """An open database.

    Parameters
    ----------
    address
        Folder, or address on object storage such as ``s3://bucket/shapes``.
    database
        LanceDB's connection.
    """

    address: str
    database: Any

    @classmethod
    def open(
        cls, address: str | Path, *, create: bool = True, storage_options: Mapping[str, str] | None = None
    ) -> Self:
        """Open a database, and make it where there is none and `create` says so.

        Raises
        ------
        ReadError
            When there is none, or the address cannot be reached.
        MissingExtraError
            When LanceDB is not installed.
        """
        lancedb = require("lancedb")
        where = str(address)
        if "://" not in where and not Path(where).is_dir() and not create:
            msg = f"{where}: no index there; make one with: spem index add {where} SHAPES"
            raise ReadError(msg)
        return cls(where, lancedb.connect(where, storage_options=dict(storage_options or {}) or None))

    def digests(self) -> tuple[str, ...]:
        """Return the digests of the models, in order of name."""
        names = self.database.list_tables().tables
        return tuple(sorted(name.removeprefix(_CODES) for name in names if name.startswith(_CODES)))

    def save_model(self, model: Model) -> None:
        """Write a model and make its table, unless they are there."""
        pa = require("pyarrow")
        columns = pa.schema([("digest", pa.string()), ("model", pa.large_binary())])
        table = self.database.create_table(_MODELS, schema=columns, exist_ok=True)
        with tempfile.TemporaryDirectory() as folder:
            file = Path(folder, "model.spem")
            model.save(file)
            row = pa.table({"digest": [model.digest], "model": [file.read_bytes()]}, schema=columns)
        table.merge_insert("digest").when_not_matched_insert_all().execute(row)
        self.database.create_table(_CODES + model.digest, schema=schema(model.n_code), exist_ok=True)

    def load_model(self, digest: str) -> Model:
        """Read a model.

        Raises
        ------
        ModelError
            When the index has no such model.
        """
        if digest not in self.digests():
            msg = f"{self.address}: no model {digest}; it has {', '.join(self.digests()) or 'none'}"
            raise ModelError(msg)
        table = self.database.open_table(_MODELS)
        record = table.search().where(f"digest = '{digest}'").limit(1).to_list()[0]
        with tempfile.TemporaryDirectory() as folder:
            file = Path(folder, "model.spem")
            file.write_bytes(record["model"])
            return Model.load(file)

    def table(self, digest: str) -> Any:
        """Open the table of a model."""
        return self.database.open_table(_CODES + digest)

    def write(self, rows: Sequence[Row], model: Model) -> None:
        """Write rows in one step; those of an id that is there are replaced."""
        if rows:
            table = self.table(model.digest).merge_insert("id")
            table.when_matched_update_all().when_not_matched_insert_all().execute(
                to_table(rows, model.n_code)
            )

    def rows(
        self,
        digest: str,
        where: str | None = None,
        *,
        columns: Sequence[str] = LIGHT,
        limit: int | None = None,
        offset: int = 0,
    ) -> list[Row]:
        """Read rows that a filter lets through; columns that are not read stay empty."""
        query = self.table(digest).search().select(list(columns))
        if where:
            query = query.where(where)
        found = query.limit(limit).offset(offset) if limit is not None else query.offset(offset)
        return [to_row(record) for record in found.to_list()]
