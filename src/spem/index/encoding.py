"""From a source to rows: read, features, code, picture and the shape itself; what every worker does."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import TypeVar

import numpy as np

from spem.codes.bands import Bands
from spem.codes.kinds import shape_features
from spem.codes.model import Model
from spem.codes.settings import Settings
from spem.codes.sources import Source, read_shapes, source_hash, source_name, source_path
from spem.codes.workers import one_line
from spem.errors import ReadError, SpemError
from spem.index.executors import Item
from spem.index.row import Row, pack, row_id
from spem.plots.thumbnails import thumbnail
from spem.shapes.shape import Shape

_THUMBNAIL_DIMENSIONS = 3
# As large as the cards of a gallery show them; the time grows with the area.
_THUMBNAIL_PIXELS = 128
_NO_CODE = np.empty(0, np.float32)
T = TypeVar("T")


@dataclass(frozen=True, eq=False)
class Draft:
    """A shape of a source before it has a code.

    Parameters
    ----------
    row
        Its row, without a code; None where there is nothing.
    features
        ``(n_nodes, n_maps)`` features of each band.
    reason
        Why there is nothing, or empty.
    """

    row: Row | None
    features: Bands = ()
    reason: str = ""


@dataclass(frozen=True, eq=False)
class Described:
    """What a source came to.

    Parameters
    ----------
    rows
        A row for each shape.
    failures
        Why labels of it gave none, one line each.
    """

    rows: tuple[Row, ...]
    failures: tuple[str, ...] = ()


def draft(
    item: Item,
    settings: Settings,
    *,
    model: Model | None = None,
    keep_shape: bool = True,
    threads: int | None = 1,
) -> Iterator[Draft]:
    """Read the shapes of a source and compute their features.

    Parameters
    ----------
    item
        The source.
    settings
        How it is read, and the kinds of features.
    model
        Refuses shapes of other dimensions than its own, before anything is computed.
    keep_shape
        Whether rows hold the packed shape.
    threads
        Threads for a large shape; the outcome does not depend on it.

    Yields
    ------
    Draft
        One for each shape; of a label that gives none, the reason.

    Raises
    ------
    SpemError
        When the source cannot be read, has changed since it was listed, or its only shape has no features.
    """

    def features(shape: Shape) -> Bands:
        return shape_features(shape, settings, threads)

    for row, found in bare_rows(item, settings, features, model=model, keep_shape=keep_shape):
        yield Draft(None, reason=found) if isinstance(found, str) else Draft(row, found)


def bare_rows(
    item: Item,
    settings: Settings,
    compute: Callable[[Shape], T],
    *,
    model: Model | None = None,
    keep_shape: bool = True,
) -> Iterator[tuple[Row | None, T | str]]:
    """Read the shapes of a source, and make their rows without a code.

    Parameters
    ----------
    item
        The source.
    settings
        How it is read.
    compute
        What codes are to be made of, of a shape.
    model, keep_shape
        As `draft` takes them.

    Yields
    ------
    tuple
        The row of each shape, and what was computed; of a label that gives none, None and the reason.

    Raises
    ------
    SpemError
        As by `draft`.
    """
    name, path = source_name(item.source), source_path(item.source)
    for suffix, shape in read_shapes(item.source, settings):
        try:
            if isinstance(shape, SpemError):
                raise shape
            _require_unchanged(item)
            if model is not None:
                model.require_ndim(shape.ndim, path + suffix)
            computed = compute(shape)
            row = _bare_row(shape, item.key, suffix, name + suffix, path, keep_shape=keep_shape)
        except SpemError as error:
            if not suffix:
                raise
            yield None, label_reason(suffix, one_line(error))
        else:
            yield row, computed


def label_reason(suffix: str, reason: str) -> str:
    """Say which label of a source gives nothing, and why.

    Examples
    --------
    >>> label_reason("-3", "too thin")
    '3: too thin'
    """
    return f"{suffix.lstrip('-')}: {reason}"


def finish(drafts: Iterator[Draft] | list[Draft], model: Model) -> Described:
    """Make the codes of drafts."""
    rows, failures = [], []
    for each in drafts:
        if each.row is None:
            failures.append(each.reason)
        else:
            rows.append(replace(each.row, code=model.encode(each.features, each.row.name)))
    return Described(tuple(rows), tuple(failures))


def describe(source: Source, model: Model, *, keep_shape: bool = True, threads: int | None = 1) -> Described:
    """Make the rows of the shapes of a source.

    Parameters
    ----------
    source
        A file or a shape.
    model
        What codes are made with.
    keep_shape
        Whether rows hold the packed shape.
    threads
        Threads for a large shape; the outcome does not depend on it.

    Raises
    ------
    SpemError
        When the source cannot be read, or its only shape not coded.

    Examples
    --------
    >>> from spem.codes.collection import encode_collection
    >>> square = Shape.from_mask(np.ones((9, 9)), name="square")
    >>> model = encode_collection([square], Settings(features="spem", voxels=None, n_centers=4)).model
    >>> describe(square, model).rows[0].name
    'square'
    """
    item = Item(source_hash(source), source)
    drafts = draft(item, model.settings, model=model, keep_shape=keep_shape, threads=threads)
    return finish(drafts, model)


def row_of(
    shape: Shape, model: Model, key: str, suffix: str, name: str, path: str, *, keep_shape: bool = True
) -> Row:
    """Make the row of one shape.

    Parameters
    ----------
    shape
        The shape, as it is to be coded.
    model
        What its code is made with.
    key
        SHA-256, in hex, of what it was read from.
    suffix
        What tells it from other shapes of that, or empty.
    name
        Name for people.
    path
        File that it was read from.
    keep_shape
        Whether the row holds the packed shape.

    Raises
    ------
    SpemError
        When it is of another dimension than the model's, or has no features.
    """
    model.require_ndim(shape.ndim, name)
    code = model.encode(shape_features(shape, model.settings), name)
    return replace(_bare_row(shape, key, suffix, name, path, keep_shape=keep_shape), code=code)


@dataclass(frozen=True, eq=False)
class Describe:
    """What workers do with a source once there is a model.

    Parameters
    ----------
    model
        What codes are made with.
    keep_shape
        Whether rows hold the packed shape.
    threads
        Threads for a large shape.
    """

    model: Model
    keep_shape: bool = True
    threads: int | None = 1

    def __call__(self, item: Item) -> Described:
        """Make the rows of a source."""
        drafts = draft(
            item, self.model.settings, model=self.model, keep_shape=self.keep_shape, threads=self.threads
        )
        return finish(drafts, self.model)


def _require_unchanged(item: Item) -> None:
    """Refuse a file that holds something else than what was listed, here or on another machine."""
    if isinstance(item.source, Path) and source_hash(item.source) != item.key:
        msg = f"{item.source}: changed since it was listed, or is another file on this machine; add it again"
        raise ReadError(msg)


def _bare_row(shape: Shape, key: str, suffix: str, name: str, path: str, *, keep_shape: bool) -> Row:
    """Make the row of a shape, without its code."""
    return Row(
        row_id(key, suffix),
        key,
        name,
        path,
        _NO_CODE,
        ndim=shape.ndim,
        n_nodes=shape.n_nodes,
        volume=shape.volume,
        report=asdict(shape.report),
        thumbnail=thumbnail(shape, _THUMBNAIL_PIXELS) if shape.ndim <= _THUMBNAIL_DIMENSIONS else b"",
        shape=pack(shape) if keep_shape else b"",
    )
