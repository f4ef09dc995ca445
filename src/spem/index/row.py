"""One row of an index: a shape, its code, and what is known of it."""

from __future__ import annotations

import io
import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from datetime import UTC, datetime
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spem.errors import ReadError
from spem.files import DAMAGE
from spem.shapes.packing import pack_shape, unpack_shape
from spem.shapes.shape import Shape

# Hex digits of the content hash that tell rows apart: 80 bits, so that 10^9 shapes collide with odds of 1e-6.
ID_DIGITS = 20


@dataclass(frozen=True, eq=False)
class Row:
    """A shape of an index.

    Parameters
    ----------
    id
        First digits of the content hash, and what tells shapes of one file apart: ``"9f…-3"``. Equal files
        are one row.
    hash
        SHA-256 of the file's bytes, in hex.
    name
        Name for people.
    path
        File that it was read from.
    code
        ``(n_code,)`` code, as the model makes it.
    copies
        Other files of the same content.
    label
        Class, where it is known.
    metadata
        Free keys and values.
    ndim, n_nodes
        Dimension and number of nodes of the shape as it was coded.
    volume
        Volume of the shape, area in 2-D, in the unit of its file to the power of the dimension.
    report
        What was read and what was repaired, as `spem.Report` has it.
    thumbnail
        Small PNG picture; empty where the dimension has none.
    shape
        The shape itself, as `pack` makes it; empty where it is not kept.
    added
        When the row was written, in UTC.
    """

    id: str
    hash: str
    name: str
    path: str
    code: NDArray[np.float32]
    copies: tuple[str, ...] = ()
    label: str = ""
    metadata: Mapping[str, str] = field(default_factory=dict)
    ndim: int = 0
    n_nodes: int = 0
    volume: float = 0.0
    report: Mapping[str, Any] = field(default_factory=dict)
    thumbnail: bytes = b""
    shape: bytes = b""
    added: datetime = field(default_factory=lambda: datetime.now(UTC))


def row_id(content_hash: str, suffix: str = "") -> str:
    """Return the id of a shape: of its file's hash, and its suffix among the shapes of the file.

    Examples
    --------
    >>> row_id("0123456789abcdef" * 4, "-3")
    '0123456789abcdef0123-3'
    """
    return content_hash[:ID_DIGITS] + suffix


def pack(shape: Shape) -> bytes:
    """Return a shape as bytes: a compressed npz without pickle.

    Examples
    --------
    >>> unpack(pack(Shape.from_mask(np.ones((2, 3)), name="slab")))
    Shape('slab', 2-D, 6 nodes, grid 4 x 5, spacing 1 x 1)
    """
    arrays, attributes = pack_shape(shape)
    header = np.frombuffer(json.dumps(attributes).encode(), np.uint8)
    buffer = io.BytesIO()
    np.savez_compressed(buffer, **{**arrays, "attributes": header})
    return buffer.getvalue()


def unpack(data: bytes, name: str = "shape") -> Shape:
    """Return the shape that `pack` made these bytes of.

    Raises
    ------
    ReadError
        When the bytes are damaged.
    """
    try:
        with np.load(io.BytesIO(data), allow_pickle=False) as file:
            arrays = {key: file[key] for key in file.files}
        return unpack_shape(arrays, json.loads(arrays.pop("attributes").tobytes()))
    except DAMAGE as error:
        msg = f"{name}: its packed shape is damaged ({error}); add its file again"
        raise ReadError(msg) from error
