"""From files to rows: what a worker makes of each source, in this process, in others or on a cluster."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict
from pathlib import Path

from spem.codes.codes import Failure
from spem.codes.collection import encode_collection
from spem.codes.kinds import shape_features
from spem.codes.model import Model
from spem.codes.settings import Settings
from spem.codes.sources import Source, read_shapes, source_hash, source_name, source_path
from spem.codes.workers import run_all
from spem.errors import SpemError
from spem.index.row import Row, pack, row_id
from spem.index.store import Store
from spem.plots.thumbnails import thumbnail
from spem.shapes.shape import Shape

Progress = Callable[[str, int, int], None]
_THUMBNAIL_DIMENSIONS = 3


def learn(sources: Sequence[str | Path | Shape], settings: Settings | None, n_jobs: int) -> Model:
    """Learn a model from the shapes that an index begins with."""
    return encode_collection(sources, settings, n_jobs=n_jobs).model


def describe(source: Source, model: Model) -> list[Row]:
    """Make the rows of the shapes of a source.

    Raises
    ------
    SpemError
        When the source cannot be read, or none of its shapes coded.
    """
    rows, key = [], source_hash(source)
    for suffix, shape in read_shapes(source, model.settings):
        if isinstance(shape, SpemError):
            raise shape
        rows.append(row_of(shape, model, key, suffix, source_name(source) + suffix, source_path(source)))
    return rows


def row_of(shape: Shape, model: Model, key: str, suffix: str, name: str, path: str) -> Row:
    """Make the row of one shape."""
    model.require_ndim(shape.ndim, name)
    code = model.encode(shape_features(shape, model.settings), name)
    return Row(
        row_id(key, suffix),
        key,
        name,
        path,
        code,
        ndim=shape.ndim,
        n_nodes=shape.n_nodes,
        volume=shape.volume,
        report=asdict(shape.report),
        thumbnail=thumbnail(shape) if shape.ndim <= _THUMBNAIL_DIMENSIONS else b"",
        shape=pack(shape),
    )


class _Describe:
    """What workers do with a source."""

    def __init__(self, model: Model) -> None:
        self.model = model

    def __call__(self, source: Source) -> list[Row]:
        return describe(source, self.model)


def add_sources(
    store: Store,
    sources: Sequence[Source],
    model: Model,
    *,
    labels: Mapping[str, str] | None = None,
    n_jobs: int = 1,
    progress: Progress | None = None,
) -> list[Failure]:
    """Encode sources and write their rows as they come."""
    failures = []
    tell = progress or (lambda *_: None)
    for done, (source, rows, reason) in enumerate(run_all(_Describe(model), sources, n_jobs), 1):
        if rows is None:
            failures.append(Failure(source_path(source), reason))
        else:
            store.write(rows, model)
        tell("codes", done, len(sources))
    return failures
