"""The database under an index: LanceDB in a folder or on object storage, one table for each model."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from datetime import timedelta
from pathlib import Path
from threading import Lock
from typing import Any, Self

from spem.codes.model import Model
from spem.codes.places import found_path, stored_path
from spem.errors import ModelError, ParameterError, ReadError
from spem.index import models
from spem.index.database_errors import told
from spem.index.extra import require
from spem.index.filters import as_text, literal, to_sql
from spem.index.locking import one_writer
from spem.index.row import UPLOADED, Row
from spem.index.schema import LAYOUT, LIGHT, layout_of, models_schema, schema, to_row

MODELS = "models"
_CODES = "codes-"
_REMOTE = "://"
# What an index has beside its tables: features of shapes while they are added.
_WORK = "work"
# Readers hold on to a version for no longer.
_KEPT = timedelta(hours=1)
_INSTANT = timedelta(milliseconds=1)
_ATTEMPTS = 5
_PAGE = 1000


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
    _tables: dict[str, Any] = field(default_factory=dict, repr=False)
    _models: dict[str, Model] = field(default_factory=dict, repr=False)
    _opening: Any = field(default_factory=Lock, repr=False)

    @classmethod
    def open(
        cls, address: str | Path, *, create: bool = True, storage_options: Mapping[str, str] | None = None
    ) -> Self:
        """Open a database; where there is none it is made with the first model, if `create` says so.

        Raises
        ------
        ReadError
            When there is none, the address leads to something else, or it cannot be reached.
        ModelError
            When a later spem made it.
        MissingExtraError
            When LanceDB is not installed.
        """
        lancedb = require("lancedb")
        where = str(address)
        if _REMOTE not in where:
            _check_folder(Path(where), create=create)
        with told(where):
            # every read sees what has been written before, by any process
            database = lancedb.connect(
                where,
                storage_options=dict(storage_options or {}) or None,
                read_consistency_interval=timedelta(0),
            )
        store = cls(where, database)
        store._check_layout(create=create)
        return store

    def _check_layout(self, *, create: bool) -> None:
        """Refuse a database that is no index, or one of a later spem."""
        names = self._names()
        if MODELS not in names or not self._is_whole(MODELS):
            others = [name for name in names if name != MODELS]
            if others and all(name.startswith(_CODES) for name in others):
                msg = f"{self.address}: the table of models is gone or damaged; restore it from a copy"
                raise ReadError(msg)
            if others:
                msg = f"{self.address}: a database of other things ({others[0]}), not an index of spem"
                raise ReadError(msg)
            if not create:
                msg = f"{self.address}: no index there; make one with: spem index add {self.address} SHAPES"
                raise ReadError(msg)
            return
        with told(self.address):
            found = layout_of(self._open(MODELS).schema)
        if found is None:
            msg = f"{self.address}: a database of other things, not an index of spem; give another address"
            raise ReadError(msg)
        if found > LAYOUT:
            msg = f"{self.address}: layout {found} is later than {LAYOUT}; upgrade spem to read it"
            raise ModelError(msg)

    @property
    def folder(self) -> Path | None:
        """Folder of a local index, None on object storage."""
        return None if _REMOTE in self.address else Path(self.address)

    @contextmanager
    def writing(self) -> Iterator[None]:
        """Be the one writer of a local index; on object storage the database settles who is first."""
        if self.folder is None:
            with told(self.address, writing=True):
                yield
        else:
            with one_writer(self.folder), told(self.address, writing=True):
                yield

    def digests(self) -> tuple[str, ...]:
        """Return the digests of the models, in order of name."""
        names = [name for name in self._names() if name.startswith(_CODES) and self._is_whole(name)]
        return tuple(name.removeprefix(_CODES) for name in names)

    def is_open(self, digest: str) -> bool:
        """Tell whether the table of a model has been opened, so that it is known to be there."""
        return _CODES + digest in self._tables

    def save_model(self, model: Model) -> None:
        """Write a model and make its table, unless they are there."""
        name = _CODES + model.digest
        if model.digest in self.digests():
            return
        with self.writing():
            columns = models_schema()
            table = self.database.create_table(MODELS, schema=columns, exist_ok=True)
            # the model first: a table of codes without one would be of no use
            merge = table.merge_insert("digest").when_not_matched_insert_all()
            merge.execute(models.to_table(model))
            self.database.create_table(name, schema=schema(model.n_code), exist_ok=True)
        self._models[model.digest] = model

    def drop_model(self, digest: str) -> int:
        """Remove a model with its rows, and return how many there were.

        Raises
        ------
        ModelError
            When the index has no such model.
        """
        count = self.count(digest)
        with self.writing():
            # the rows first: a table of codes without a model would be of no use
            self.database.drop_table(_CODES + digest)
            self._open(MODELS).delete(f"digest = {literal(digest)}")
        self._tables.pop(_CODES + digest, None)
        self._models.pop(digest, None)
        return count

    def load_model(self, digest: str, *, again: bool = False) -> Model:
        """Read a model; once, but where it is asked for again.

        Raises
        ------
        ModelError
            When the index has no such model, or it is damaged.
        """
        if again or digest not in self._models:
            self.table(digest)
            with told(self.address):
                query = self._open(MODELS).search().where(f"digest = {literal(digest)}")
                records = query.select(["model"]).limit(1).to_list()
            data = records[0]["model"] if records else b""
            self._models[digest] = models.from_bytes(data, digest, self.address)
        return self._models[digest]

    def table(self, digest: str) -> Any:
        """Open the table of a model.

        Raises
        ------
        ModelError
            When the index has no such model.
        """
        name = _CODES + digest
        if name not in self._tables and digest not in self.digests():
            msg = f"{self.address}: no model {digest}; it has {', '.join(self.digests()) or 'none'}"
            raise ModelError(msg)
        with told(self.address):
            return self._open(name)

    def table_at(self, digest: str, version: int) -> Any:
        """Open the table of a model as it was at a version."""
        with told(self.address):
            table = self.database.open_table(_CODES + digest)
            table.checkout(version)
        return table

    def model_records(self) -> list[dict[str, Any]]:
        """Return what the table of models says of each, without the models."""
        if not self.digests():
            return []
        with told(self.address):
            return list(self._open(MODELS).search().select(list(models.FACTS)).to_list())

    def rows(
        self,
        digest: str,
        where: str | None = None,
        *,
        columns: Sequence[str] = LIGHT,
        limit: int | None = None,
        offset: int = 0,
        sort: str | None = None,
        descending: bool = False,
    ) -> list[Row]:
        """Read rows that a filter lets through; columns that are not read stay empty.

        Parameters
        ----------
        digest
            The model.
        where
            Filter, as `spem.index.filters.to_sql` takes it.
        columns
            Those of `LIGHT`, and others.
        limit, offset
            Number of rows, and of those passed over.
        sort, descending
            Column that orders the rows, ids those of equal value.
        """
        found = self.query(digest, where, sort=sort, descending=descending).select(list(columns))
        with told(self.address, where=where):
            records = found.limit(limit).offset(offset).to_list()
        return [self.row(record) for record in records]

    def query(
        self, digest: str, where: str | None = None, *, sort: str | None = None, descending: bool = False
    ) -> Any:
        """Return a query of the database for rows that a filter lets through, in an order."""
        table = self.table(digest)
        with told(self.address):
            query = table.search()
        if sort is not None and sort not in (*LIGHT[:4], "label", "ndim", "n_nodes", "volume", "added"):
            msg = f"sort={sort!r}: no order of rows; expected name, label, path, volume, n_nodes or added"
            raise ParameterError(msg)
        if where is not None:
            query = query.where(to_sql(where))
        if sort is not None:
            order = [(sort, not descending), *([("id", True)] if sort != "id" else [])]
            query = query.order_by(
                [{"column_name": name, "ascending": up, "nulls_first": False} for name, up in order]
            )
        return query

    def count(self, digest: str, where: str | None = None) -> int:
        """Return the number of rows that a filter lets through."""
        table = self.table(digest)
        with told(self.address, where=where):
            return int(table.count_rows(None if where is None else to_sql(where)))

    def row(self, record: Mapping[str, Any]) -> Row:
        """Return the row that a record stands for, its paths from the working directory."""
        row = to_row(record)
        return replace(row, path=self.found(row.path), copies=tuple(map(self.found, row.copies)))

    def found(self, stored: str) -> str:
        """Return a path of the table from the working directory."""
        return stored if self.folder is None else found_path(stored, self.folder)

    def stored(self, path: str) -> str:
        """Return a path as the table has it: from the folder of the index, absolute on object storage."""
        if path.startswith(UPLOADED):
            return as_text(path)
        if self.folder is not None:
            return as_text(stored_path(path, self.folder))
        return as_text(str(Path(path).absolute()) if Path(path).exists() else path)

    def write(self, rows: Sequence[Row], model: Model) -> None:
        """Write rows in one step; see `spem.index.updates.write`."""
        from spem.index.updates import write

        write(self, model.digest, rows)

    def compact(self, older_than: timedelta = _KEPT) -> None:
        """Join small files into large ones and delete versions that are older.

        Readers that still hold an older version can no longer read it.
        """
        # the database warns of no time at all
        age = max(older_than, _INSTANT)
        for name in (MODELS, *(_CODES + digest for digest in self.digests())):
            self._compact(name, age)

    def _compact(self, name: str, age: timedelta, attempts: int = _ATTEMPTS) -> None:
        """Compact a table; on object storage any other write has the better right, and it is tried again."""
        try:
            with self.writing():
                # files of no version may be those of a write that goes on: the database keeps them for a week
                self._open(name).optimize(cleanup_older_than=age)
        except ParameterError:
            if self.folder is not None or attempts == 1:
                raise
            self._compact(name, age, attempts - 1)

    def _open(self, name: str) -> Any:
        """Open a table, once."""
        with self._opening:
            if name not in self._tables:
                self._tables[name] = self.database.open_table(name)
            return self._tables[name]

    def _is_whole(self, name: str) -> bool:
        """Tell a table from what a writer leaves that is killed while it makes one."""
        try:
            with told(self.address):
                self._open(name)
        except ReadError as error:
            return "was not found" not in str(error)
        return True

    def _names(self) -> list[str]:
        """List the tables."""
        names: list[str] = []
        token = None
        if self.folder is not None and not self.folder.is_dir():
            return names
        with told(self.address):
            while True:
                page = self.database.list_tables(page_token=token, limit=_PAGE)
                names += page.tables
                token = page.page_token
                if not token:
                    return sorted(names)


def _check_folder(folder: Path, *, create: bool) -> None:
    """Refuse a file, a folder of other things and, unless one may be made, an index that is not there."""
    try:
        if folder.is_file():
            msg = f"{folder}: a file, not an index; an index is a folder, made with: spem index add DB SHAPES"
            raise ReadError(msg)
        inside = [path.name for path in folder.iterdir()] if folder.is_dir() else None
    except OSError as error:
        msg = f"{folder}: cannot be read ({error.strerror}); check its permissions"
        raise ReadError(msg) from error
    if inside is None and not create:
        msg = f"{folder}: no index there; make one with: spem index add {folder} SHAPES"
        raise ReadError(msg)
    others = [name for name in inside or () if name != _WORK and not name.startswith(".")]
    if others and not any(name.endswith(".lance") for name in others):
        msg = f"{folder}: a folder of other things ({min(others)}), not an index; give an empty or a new one"
        raise ReadError(msg)
