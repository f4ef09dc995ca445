"""Shapes added to an index: listed, compared with what is there, encoded where they are new, and written."""

from __future__ import annotations

import hashlib
import os
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import closing
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from spem.codes.codes import Failure
from spem.codes.collection import TRAINING_SHAPES
from spem.codes.listing import Listing
from spem.codes.model import Model
from spem.codes.settings import Settings
from spem.codes.sources import Source, as_source, find_files, source_path
from spem.codes.traits import kinds_of
from spem.errors import ModelError, ParameterError, ReadError
from spem.index.batches import Batches
from spem.index.changes import Known, Plan, place, plan
from spem.index.encoding import Describe, Described
from spem.index.executors import Executor, Item, LocalExecutor, Outcomes
from spem.index.naming import Labelling
from spem.index.row import Row
from spem.index.store import Store
from spem.index.training import Drafts, Finish, Make, learn
from spem.index.updates import annotate, known, relocate, write
from spem.shapes.shape import Shape

Progress = Callable[[str, int, int], None]


@dataclass(frozen=True)
class Added:
    """What an addition came to.

    Parameters
    ----------
    added
        Number of files that were new and have a row now; of equal ones each counts.
    updated
        Number of files that held something else before.
    unchanged
        Number of files that were there already.
    removed
        Number of files that were dropped since they are gone.
    gone
        Number of files of the folders given that are gone, but were not to be dropped.
    failures
        Files and labels that gave nothing, and why.
    model
        Digest of the model.
    """

    added: int
    updated: int = 0
    unchanged: int = 0
    removed: int = 0
    gone: int = 0
    failures: tuple[Failure, ...] = ()
    model: str = ""


@dataclass(frozen=True, kw_only=True)
class Manner:
    """How shapes are added; see `spem.Index.add`."""

    settings: Settings | None = None
    labels: Mapping[str, str] = field(default_factory=dict)
    metadata: Mapping[str, str] = field(default_factory=dict)
    executor: Executor = field(default_factory=LocalExecutor)
    n_jobs: int = 1
    keep_shapes: bool = True
    prune: bool = False
    work: Path | None = None
    progress: Progress = field(default=lambda *_: None)
    on_failure: Callable[[Failure], None] | None = None

    @property
    def threads(self) -> int | None:
        """Threads for one shape: all cores where nothing else runs beside it."""
        return None if self.executor == LocalExecutor(1) else 1


def add_sources(
    store: Store, given: Sequence[str | Path | Shape], model: Model | None, manner: Manner
) -> Added:
    """Add files and shapes to an index.

    Parameters
    ----------
    store
        The database.
    given
        Files, folders, patterns and shapes.
    model
        What codes are made with; learnt from these sources where None.
    manner
        How it is done.

    Raises
    ------
    ReadError
        When a path leads to nothing, or there is no model and no source gave a shape.
    ModelError
        When the settings are not the model's.
    """
    listing = Listing(_sources(given), manner.on_failure)
    if not listing.sources:
        msg = "no sources were given; give files or shapes"
        raise ParameterError(msg)
    settings = manner.settings or (model.settings if model is not None else Settings())
    root = manner.work if manner.work is not None else work_folder(store.address)
    drafts = Drafts.open(root, settings)
    if model is None:
        make = Make(settings, manner.keep_shapes, manner.threads)
        try:
            model = learn(
                listing, settings, make, drafts, manner.executor, manner.progress, limit=TRAINING_SHAPES
            )
        except ReadError as error:
            if error.failures:
                drafts.clear(listing.first)
            raise
    store.save_model(model)
    sources = [(source, key) for source, key in listing if key is not None]
    folders = [each for each in given if isinstance(each, (str, Path))]
    todo, n_gone = _plan(known(store, model.digest), sources, folders, prune=manner.prune)
    _encode(store, listing, todo, model, drafts, manner)
    relocate(store, model.digest, todo)
    if manner.labels or manner.metadata:
        _annotate(store, listing, todo, model, manner)
    drafts.clear(listing.first)
    return replace(_summary(listing, todo, model), gone=n_gone)


def work_folder(address: str) -> Path:
    """Return where work on an index is kept: in its folder, or for object storage in the user's cache.

    Examples
    --------
    >>> work_folder("shapes.index").as_posix()
    'shapes.index/work'
    """
    if "://" not in address:
        return Path(address, "work")
    cache = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")
    return cache / "spem" / hashlib.sha256(address.encode()).hexdigest()[:16]


def _sources(given: Iterable[str | Path | Shape]) -> list[Source]:
    """List the files that paths stand for, and shapes as they are."""
    listed: list[Source] = []
    for each in map(as_source, given):
        listed.extend([each] if isinstance(each, Shape) else find_files([each]))
    return listed


def _plan(
    rows: Iterable[Known],
    sources: Sequence[tuple[Source, str]],
    folders: Sequence[str | Path],
    *,
    prune: bool,
) -> tuple[Plan, int]:
    """Plan an addition, and count the files that are gone from the folders but stay in the index."""
    todo = plan(rows, sources, prune=folders)
    here = {place(source_path(source)) for source, _ in sources}
    stays = {key: tuple(path for path in paths if place(path) in here) for key, paths in todo.lost.items()}
    if prune:
        return todo, 0
    n_gone = len({path for paths in todo.lost.values() for path in paths if place(path) not in here})
    return replace(todo, lost={key: paths for key, paths in stays.items() if paths}), n_gone


def _encode(store: Store, listing: Listing, todo: Plan, model: Model, drafts: Drafts, manner: Manner) -> None:
    """Encode what has no row, and write rows as they come."""
    items = [Item(key, found[0]) for key, found in todo.encode.items() if key not in listing.broken]
    labelling = Labelling.of(listing.sources, manner.labels, manner.metadata)
    total = done = len(todo.encode)
    done -= len(items)

    def written(count: int) -> None:
        """Tell what is done, now that it is."""
        nonlocal done
        done += count
        manner.progress("codes", done, total)

    manner.progress("codes", done, total)
    outcomes = _described(items, model, drafts, manner)
    with Batches(lambda rows: write(store, model.digest, rows), written) as batches, closing(outcomes):
        for item, described, reason in outcomes:
            if described is None:
                listing.fail(item.source, reason, item.key)
                batches.add(())
                continue
            for failed in described.failures:
                listing.fail(item.source, failed)
            path, *copies = map(source_path, todo.encode[item.key])
            rows = [replace(row, path=path, copies=tuple(copies)) for row in described.rows]
            batches.add(labelling.apply(rows))
    for key, found in todo.encode.items():
        for source in found:
            listing.fails_again(key, source)


def _annotate(store: Store, listing: Listing, todo: Plan, model: Model, manner: Manner) -> None:
    """Give labels and metadata to rows that were there already."""
    contents = {key for _, key in listing if key is not None and key not in todo.encode}
    sources: dict[str, list[Row]] = {}
    for row in store.rows(model.digest):
        if row.hash in contents:
            sources.setdefault(row.hash, []).append(row)
    labelling = Labelling.of(listing.sources, manner.labels, manner.metadata)
    given = {row.id: row for rows in sources.values() for row in labelling.apply(rows)}
    annotate(store, model.digest, lambda row: given[row.id], list(given))


def _described(
    items: Sequence[Item], model: Model, drafts: Drafts, manner: Manner
) -> Outcomes[Item, Described]:
    """Yield what each source comes to: those of the sample from their drafts, others from their files."""
    ready = [item for item in items if drafts.has(item.key)]
    others = [item for item in items if not drafts.has(item.key)]
    local = LocalExecutor(manner.n_jobs)
    with closing(local.run(Finish(drafts, model), ready)) as outcomes:
        yield from outcomes
    describe = Describe(model, manner.keep_shapes, manner.threads)
    with closing(manner.executor.run(describe, others)) as outcomes:
        yield from outcomes


def _summary(listing: Listing, todo: Plan, model: Model) -> Added:
    """Count what came of the sources."""
    here = {place(source_path(source)) for source in listing.sources if not isinstance(source, Shape)}
    lost = {place(path) for paths in todo.lost.values() for path in paths}
    new = [
        place(source_path(source))
        for key, found in todo.encode.items()
        for source in found
        if key not in listing.broken
    ] + [place(path) for paths in todo.gained.values() for path in paths]
    updated = sum(path in lost for path in new)
    failures = tuple(listing.failures)
    return Added(
        len(new) - updated,
        updated,
        todo.n_unchanged,
        len(lost - here),
        failures=failures,
        model=model.digest,
    )


def agreed_settings(
    options: Mapping[str, Any], settings: Settings | None, model: Model | None
) -> Settings | None:
    """Return the settings to add with; options must not differ from those of a model.

    Parameters
    ----------
    options
        Settings by name.
    settings
        All of them, in place of `options`.
    model
        The model that is used, where there is one.

    Raises
    ------
    ParameterError
        When an option is no setting, out of its range, or another than the model's.
    ModelError
        When `settings` are not the model's.

    Examples
    --------
    >>> agreed_settings({"voxels": 5000}, None, None).voxels
    5000
    """
    if options and settings is not None:
        msg = f"settings and {', '.join(options)} exclude each other; give one of them"
        raise ParameterError(msg)
    if model is None:
        return Settings.of(options) if options else settings
    Settings.of(options)
    for key, value in options.items():
        fixed = getattr(model.settings, key)
        same = value == fixed if key != "features" else "+".join(kinds_of(value, model.ndim)) == fixed
        if not same:
            msg = f"{key}={value}: model {model.digest} has {key}={fixed}; leave it out, or add to another"
            raise ParameterError(msg)
    if settings is not None and settings.resolved(model.ndim) != model.settings:
        mine, theirs = settings.to_json(), model.settings.to_json()
        odd = [f"{key} {mine[key]} against {theirs[key]}" for key in mine if mine[key] != theirs[key]]
        msg = f"model {model.digest} was made with other settings ({'; '.join(odd)}); leave them out"
        raise ModelError(msg)
    return model.settings if settings is None else settings
