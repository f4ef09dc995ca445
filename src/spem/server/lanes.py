"""Bounded pools of threads for what blocks: the event loop never waits, and no queue grows for ever."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import TypeVar

from spem.server.refusals import Busy

Result = TypeVar("Result")


class Lane:
    """Threads that run blocking calls, and at most so many calls that wait for one.

    Parameters
    ----------
    name
        Name of the threads.
    n_threads
        Number of calls at a time.
    n_waiting
        Number of calls that may wait.
    """

    def __init__(self, name: str, n_threads: int, n_waiting: int) -> None:
        self._threads = ThreadPoolExecutor(n_threads, thread_name_prefix=f"spem-{name}")
        self._room = n_threads + n_waiting
        self._inside = 0

    @property
    def inside(self) -> int:
        """Number of calls that run or wait."""
        return self._inside

    async def run(self, call: Callable[..., Result], *arguments: object) -> Result:
        """Run a call in one of the threads.

        Raises
        ------
        Busy
            When too many calls wait.
        """
        if self._inside >= self._room:
            msg = "the server is busy; come again in a moment"
            raise Busy(msg)
        self._inside += 1
        future = asyncio.get_running_loop().run_in_executor(self._threads, call, *arguments)
        # Counted until the thread is free again, also when nobody waits for the answer any more.
        future.add_done_callback(self._left)
        return await future

    def _left(self, future: asyncio.Future[Result]) -> None:
        """Count a call that is over."""
        self._inside -= 1

    def close(self) -> None:
        """Let go of the threads; calls that wait are dropped."""
        self._threads.shutdown(wait=False, cancel_futures=True)
