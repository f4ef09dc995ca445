"""Tables of a batch brought to a device piece by piece."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from itertools import chain
from typing import Any

import numpy as np
from numpy.typing import NDArray

from spem.fields.solvers.cuda.runtime import Array, Runtime

# Enough for the full rate of a transfer; page-locked memory and the copy on the host stay that small.
PIECE_BYTES = 16 << 20


def upload_joined(runtime: Runtime, arrays: Iterable[NDArray[Any]], n_rows: int) -> Array:
    """Copy arrays to the device, end to end, without a copy of all of them on the host.

    A piece travels while the next one is got ready.

    Parameters
    ----------
    runtime
        The device.
    arrays
        Arrays of one type, equal in all but the first axis, none of them empty.
    n_rows
        Length of all together.
    """
    pieces = _pieces(arrays)
    first = next(pieces)
    if len(first) == n_rows:
        return runtime.upload(first)
    table, start = runtime.empty((n_rows, *first.shape[1:]), first.dtype), 0
    for piece in chain([first], pieces):
        table[start : start + len(piece)] = runtime.upload(piece)
        start += len(piece)
    return table


def _pieces(arrays: Iterable[NDArray[Any]]) -> Iterator[NDArray[Any]]:
    """Join short arrays, and cut long ones, to pieces of at most so many bytes."""
    held: list[NDArray[Any]] = []
    size = 0
    for array in arrays:
        length = max(1, PIECE_BYTES // array[:1].nbytes)
        for part in (array[start : start + length] for start in range(0, len(array), length)):
            if held and size + part.nbytes > PIECE_BYTES:
                yield _joined(held)
                held, size = [], 0
            held.append(part)
            size += part.nbytes
    yield _joined(held)


def _joined(arrays: list[NDArray[Any]]) -> NDArray[Any]:
    """Arrays end to end; one alone is not copied."""
    return arrays[0] if len(arrays) == 1 else np.concatenate(arrays)
