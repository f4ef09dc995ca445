"""The facade of the index: open, add, search, remove, in a line each."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from datetime import timedelta
from functools import partial
from pathlib import Path
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from spem.codes.codes import Codes, Failure
from spem.codes.model import Model
from spem.codes.settings import Settings
from spem.errors import ModelError, ParameterError, ReadError
from spem.index import updates
from spem.index.adding import Added, Manner, Progress, add_sources, agreed_settings
from spem.index.annotations import annotated, labels_of
from spem.index.answers import Answers
from spem.index.checking import Finding, check
from spem.index.cluster import ClusterExecutor
from spem.index.duplicates import DISTANCE, Duplicates, find_duplicates
from spem.index.executors import LocalExecutor
from spem.index.exporting import codes_of, export
from spem.index.filters import literal
from spem.index.models import ModelFacts
from spem.index.optimizing import Optimized, optimize
from spem.index.row import Row
from spem.index.schema import HEAVY, LIGHT
from spem.index.searching import Search, search
from spem.index.snapshot import Snapshots
from spem.index.store import Store
from spem.retrieval.labels import read_labels
from spem.shapes.shape import Shape


@dataclass(frozen=True, eq=False)
class Index:
    """A collection of shapes that is kept up to date and searched.

    Make one with `Index.open`.

    Parameters
    ----------
    store
        The database.
    snapshots
        Codes that are kept in memory for search, and how much of it they may take.

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
    snapshots: Snapshots = field(default_factory=Snapshots, repr=False)

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

    def models(self) -> tuple[ModelFacts, ...]:
        """Return what the index has of each model: digest, features, dimension, numbers."""
        facts = {record["digest"]: record for record in self.store.model_records()}
        return tuple(
            ModelFacts(
                digest,
                facts[digest]["features"],
                facts[digest]["ndim"],
                facts[digest]["n_code"],
                self.store.count(digest),
            )
            for digest in self.store.digests()
            if digest in facts
        )

    def digest(self, model: str | Model | Codes | None = None) -> str:
        """Return the digest of a model of the index.

        Parameters
        ----------
        model
            Its digest, or the model itself, or codes made with it; without it the only one.

        Raises
        ------
        ModelError
            When the index has no such model, or several and none is named.
        """
        known = self.store.digests()
        if model is None:
            if len(known) == 1:
                return known[0]
            msg = f"{self.store.address}: {len(known)} models ({', '.join(known)}); name one of them"
            if not known:
                msg = f"{self.store.address}: an index without a shape; add some first"
            raise ModelError(msg)
        given = model if isinstance(model, str) else _model_of(model).digest
        if given not in known:
            has = ", ".join(known) or "none"
            msg = f"model {given} is none of {self.store.address}, which has {has}; make both with one model"
            raise ModelError(msg)
        return given

    def model(self, digest: str | None = None) -> Model:
        """Return a model of the index; without a digest the only one.

        Raises
        ------
        ModelError
            When there is no such model, or several and none is named.
        """
        return self.store.load_model(self.digest(digest))

    def add(
        self,
        sources: str | Path | Shape | Sequence[str | Path | Shape],
        *,
        model: Model | str | None = None,
        settings: Settings | None = None,
        labels: str | Path | Mapping[str, str] | None = None,
        metadata: Mapping[str, str] | None = None,
        n_jobs: int = 1,
        cluster: str | None = None,
        retries: int = 2,
        keep_shapes: bool = True,
        prune: bool = False,
        work: str | Path | None = None,
        progress: Progress | None = None,
        on_failure: Callable[[Failure], None] | None = None,
        **options: Any,
    ) -> Added:
        """Encode shapes and write them as they come; those that are there already are left alone.

        A new index learns its model from the first sources that it is given, the model that `spem.encode`
        learns from them. Cut short, the same call goes on where it was.

        Parameters
        ----------
        sources
            Files, folders, patterns and shapes.
        model
            What codes are made with, or its digest where the index has several.
        settings
            How files become codes, of a new index.
        labels
            File with labels, or file → label.
        metadata
            Keys and values that all rows get.
        n_jobs
            Number of processes.
        cluster
            Address of a Dask scheduler that encodes in their place.
        retries
            How often a shape whose worker on the cluster died is tried again.
        keep_shapes
            Whether the shapes themselves are kept, for views that need no file.
        prune
            Whether files that are gone from the folders given are dropped.
        work
            Folder for what is done before there is a model; `work_folder` of the index by default.
        progress
            Called with a stage (``"fields"``, ``"codes"``), the number of sources done and of all; of codes
            once they are written.
        on_failure
            Called for each failure when it happens.
        **options
            Settings by name.

        Raises
        ------
        SpemError
            When there is no source, or nothing could be done.
        """
        given = [sources] if isinstance(sources, (str, Path, Shape)) else list(sources)
        if isinstance(model, str) or (model is None and self.store.digests()):
            model = self.model(model)
        local = LocalExecutor(n_jobs)
        manner = Manner(
            settings=agreed_settings(options, settings, model),
            labels=labels if isinstance(labels, Mapping) else read_labels(labels) if labels else {},
            metadata=metadata or {},
            executor=local if cluster is None else ClusterExecutor(cluster, retries),
            n_jobs=n_jobs,
            keep_shapes=keep_shapes,
            prune=prune,
            work=None if work is None else Path(work),
            progress=progress or (lambda *_: None),
            on_failure=on_failure,
        )
        return add_sources(self.store, given, model, manner)

    def search(
        self,
        query: str | Path | Shape | NDArray[Any],
        k: int = 10,
        *,
        where: str | None = None,
        model: str | Model | Codes | None = None,
        exact: bool | None = None,
        rerank: bool = False,
        volume_within: float | None = None,
    ) -> Answers:
        """Return the shapes nearest to a query.

        Parameters
        ----------
        query
            A file, a shape, a code, or the id, name or path of a shape of the index. What the index has is
            not encoded again, and finds itself.
        k
            Number of answers; equally near ones are ordered by id.
        where
            Filter of the answers, as `rows` takes it.
        model
            Digest, where the index has several models.
        exact
            Whether all codes are compared, or the approximate index of `optimize` is asked; None compares all
            up to 100,000, and beyond them too where there is no such index.
        rerank
            Whether the nearest 200 are put in the order of diffusion; distances are then those of diffusion.
        volume_within
            Largest ratio of the volumes of answers and query, such as 1.25, either way.

        Raises
        ------
        ReadError
            When there is no such file, and no such shape in the index.
        ParameterError
            When several shapes have that name, or a filter or a number has no meaning.
        ModelError
            When the query is no code, or not a shape, of that model.
        """
        wanted = Search(k, where, exact, rerank, volume_within)
        known = isinstance(model, str) and self.snapshots.knows(model)
        digest = str(model) if known else self.digest(model)
        return search(self.store, self.snapshots, digest, query, wanted)

    def duplicates(
        self,
        distance: float = DISTANCE,
        *,
        where: str | None = None,
        model: str | Model | Codes | None = None,
    ) -> Duplicates:
        """Return groups of near-duplicates: shapes joined by pairs that are nearer than a distance.

        Parameters
        ----------
        distance
            Correlation distance, in (0, 1).
        where
            Filter of the rows, as `rows` takes it.
        model
            Digest, where the index has several models.

        Raises
        ------
        ParameterError
            When the distance is out of its range or joins too many pairs, or codes do not fit into memory.
        """
        return find_duplicates(self.store, self.snapshots, self.digest(model), distance, where)

    def optimize(
        self,
        *,
        approximate: bool | None = None,
        older_than: timedelta | None = None,
        rng: np.random.Generator | None = None,
    ) -> tuple[Optimized, ...]:
        """Join small files, delete old versions, and build or renew the approximate index.

        Parameters
        ----------
        approximate
            Whether search has an approximate index; None gives it one beyond 100,000 shapes, and keeps one
            that is there. False drops it.
        older_than
            Age of the versions that are deleted, an hour by default; who still reads one of them fails.
        rng
            Chooses the 100 codes that recall is measured on.

        Raises
        ------
        ParameterError
            When an approximate index is asked for and there are too few codes to train it on.
        """
        chosen = np.random.default_rng(0) if rng is None else rng
        return optimize(self.store, approximate_index=approximate, older_than=older_than, rng=chosen)

    def get(self, row_id: str, *, columns: Sequence[str] = HEAVY, model: str | None = None) -> Row:
        """Return one row, with its code, picture and shape.

        Raises
        ------
        ReadError
            When there is no such row.
        """
        where = f"id = {literal(row_id)}"
        found = self.store.rows(self.digest(model), where, columns=[*LIGHT, *columns], limit=1)
        if not found:
            msg = f"{self.store.address}: no shape {row_id}; see: spem index list {self.store.address}"
            raise ReadError(msg)
        return found[0]

    def rows(
        self,
        where: str | None = None,
        *,
        sort: str | None = None,
        descending: bool = False,
        limit: int | None = None,
        offset: int = 0,
        model: str | None = None,
    ) -> list[Row]:
        """Return the rows that a filter lets through, without codes, pictures and shapes.

        Parameters
        ----------
        where
            SQL over the columns, such as ``label = 'cat' AND metadata.site = 'Oslo'``.
        sort, descending
            Column that orders them, such as ``"name"``; without it they come as they lie.
        limit, offset
            Number of rows, and of those passed over.
        model
            Digest of the model, where there are several.

        Raises
        ------
        ParameterError
            When the filter or the order has no meaning.
        """
        digest = self.digest(model)
        return self.store.rows(digest, where, limit=limit, offset=offset, sort=sort, descending=descending)

    def count(self, where: str | None = None, *, model: str | None = None) -> int:
        """Return the number of rows that a filter lets through."""
        return self.store.count(self.digest(model), where)

    def find(self, names: Sequence[str], *, model: str | None = None) -> list[str]:
        """Return the ids of rows by their ids or paths; a file that holds several shapes has several.

        Raises
        ------
        ReadError
            When one is no shape of the index.
        """
        return updates.ids_of(self.store, self.digest(model), names)

    def remove(
        self, ids: str | Sequence[str] | None = None, *, where: str | None = None, model: str | None = None
    ) -> int:
        """Remove rows by their ids or by a filter, and return how many there were."""
        digest = self.digest(model)
        if (ids is None) == (where is None):
            msg = "remove takes ids or a filter (where=...); give one of them"
            raise ParameterError(msg)
        if where is not None:
            return updates.remove_where(self.store, digest, where)
        return updates.remove(self.store, digest, [ids] if isinstance(ids, str) else list(ids or ()))

    def annotate(
        self,
        ids: str | Sequence[str] | None = None,
        *,
        where: str | None = None,
        label: str | None = None,
        metadata: Mapping[str, str | None] | None = None,
        model: str | None = None,
    ) -> int:
        """Give rows a label and metadata, and return how many changed.

        Parameters
        ----------
        ids, where
            The rows, by their ids or by a filter; all of them without either.
        label
            The label; an empty one takes theirs away.
        metadata
            Keys and values beside those that they have; a value None takes a key away.
        model
            Digest of the model, where there are several.
        """
        digest = self.digest(model)
        chosen = [ids] if isinstance(ids, str) else ids
        if chosen is None:
            chosen = [row.id for row in self.store.rows(digest, where)]
        return updates.annotate(
            self.store, digest, lambda row: annotated(row, label, metadata or {}), list(chosen)
        )

    def label(
        self, labels: str | Path | Mapping[str, str], *, model: str | None = None
    ) -> tuple[int, list[str]]:
        """Label rows by a table of files and labels, and return how many changed and what fits no row.

        Parameters
        ----------
        labels
            A file as `spem.read_labels` takes it, or file → label.
        model
            Digest of the model, where there are several.
        """
        digest = self.digest(model)
        table = labels if isinstance(labels, Mapping) else read_labels(labels)
        given, unused = labels_of(self.store.rows(digest), table)
        relabel = partial(_relabelled, given)
        return updates.annotate(self.store, digest, relabel, list(given)), unused

    def codes(self, where: str | None = None, *, model: str | None = None) -> Codes:
        """Return the codes of rows, centred and of unit length, in order of name."""
        return codes_of(self.store, self.digest(model), where)

    def export(
        self,
        path: str | Path,
        *,
        where: str | None = None,
        with_codes: bool = False,
        model: str | None = None,
    ) -> int:
        """Write rows to a file and return how many: ``.csv``, ``.parquet``, or ``.spem`` for codes alone.

        Raises
        ------
        ParameterError
            When the file has another ending or cannot be written.
        """
        return export(self.store, self.digest(model), Path(path), where, with_codes=with_codes)

    def check(self, *, files: bool = False, repair: bool = False) -> tuple[Finding, ...]:
        """Read everything and return what is wrong.

        Parameters
        ----------
        files
            Whether the files that shapes came from are looked at too: gone, or changed.
        repair
            Whether rows that are damaged or doubled are removed.
        """
        return check(self.store, files=files, repair=repair)

    def __len__(self) -> int:
        return sum(self.store.count(digest) for digest in self.store.digests())


def _model_of(made: Model | Codes) -> Model:
    """Return the model of codes, or a model as it is."""
    return made.model if isinstance(made, Codes) else made


def _relabelled(labels: Mapping[str, str], row: Row) -> Row:
    """Return a row with its label of a table by id."""
    return replace(row, label=labels[row.id])
