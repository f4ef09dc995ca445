"""The facade of the index: open, add, search, remove, in a line each."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from spem.codes.codes import Failure
from spem.codes.collection import encode_file
from spem.codes.model import Model
from spem.codes.settings import Settings
from spem.codes.sources import Source, find_files
from spem.errors import ModelError, ReadError
from spem.index.answers import Answers
from spem.index.encoding import Progress, add_sources, learn
from spem.index.row import Row
from spem.index.schema import HEAVY, LIGHT
from spem.index.searching import nearest
from spem.index.store import Store
from spem.shapes.shape import Shape


@dataclass(frozen=True)
class Added:
    """What an addition came to.

    Parameters
    ----------
    added, unchanged
        Number of files encoded, and of those that were there already.
    failures
        Files that gave nothing, and why.
    """

    added: int
    unchanged: int
    failures: tuple[Failure, ...] = ()


@dataclass(frozen=True, eq=False)
class Index:
    """A collection of shapes that is kept up to date and searched.

    Make one with `Index.open`.

    Parameters
    ----------
    store
        The database.

    Examples
    --------
    >>> import tempfile, spem
    >>> shapes = [spem.synthetic.disk(radius=8.0, spacing=1.0), spem.synthetic.star_polygon(5, 2)]
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     index = Index.open(folder)
    ...     _ = index.add(shapes, features="spem", voxels=None, n_centers=8)
    ...     index.search(shapes[0], k=1)[0].row.name
    'disk'
    """

    store: Store

    @classmethod
    def open(
        cls, address: str | Path, *, create: bool = True, storage_options: Mapping[str, str] | None = None
    ) -> Self:
        """Open an index, or make one where there is none.

        Parameters
        ----------
        address
            Folder, or address on object storage such as ``s3://bucket/shapes``.
        create
            Whether an index is made where there is none.
        storage_options
            Options of object storage, as LanceDB takes them.

        Raises
        ------
        ReadError
            When there is none.
        """
        return cls(Store.open(address, create=create, storage_options=storage_options))

    def model(self, digest: str | None = None) -> Model:
        """Return a model of the index; without a digest the only one.

        Raises
        ------
        ModelError
            When there is no such model, or several and none is named.
        """
        known = self.store.digests()
        if digest is None and len(known) != 1:
            msg = f"{self.store.address}: {len(known)} models ({', '.join(known)}); name one of them"
            raise ModelError(msg)
        return self.store.load_model(digest or known[0])

    def add(
        self,
        sources: str | Path | Shape | Sequence[str | Path | Shape],
        *,
        model: Model | None = None,
        settings: Settings | None = None,
        n_jobs: int = 1,
        progress: Progress | None = None,
        **options: Any,
    ) -> Added:
        """Encode shapes and write them; those that are there already are left alone.

        Raises
        ------
        SpemError
            When there is no source.
        """
        given = [sources] if isinstance(sources, (str, Path, Shape)) else list(sources)
        listed: list[Source] = []
        for source in given:
            listed.extend([source] if isinstance(source, Shape) else find_files([source]))
        if model is None and not self.store.digests():
            model = learn(listed, Settings.of(options) if options else settings, n_jobs)
        chosen = model or self.model()
        self.store.save_model(chosen)
        failures = add_sources(self.store, listed, chosen, n_jobs=n_jobs, progress=progress)
        return Added(len(listed) - len(failures), 0, tuple(failures))

    def search(
        self,
        query: str | Path | Shape | NDArray[np.float32],
        k: int = 10,
        *,
        where: str | None = None,
        model: str | None = None,
    ) -> Answers:
        """Return the shapes nearest to a query: a file, a shape, the id of a row, or a code."""
        chosen = self.model(model)
        if isinstance(query, np.ndarray):
            code = np.asarray(query, np.float32)
        elif isinstance(query, str) and not Path(query).is_file():
            code = self.get(query, columns=HEAVY[:1], model=chosen.digest).code
        else:
            code = encode_file(query, chosen)
        return nearest(self.store, chosen, code, k, where)

    def get(self, row_id: str, *, columns: Sequence[str] = HEAVY, model: str | None = None) -> Row:
        """Return one row, with its code, picture and shape.

        Raises
        ------
        ReadError
            When there is no such row.
        """
        digest = model or self.model().digest
        quoted = row_id.replace("'", "''")
        found = self.store.rows(digest, f"id = '{quoted}'", columns=[*LIGHT, *columns], limit=1)
        if not found:
            msg = f"{self.store.address}: no shape {row_id}; see: spem index list {self.store.address}"
            raise ReadError(msg)
        return found[0]

    def rows(
        self,
        where: str | None = None,
        *,
        limit: int | None = None,
        offset: int = 0,
        model: str | None = None,
    ) -> list[Row]:
        """Return the rows that a filter lets through, without codes, pictures and shapes."""
        return self.store.rows(model or self.model().digest, where, limit=limit, offset=offset)

    def __len__(self) -> int:
        return sum(int(self.store.table(digest).count_rows()) for digest in self.store.digests())
