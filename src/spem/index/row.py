"""One row of an index: a shape, its code, and what is known of it."""

from __future__ import annotations

import io
import json
import math
import zlib
from collections.abc import Mapping
from dataclasses import dataclass, field
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spem.errors import ReadError, SpemError
from spem.files import DAMAGE
from spem.shapes.kinds import SUFFIXES, has_suffix
from spem.shapes.packing import pack_shape, unpack_shape
from spem.shapes.shape import Shape

# Hex digits of the content hash that tell rows apart: 80 bits, so that 10^9 shapes collide with odds of 1e-6.
ID_DIGITS = 20
# Before the path of what came as an upload, which lies nowhere.
UPLOADED = "upload:"
# Steps of an edge that a cut is kept to: one half, where nothing is known of a cut, is one of them.
_STEPS = 2**12


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


def names_file(path: str) -> bool:
    """Tell whether the path of a row is that of a file: not the name of a shape, nor of an upload.

    Examples
    --------
    >>> names_file("shapes/cat.obj"), names_file("disk"), names_file(f"{UPLOADED}9f/cat.obj")
    (True, False, False)
    """
    return has_suffix(Path(path), SUFFIXES) and not path.startswith(UPLOADED)


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

    Where the surface cuts edges is kept to 1/8192 of an edge, vertices of a surface to 1e-7 of its extent. Of
    15,000 nodes that makes 5 kB in the plane and 36 kB in space, beside some 8 bytes for each triangle.

    Codes of maps made of what `unpack` gives are within 1e-5, in correlation distance, of those of the shape
    itself. Wave kernel signatures of remeshed surfaces and inner distances may be 0.05 away: they hang
    on choices that any change of 1e-9 can turn.

    Examples
    --------
    >>> unpack(pack(Shape.from_mask(np.ones((2, 3)), name="slab")))
    Shape('slab', 2-D, 6 nodes, grid 4 x 5, spacing 1 x 1)
    """
    arrays, attributes = pack_shape(shape)
    nodes = arrays.pop("voxels")
    attributes["grid"] = list(shape.mask.shape)
    packed: dict[str, Any] = {
        "mask": np.packbits(shape.mask),
        "cut_edges": _edges(nodes, arrays.pop("cut_voxel"), arrays.pop("cut_direction"), shape.ndim),
        "cut_steps": _planes(np.maximum(np.rint(arrays.pop("cut_fraction") * _STEPS), 1).astype("<u2")),
    }
    if shape.surface is not None:
        vertices = arrays.pop("surface_vertices")
        packed["surface_corner"] = vertices.min(axis=0)
        packed["surface_offsets"] = _planes((vertices - vertices.min(axis=0)).astype("<f4").ravel())
        packed["surface_faces"] = _planes(arrays.pop("surface_faces").astype("<u4").ravel())
    packed["attributes"] = np.frombuffer(json.dumps(attributes).encode(), np.uint8)
    buffer = io.BytesIO()
    np.savez_compressed(buffer, **(packed | arrays))
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
        attributes = json.loads(arrays.pop("attributes").tobytes())
        size = math.prod(attributes["grid"])
        nodes = np.flatnonzero(np.unpackbits(arrays.pop("mask"), count=size))
        voxel, direction = np.nonzero(np.unpackbits(arrays.pop("cut_edges"), axis=1))
        arrays |= {"voxels": nodes, "cut_voxel": nodes[voxel], "cut_direction": direction}
        arrays["cut_fraction"] = _joined(arrays.pop("cut_steps"), "<u2") / _STEPS
        if "surface_corner" in arrays:
            offsets = _joined(arrays.pop("surface_offsets"), "<f4").reshape(-1, 3)
            arrays["surface_vertices"] = arrays.pop("surface_corner") + offsets
            arrays["surface_faces"] = _joined(arrays["surface_faces"], "<u4").reshape(-1, 3).astype(np.int64)
        return unpack_shape(arrays, attributes)
    except (*DAMAGE, SpemError, zlib.error) as error:
        msg = f"{name}: its packed shape is damaged ({error}); add its file again"
        raise ReadError(msg) from error


def _edges(
    nodes: NDArray[np.int64], voxel: NDArray[np.int64], direction: NDArray[np.uint8], ndim: int
) -> NDArray[np.uint8]:
    """Return for each node, as bits, which of its edges are cut; cuts come in this order."""
    cut = np.zeros((nodes.size, 2 * ndim), bool)
    cut[np.searchsorted(nodes, voxel), direction] = True
    return np.packbits(cut, axis=1)


def _planes(values: NDArray[Any]) -> NDArray[np.uint8]:
    """Return the first bytes of all values, then the second ones and so on, which compresses better."""
    return np.ascontiguousarray(values.view(np.uint8).reshape(values.size, values.itemsize).T)


def _joined(planes: NDArray[np.uint8], kind: str) -> NDArray[Any]:
    """Return the values that `_planes` took apart."""
    return np.ascontiguousarray(planes.T).reshape(-1).view(kind)
