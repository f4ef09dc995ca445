"""Memory of the simulated device: between guards, and poisoned."""

from __future__ import annotations

import ctypes
import weakref
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

#: Bytes before and after an array that no kernel may write to; the word is not a number in either precision.
GUARD = 4096
WORD = np.uint32(0xFFF5A5A5)


class FaultError(Exception):
    """A kernel did what no kernel may: write outside its arrays, or part from its block at a barrier."""


class Guarded:
    """Memory of one array, aligned as the device's is, between two guards."""

    live: ClassVar[weakref.WeakSet[Guarded]] = weakref.WeakSet()

    def __init__(self, n_bytes: int) -> None:
        words = -(-n_bytes // 32) * 8
        whole = np.empty(words + 2 * GUARD // 4 + 8, np.uint32)
        start = (-whole.ctypes.data % 32 + GUARD) // 4
        self.values: NDArray[np.uint8] = whole[start : start + words].view(np.uint8)[:n_bytes]
        self.tail = whole[start : start + words].view(np.uint8)[n_bytes:]
        self.guards = (whole[start - GUARD // 4 : start], whole[start + words : start + words + GUARD // 4])
        for zone in self.guards:
            zone[:] = WORD
        self.tail[:] = 0xA5
        Guarded.live.add(self)

    def seal(self) -> None:
        """Have the address sanitizer stop whoever reads or writes the guards."""
        forbid = ctypes.CDLL(None)["__asan_poison_memory_region"]
        for zone in (*self.guards, self.tail):
            forbid(ctypes.c_void_p(zone.ctypes.data), ctypes.c_size_t(zone.nbytes))

    def require_whole(self, culprit: str, place: str) -> None:
        """Raise a FaultError if the guards were written to."""
        if not (self.tail == 0xA5).all() or not all((zone == WORD).all() for zone in self.guards):
            msg = f"{culprit} wrote outside {place}, an array of {self.values.nbytes} bytes"
            for zone in self.guards:
                zone[:] = WORD
            self.tail[:] = 0xA5
            raise FaultError(msg)


def poison(values: NDArray[Any]) -> None:
    """Fill an array with what spoils results: not a number, or the least integer but a few."""
    values.reshape(-1).view(np.uint8)[:] = 0xFF if values.dtype.kind == "f" else 0x81


def guard(values: NDArray[Any]) -> tuple[NDArray[Any], Guarded]:
    """Copy an array into guarded memory."""
    guarded = Guarded(values.nbytes)
    held = guarded.values.view(values.dtype).reshape(values.shape)
    held[...] = values
    return held, guarded
