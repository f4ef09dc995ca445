"""The facade of the index: open, add, search, remove, in a line each."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from datetime import timedelta
from pathlib import Path
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from spem.codes.batches import require_device
from spem.codes.codes import Codes, Failure
from spem.codes.model import Model
from spem.codes.settings import Settings
from spem.errors import ParameterError
from spem.fields.solvers.engine import Backend
from spem.index.adding import Added, Manner, Progress, add_sources, agreed_settings
from spem.index.answers import Answers
from spem.index.choosing import models_for
from spem.index.cluster import ClusterExecutor
from spem.index.device import DeviceExecutor
from spem.index.duplicates import DISTANCE, Duplicates, find_duplicates
from spem.index.executors import LocalExecutor
from spem.index.optimizing import Optimized, optimize
from spem.index.records import Records
from spem.index.searching import Search, search
from spem.index.snapshot import DEFAULT_MEMORY, Snapshots
from spem.index.store import Store
from spem.retrieval.labels import read_labels
from spem.shapes.shape import Shape


@dataclass(frozen=True, eq=False)
class Index(Records):
    """A collection of shapes that is kept up to date and searched.

    Make one with `Index.open`. What it holds is read, labelled, removed and exported as `Records` has it.

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

    snapshots: Snapshots = field(default_factory=Snapshots, repr=False)

    @classmethod
    def open(
        cls,
        address: str | Path,
        *,
        create: bool = True,
        memory: int = DEFAULT_MEMORY,
        storage_options: Mapping[str, str] | None = None,
    ) -> Self:
        """Open an index, or make one where there is none.

        Parameters
        ----------
        address
            Folder, or address on object storage such as ``s3://bucket/shapes``.
        create
            Whether an index is made where there is none.
        memory
            Bytes of codes that search keeps in memory, 1 GiB by default; the database compares them where
            there are more.
        storage_options
            Options of object storage, as LanceDB takes them.

        Raises
        ------
        ReadError
            When there is none.
        """
        store = Store.open(address, create=create, storage_options=storage_options)
        return cls(store, Snapshots(memory))

    def add(
        self,
        sources: str | Path | Shape | Sequence[str | Path | Shape],
        *,
        model: Model | str | None = None,
        new_model: bool = False,
        settings: Settings | None = None,
        labels: str | Path | Mapping[str, str] | None = None,
        metadata: Mapping[str, str] | None = None,
        n_jobs: int = 1,
        cluster: str | None = None,
        device: Backend | None = None,
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
        new_model
            Whether another model is learnt from these sources, beside those that the index has.
        settings
            How files become codes, where a model is learnt.
        labels
            File with labels, or file → label.
        metadata
            Keys and values that all rows get.
        n_jobs
            Number of processes.
        cluster
            Address of a Dask scheduler that encodes in their place.
        device
            Where SPEM maps and their codes are made, in batches, such as ``spem.Cuda()``; processes read.
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
        if new_model and model is not None:
            msg = "new_model: a model was given too; leave one of them out"
            raise ParameterError(msg)
        if isinstance(model, str) or (model is None and self.store.digests() and not new_model):
            model = self.model(model)
        if cluster is not None and device is not None:
            msg = f"cluster={cluster} and device={device} exclude each other; give one of them"
            raise ParameterError(msg)
        if device is not None:
            require_device(device)
        local = LocalExecutor(n_jobs) if device is None else DeviceExecutor(device, n_jobs)
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
            Digest, where several models of the index can answer: a file or shape is asked of that of its
            dimension, what the index has of that which holds it.
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
        digest = str(model) if known else self.digest(self._model_for(query) if model is None else model)
        return search(self.store, self.snapshots, digest, query, wanted)

    def _model_for(self, query: Any) -> str | None:
        """Return the one model of several that can answer a query, if there is one."""
        fitting = models_for(query, self.store, self.models()) if len(self.store.digests()) > 1 else []
        return fitting[0] if len(fitting) == 1 else None

    def drop(self, model: str | Model) -> int:
        """Remove a model with all of its rows, and return how many there were.

        Raises
        ------
        ModelError
            When the index has no such model.
        """
        digest = self.digest(model)
        count = self.store.drop_model(digest)
        self.snapshots.forget(digest)
        return count

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
