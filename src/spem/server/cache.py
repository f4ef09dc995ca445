"""Answers that were computed before, up to so many bytes; equal questions at one time are computed once."""

from __future__ import annotations

import asyncio
from collections import OrderedDict
from collections.abc import Awaitable, Callable, Hashable

Compute = Callable[[], Awaitable[bytes]]


class Cache:
    """Bodies by key; the least recently used go first.

    Used from one event loop only, so it needs no lock.

    Parameters
    ----------
    limit
        Number of bytes kept; a body of more than a quarter of it is not.
    """

    def __init__(self, limit: int) -> None:
        self._limit = limit
        self._kept: OrderedDict[Hashable, bytes] = OrderedDict()
        self._coming: dict[Hashable, asyncio.Task[bytes]] = {}
        self.n_bytes = 0

    async def get(self, key: Hashable, compute: Compute) -> bytes:
        """Return the body of a key, computed where it is not kept.

        A computation goes on when its client has left, since another one may have joined it.
        """
        body = self.kept(key)
        if body is not None:
            return body
        task = self._coming.get(key)
        if task is None:
            task = self._coming[key] = asyncio.ensure_future(compute())
            task.add_done_callback(lambda done: self._arrived(key, done))
        return await asyncio.shield(task)

    def kept(self, key: Hashable) -> bytes | None:
        """Return a body if it is kept."""
        body = self._kept.get(key)
        if body is not None:
            self._kept.move_to_end(key)
        return body

    def put(self, key: Hashable, body: bytes) -> None:
        """Keep a body."""
        if len(body) > self._limit // 4:
            return
        self.n_bytes += len(body) - len(self._kept.pop(key, b""))
        self._kept[key] = body
        while self.n_bytes > self._limit:
            self.n_bytes -= len(self._kept.popitem(last=False)[1])

    def _arrived(self, key: Hashable, task: asyncio.Task[bytes]) -> None:
        """Keep what was computed; a failure is told to those who wait, and forgotten."""
        del self._coming[key]
        if not task.cancelled() and task.exception() is None:
            self.put(key, task.result())
