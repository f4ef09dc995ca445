"""Values that are made when they are asked for, and hold for a while."""

from __future__ import annotations

import threading
import time
from collections import OrderedDict
from collections.abc import Callable, Hashable
from typing import Any, TypeVar

Value = TypeVar("Value")


class Remembered:
    """Values that hold for some seconds, the latest used ones.

    Parameters
    ----------
    size
        Number of values kept.
    seconds
        How long a value holds.

    Examples
    --------
    >>> values = Remembered(2, 60.0)
    >>> values.get("a", lambda: 1), values.get("a", lambda: 2)
    (1, 1)
    """

    def __init__(self, size: int, seconds: float) -> None:
        self._size, self._seconds = size, seconds
        self._lock = threading.Lock()
        self._values: OrderedDict[Hashable, tuple[float, Any]] = OrderedDict()
        self._cleared = 0

    def get(self, key: Hashable, make: Callable[[], Value]) -> Value:
        """Return a value, made where there is none or an old one."""
        now = time.monotonic()
        with self._lock:
            made, value = self._values.get(key, (-self._seconds, None))
            if now - made < self._seconds:
                self._values.move_to_end(key)
                known: Value = value
                return known
            cleared = self._cleared
        fresh = make()
        with self._lock:
            if cleared != self._cleared:
                # made of what was before, perhaps
                return fresh
            self._values[key] = (now, fresh)
            self._values.move_to_end(key)
            while len(self._values) > self._size:
                self._values.popitem(last=False)
        return fresh

    def clear(self) -> None:
        """Forget all values."""
        with self._lock:
            self._values.clear()
            self._cleared += 1
