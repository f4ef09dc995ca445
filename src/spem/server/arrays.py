"""Arrays on the wire: a JSON header and little-endian numbers in one body that a browser reads in place."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spem.errors import ReadError

MEDIA_TYPE = "application/vnd.spem.arrays"
# Typed arrays of a browser begin at multiples of their width.
_ALIGNMENT = 8
_TYPES = {kind: np.dtype(kind) for kind in ("<f4", "<f8", "|i1", "|u1", "<i2", "<u2", "<i4", "<u4")}


def pack_arrays(header: Mapping[str, Any], arrays: Mapping[str, NDArray[Any]]) -> bytes:
    """Return a header and arrays as one body.

    Four bytes give the length of the JSON that follows, which has the header and, under ``"arrays"``, the
    name, type, shape and offset of each array; offsets count from the first multiple of eight after the JSON.

    Parameters
    ----------
    header
        What `json` can write.
    arrays
        Numbers of at most four bytes, or float64.

    Examples
    --------
    >>> unpack_arrays(pack_arrays({"name": "disk"}, {"rho": np.array([1.0, 2.0])}))
    ({'name': 'disk'}, {'rho': array([1., 2.])})
    """
    listed, parts, offset = [], [], 0
    for name, values in arrays.items():
        array = np.ascontiguousarray(values)
        array = array.astype(array.dtype.newbyteorder("<"))
        data = array.tobytes()
        listed.append({"name": name, "type": array.dtype.str, "shape": list(array.shape), "offset": offset})
        parts.append(data + bytes(-len(data) % _ALIGNMENT))
        offset += len(parts[-1])
    text = json.dumps({**header, "arrays": listed}, allow_nan=False).encode()
    text += b" " * (-(4 + len(text)) % _ALIGNMENT)
    return len(text).to_bytes(4, "little") + text + b"".join(parts)


def unpack_arrays(body: bytes) -> tuple[dict[str, Any], dict[str, NDArray[Any]]]:
    """Return the header and the arrays of a body.

    Raises
    ------
    ReadError
        When the body is no such thing.
    """
    try:
        length = int.from_bytes(body[:4], "little")
        header = json.loads(body[4 : 4 + length])
        arrays = {}
        for entry in header.pop("arrays"):
            kind, shape = entry["type"], tuple(entry["shape"])
            count = int(np.prod(shape, dtype=np.int64))
            begin = 4 + length + entry["offset"]
            arrays[entry["name"]] = np.frombuffer(body, _TYPES[kind], count, begin).reshape(shape)
    except (ValueError, LookupError, TypeError, AttributeError, OverflowError, RecursionError) as error:
        msg = f"not a body of arrays ({error}); expected what pack_arrays makes"
        raise ReadError(msg) from error
    return header, arrays
