"""What worker processes do with untrusted files and with the shapes made of them."""

from __future__ import annotations

import hashlib
import math
from collections.abc import Callable, Mapping
from contextvars import ContextVar
from dataclasses import replace
from datetime import datetime
from functools import lru_cache
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from spem.codes.model import Model
from spem.codes.sources import read_shapes, source_name
from spem.errors import ModelError, ShapeError, SizeError, SpemError
from spem.index.encoding import row_of
from spem.index.row import Row, unpack
from spem.server.uploads import check_content, check_members, safe_name, upload_suffix
from spem.shapes.limits import memory_limit_bytes

Reply: TypeAlias = tuple[dict[str, Any], dict[str, NDArray[Any]]]
Task: TypeAlias = Callable[[dict[str, Any], bytes], Reply]

# Called with a stage and the share of the task that is done when it begins.
listener: ContextVar[Callable[[str, float], None]] = ContextVar("listener", default=lambda *_: None)
_MOST_LABELS = 256
_TEXT = ("id", "hash", "name", "path", "label", "ndim", "n_nodes", "volume")


def encode(header: dict[str, Any], payload: bytes) -> Reply:
    """Read an uploaded file and make the rows of its shapes.

    Parameters
    ----------
    header
        ``name`` of the upload and ``model_file``, where the model lies; it may have ``title``, the name for
        people, and ``voxels``, the most voxels that a shape may have inside. Packed volumes may expand to the
        memory limit of the readers.
    payload
        The bytes of the file.

    Raises
    ------
    SpemError
        When it is an archive, cannot be read, or has a shape that cannot be coded.
    """
    name, suffix = str(header["name"]), upload_suffix(str(header["name"]))
    shown, most = safe_name(name), memory_limit_bytes()
    check_content(name, payload, most)
    # in the folder of the task, under a name of ours: nothing of the client's reaches the file system
    file = Path("upload" + suffix)
    file.write_bytes(payload)
    try:
        if suffix == ".npz":
            check_members(file, shown, most)
        rows = _rows(file, _model(header["model_file"]), shown, header)
    except SpemError as error:
        raise type(error)(str(error).replace(str(file), shown)) from error
    return pack_rows(rows)


def view(header: dict[str, Any], payload: bytes) -> Reply:
    """Compute a view of a packed shape: ``view`` of the header names it, the rest are its options."""
    from spem.server.views import VIEWS

    options = {key: value for key, value in header.items() if key != "view"}
    return VIEWS[header["view"]](unpack(payload, str(header.get("name", "shape"))), options)


def words(header: dict[str, Any], payload: bytes) -> Reply:
    """Tell why two packed shapes are alike, by the model in ``model_file``; the rest are options."""
    from spem.server.views.words import unpack_pair, view_words

    return view_words(*unpack_pair(payload), _model(header["model_file"]), header)


def pack_rows(rows: list[Row]) -> Reply:
    """Return rows as a header and arrays."""
    listed, arrays = [], {}
    for number, row in enumerate(rows):
        listed.append(
            {name: getattr(row, name) for name in _TEXT}
            | {
                "copies": list(row.copies),
                "metadata": dict(row.metadata),
                "report": _plain(row.report),
                "added": row.added.isoformat(),
            }
        )
        arrays[f"code-{number}"] = np.asarray(row.code, np.float32)
        arrays[f"thumbnail-{number}"] = np.frombuffer(row.thumbnail, np.uint8)
        arrays[f"shape-{number}"] = np.frombuffer(row.shape, np.uint8)
    return {"rows": listed}, arrays


def unpack_rows(header: Mapping[str, Any], arrays: Mapping[str, NDArray[Any]]) -> list[Row]:
    """Return the rows that `pack_rows` made this of.

    Examples
    --------
    >>> row = Row("ab-1", "ab", "hand", "hand.png", np.ones(3, np.float32), ndim=2, shape=b"packed")
    >>> [again] = unpack_rows(*pack_rows([row]))
    >>> again.id, again.code.tolist(), again.shape
    ('ab-1', [1.0, 1.0, 1.0], b'packed')
    """
    rows = []
    for number, record in enumerate(header["rows"]):
        rest: dict[str, Any] = {
            "copies": tuple(record["copies"]),
            "added": datetime.fromisoformat(record["added"]),
            "code": arrays[f"code-{number}"],
            "thumbnail": arrays[f"thumbnail-{number}"].tobytes(),
            "shape": arrays[f"shape-{number}"].tobytes(),
        }
        rows.append(Row(**{**record, **rest}))
    return rows


#: What a worker can do, by name.
TASKS: Mapping[str, Task] = {"encode": encode, "view": view, "words": words}


def _rows(file: Path, model: Model, shown: str, header: Mapping[str, Any]) -> list[Row]:
    """Read the shapes of a file and code them."""
    key = hashlib.sha256(file.read_bytes()).hexdigest()
    title = str(header.get("title") or source_name(Path(shown)))
    tell = listener.get()
    tell("reading", 0.1)
    found = []
    for suffix, shape in read_shapes(file, model.settings):
        if isinstance(shape, SpemError):
            raise shape
        if shape.n_nodes > header.get("voxels", math.inf):
            msg = (
                f"{shown}: {shape.n_nodes} voxels inside, the limit is {header['voxels']}; send a coarser one"
            )
            raise SizeError(msg)
        found.append((suffix, shape))
        if len(found) > _MOST_LABELS:
            msg = f"{shown}: holds more than {_MOST_LABELS} labels; send fewer at a time"
            raise ShapeError(msg)
    rows = []
    for done, (suffix, shape) in enumerate(found):
        tell("coding", 0.3 + 0.7 * done / len(found))
        rows.append(row_of(shape, model, key, suffix, title + suffix, shown))
    return [replace(row, report={**row.report, "source": shown}) for row in rows]


@lru_cache(maxsize=4)
def _model(path: str) -> Model:
    """Load a model once in a process; its file is named by its digest and never changes."""
    if not Path(path).is_file():
        msg = "the model of this index is gone from the server's folder; start the server again"
        raise ModelError(msg)
    return Model.load(path)


def _plain(value: Any) -> Any:
    """Return a report as JSON has it."""
    if isinstance(value, Mapping):
        return {str(key): _plain(inner) for key, inner in value.items()}
    if isinstance(value, (list, tuple)):
        return [_plain(inner) for inner in value]
    return value if isinstance(value, (str, int, float, bool, type(None))) else str(value)
