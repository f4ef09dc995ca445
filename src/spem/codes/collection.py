"""Codes of a collection of files: features of each, a vocabulary from some, a code for all."""

from __future__ import annotations

import hashlib
import tempfile
from collections import Counter
from collections.abc import Callable, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from threadpoolctl import threadpool_limits

from spem.codes.batches import encode_shapes, require_device
from spem.codes.codes import Codes, Failure
from spem.codes.device_work import DeviceWork
from spem.codes.kinds import shape_features
from spem.codes.listing import Listing
from spem.codes.model import Model
from spem.codes.settings import Settings
from spem.codes.sources import Source, as_source, read_shapes, source_name, source_path
from spem.codes.work import Entry, Work, dimension
from spem.codes.workers import one_line, run_all
from spem.errors import ModelError, ParameterError, ReadError, ShapeError, SpemError
from spem.fields.solvers.engine import Backend
from spem.shapes.kinds import SUFFIXES, has_suffix
from spem.shapes.shape import Shape

# Training shapes beyond these change the vocabulary by less than another seed does; they bound the memory.
TRAINING_SHAPES = 1000

Progress = Callable[[str, int, int], None]


def encode_collection(
    sources: Sequence[str | Path | Shape],
    settings: Settings | None = None,
    *,
    model: Model | None = None,
    known: Codes | None = None,
    n_jobs: int = 1,
    work: str | Path | None = None,
    progress: Progress | None = None,
    on_failure: Callable[[Failure], None] | None = None,
    device: Backend | None = None,
) -> Codes:
    """Make the codes of a collection.

    The features of every file are computed first and kept in the work folder; a vocabulary is
    learnt from those of at most `TRAINING_SHAPES` shapes; codes are made of them one at a time.
    The result depends on what the files hold, not on their order or on the number of workers.

    Parameters
    ----------
    sources
        Files, as `spem.codes.sources.find_files` lists them, or shapes.
    settings
        How a file becomes a code; those of the model where one is given.
    model
        A vocabulary to reuse, in place of learning one.
    known
        Codes from which shapes of equal content are taken over; their model is reused.
    n_jobs
        Number of processes.
    work
        Folder in which what is done survives an interruption; the same call goes on from it. It stays
        until `spem.codes.work.clear_work`, for which the time is when the codes are saved. Without it
        nothing survives.
    progress
        Called with a stage (``"fields"``, ``"codes"``), the number of sources done and of all.
    on_failure
        Called for each failure when it happens.
    device
        Where to sweep shapes and make SPEM maps, in batches, such as ``spem.Cuda()``; when None each process
        does so for itself. Codes agree but for rounding, and the work folder is the same: a call goes on with
        or without a device from where another was interrupted.

    Returns
    -------
    Codes
        One row a shape in the order of the sources, and the failures.

    Raises
    ------
    ReadError
        When no source gave a shape; it carries the failures.
    ParameterError
        When there is no source.
    ModelError
        When `settings`, `model` and `known` do not go together.
    MissingExtraError
        When the device needs a package that is not installed.

    Examples
    --------
    >>> squares = [Shape.from_mask(np.ones((n, n)), name=f"square {n}") for n in (9, 12)]
    >>> codes = encode_collection(squares, Settings(features="spem", voxels=None, n_maps=2, n_centers=4))
    >>> codes.names, codes.vectors.shape
    (('square 9', 'square 12'), (2, 64))
    """
    if not sources:
        msg = "no sources were given; give files or shapes"
        raise ParameterError(msg)
    if device is not None:
        require_device(device)
    if known is not None:
        model = known.model if model is None else model
        known.require_same_model(model, "the vocabulary")
    chosen = _settings(settings, model)
    listing = Listing(sources, on_failure)
    reused = _reusable(known)
    with ExitStack() as stack:
        root = Path(work if work is not None else stack.enter_context(tempfile.TemporaryDirectory()))
        folder = Work.open(root, chosen, model)
        wanted = {key: source for key, source in listing.first.items() if key not in reused}
        # One process may take all cores for a large shape; of several each has one.
        task = _Task(folder, chosen, model, threads=None if n_jobs == 1 else 1)
        ndim_of = _compute(wanted, task, n_jobs, listing, progress or (lambda *_: None), device)
        whole = {key: ndim_of[key] for key in wanted if key not in listing.broken}
        fitted = model or _fit(folder, whole, chosen, listing)
        return _assemble(listing, folder, reused, fitted, progress or (lambda *_: None))


def encode_file(
    source: str | Path | Shape, model: Model, *, device: Backend | None = None
) -> NDArray[np.float32]:
    """Make the code of one file or shape with a model.

    Parameters
    ----------
    source
        A file that holds one shape, or a shape.
    model
        The model of the codes that it is to be compared with.
    device
        Where to sweep it; the processor when None.

    Returns
    -------
    NDArray
        ``(n_code,)`` code, the same as in a collection.

    Raises
    ------
    SpemError
        When the file cannot be read or coded.
    ShapeError
        When it holds several labels.

    Examples
    --------
    >>> square = Shape.from_mask(np.ones((9, 9)))
    >>> settings = Settings(features="spem", voxels=None, n_maps=2, n_centers=4)
    >>> model = encode_collection([square], settings).model
    >>> encode_file(square, model).shape
    (64,)
    """
    with threadpool_limits(1):
        given = as_source(source)
        found = list(read_shapes(given, model.settings))
        if len(found) != 1:
            msg = f"{source}: holds {len(found)} labels; encode the file and query by one of its shapes"
            raise ShapeError(msg)
        [(suffix, shape)] = found
        if isinstance(shape, SpemError):
            raise ShapeError(one_line(shape))
        model.require_ndim(shape.ndim, source_path(given) + suffix)
        if device is not None:
            return np.asarray(encode_shapes([shape], model, device=device)[0])
        return model.encode(shape_features(shape, model.settings), shape.name)


def merge(existing: Codes, new: Codes) -> Codes:
    """Return codes with new ones added; those of the same files, however named, are replaced.

    Parameters
    ----------
    existing, new
        Codes of one model.

    Raises
    ------
    ModelError
        When the models differ.

    Examples
    --------
    >>> square = Shape.from_mask(np.ones((9, 9)))
    >>> codes = encode_collection([square], Settings(features="spem", voxels=None, n_maps=2, n_centers=4))
    >>> len(merge(codes, codes))
    1
    """
    given = {_place(path) for path in (*new.paths, *(failure.path for failure in new.failures))}
    stays = existing.take([i for i, path in enumerate(existing.paths) if _place(path) not in given])
    failures = tuple(failure for failure in existing.failures if _place(failure.path) not in given)
    return replace(stays, failures=failures).join(new)


def missing(codes: Codes, paths: Sequence[str | Path]) -> list[int]:
    """Return the rows of codes whose files were in these folders, and are no longer there.

    Parameters
    ----------
    codes
        The codes.
    paths
        Folders; anything else leads to nothing.

    Examples
    --------
    >>> square = Shape.from_mask(np.ones((9, 9)))
    >>> codes = encode_collection([square], Settings(features="spem", voxels=None, n_maps=2, n_centers=4))
    >>> missing(replace(codes, paths=("gone.png",)), ["."])
    [0]
    """
    roots = [Path(path).resolve() for path in paths if Path(path).is_dir()]
    # a shape that was no file has its name for a path
    places = {row: _place(path) for row, path in enumerate(codes.paths) if has_suffix(Path(path), SUFFIXES)}
    below = (row for row, place in places.items() if any(place.is_relative_to(root) for root in roots))
    return [row for row in below if not places[row].exists()]


def _place(path: str) -> Path:
    """Return where a file lies, whatever folder its path starts from; a link to a file is one of its own."""
    file = Path(path)
    return file.parent.resolve() / file.name


@dataclass(frozen=True)
class _Task:
    """What workers do with a source: compute its entries and leave them in the work folder."""

    folder: Work
    settings: Settings
    model: Model | None
    threads: int | None

    def __call__(self, item: tuple[str, Source]) -> int:
        key, source = item
        entries = _entries(source, self.settings, self.model, self.threads)
        self.folder.save(key, entries)
        return dimension(entries)


def _entries(
    source: Source, settings: Settings, model: Model | None, threads: int | None = None
) -> list[Entry]:
    """Compute the features of every shape of a source, or its code where there is a model."""
    entries = []
    for suffix, shape in read_shapes(source, settings):
        if isinstance(shape, SpemError):
            entries.append(Entry(suffix, one_line(shape)))
            continue
        try:
            if model is not None:
                model.require_ndim(shape.ndim, source_path(source) + suffix)
            bands = shape_features(shape, settings, threads)
        except SpemError as error:
            if not suffix:
                raise
            entries.append(Entry(suffix, one_line(error)))
            continue
        arrays = bands if model is None else (model.encode(bands, shape.name),)
        entries.append(Entry(suffix, ndim=shape.ndim, arrays=arrays, volume=shape.volume))
    return entries


def _compute(
    wanted: dict[str, Source],
    task: _Task,
    n_jobs: int,
    listing: Listing,
    progress: Progress,
    device: Backend | None,
) -> dict[str, int]:
    """Bring the work folder up to date and return the dimension of each source; those that fail are noted."""
    found = {key: task.folder.dimension(key) for key in wanted}
    ndim_of = {key: ndim for key, ndim in found.items() if ndim is not None}
    todo = [(key, source) for key, source in wanted.items() if key not in ndim_of]
    progress("fields", len(ndim_of), len(wanted))

    def done(key: str, ndim: int) -> None:
        ndim_of[key] = ndim
        progress("fields", len(ndim_of), len(wanted))

    if device is not None:
        DeviceWork(task.folder, task.settings, task.model, device, task.threads).run(
            todo, n_jobs, listing, done
        )
        return ndim_of
    for (key, source), ndim, reason in run_all(task, todo, n_jobs):
        if reason:
            listing.fail(source, reason, key)
        done(key, ndim or 0)
    return ndim_of


def _fit(folder: Work, ndim_of: dict[str, int], settings: Settings, listing: Listing) -> Model:
    """Learn a vocabulary from a sample of the sources, chosen and ordered by their content."""
    if not any(ndim_of.values()):
        for key in ndim_of:
            for entry in folder.load(key):
                listing.fail(listing.first[key], _label_reason(entry))
        raise _nothing(listing)
    ndim = _one_dimension(ndim_of, listing)
    ranked = sorted(
        (key for key in ndim_of if ndim_of[key] == ndim),
        key=lambda key: hashlib.sha256(f"{settings.seed} {key}".encode()).digest(),
    )
    with threadpool_limits(1):
        return Model.fit(settings, folder.features(ranked, TRAINING_SHAPES), ndim)


def _one_dimension(ndim_of: dict[str, int], listing: Listing) -> int:
    """Return the commonest dimension; sources of others fail, since their codes cannot be compared."""
    counts = Counter(ndim for ndim in ndim_of.values() if ndim)
    # of equally common ones the lowest, so that the order of the sources does not matter
    common = min(counts, key=lambda ndim: (-counts[ndim], ndim))
    for key, ndim in ndim_of.items():
        if ndim not in (0, common):
            reason = f"a {ndim}-D shape among {common}-D ones, which are more; encode them apart"
            listing.fail(listing.first[key], reason, key)
    return common


def _assemble(
    listing: Listing, folder: Work, reused: dict[str, list[Entry]], model: Model, progress: Progress
) -> Codes:
    """Make the code of every shape, in the order of the sources."""
    names, paths, hashes, vectors, volumes = [], [], [], [], []
    coded = dict(reused)
    for done, (source, key) in enumerate(listing, 1):
        if key is None or listing.fails_again(key, source):
            continue
        if key not in coded:
            coded[key] = [_coded(entry, model) for entry in folder.load(key)]
        for entry in coded[key]:
            if entry.reason:
                listing.fail(source, _label_reason(entry))
                continue
            names.append(source_name(source) + entry.suffix)
            paths.append(source_path(source))
            hashes.append(key)
            vectors.append(entry.arrays[0])
            volumes.append(entry.volume)
        progress("codes", done, len(listing.sources))
    if not vectors:
        raise _nothing(listing)
    identity = tuple(names), tuple(paths), tuple(hashes)
    return Codes(*identity, np.stack(vectors), model, tuple(listing.failures), np.array(volumes))


def _label_reason(entry: Entry) -> str:
    """Say which label of a source gave nothing, and why."""
    return f"{entry.suffix.lstrip('-')}: {entry.reason}"


def _nothing(listing: Listing) -> ReadError:
    """Say that there is nothing to make codes of, and why of the first source."""
    first, *others = listing.failures
    more = f" (and {len(others)} more)" if others else ""
    return ReadError(f"no shape could be read, so there are no codes: {first}{more}", listing.failures)


def _coded(entry: Entry, model: Model) -> Entry:
    """Turn features into a code; codes and failures stay as they are."""
    if entry.reason or entry.arrays[0].ndim == 1:
        return entry
    return replace(entry, arrays=(model.encode(entry.arrays),))


def _reusable(known: Codes | None) -> dict[str, list[Entry]]:
    """Index known codes by content; of copies of a file under several names the first counts."""
    if known is None:
        return {}
    first: dict[str, str] = {}
    rows: dict[str, list[Entry]] = {}
    columns = known.names, known.paths, known.hashes, known.vectors, known.volumes.tolist()
    for name, path, key, vector, volume in zip(*columns, strict=True):
        if first.setdefault(key, path) == path:
            suffix = name.removeprefix(source_name(Path(path)))
            entry = Entry(suffix, ndim=known.model.ndim or 0, arrays=(vector,), volume=volume)
            rows.setdefault(key, []).append(entry)
    return rows


def _settings(settings: Settings | None, model: Model | None) -> Settings:
    """Return the settings to use; with a model they must be its own."""
    if model is None:
        return settings or Settings()
    if settings is not None and settings.resolved(model.ndim) != model.settings:
        mine, theirs = settings.to_json(), model.settings.to_json()
        odd = [f"{key} {mine[key]} against {theirs[key]}" for key in mine if mine[key] != theirs[key]]
        msg = f"the vocabulary was made with other settings ({'; '.join(odd)}); leave them out"
        raise ModelError(msg)
    return model.settings
