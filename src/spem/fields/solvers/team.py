"""Threads that share the slabs of a level; the result does not depend on how many there are."""

from __future__ import annotations

import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

# Slabs smaller than this cost more to hand out than to do.
_SLAB_NODES = 32_768
_MAX_THREADS = 16

Slabs = NDArray[np.int64]


def usable_threads() -> int:
    """Processors that this process may use, no more than OMP_NUM_THREADS if that is set."""
    limit = os.environ.get("OMP_NUM_THREADS", "")
    available = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else (os.cpu_count() or 1)
    return max(1, min(available, _MAX_THREADS, int(limit) if limit.isdigit() else _MAX_THREADS))


def cut_slabs(voxels: NDArray[np.int64], shape: tuple[int, ...]) -> Slabs:
    """First node of each slab of whole pairs of planes along the first axis, and the number of nodes."""
    n = voxels.size
    pair = 2 * int(np.prod(shape[1:], dtype=np.int64))
    wanted = np.arange(_SLAB_NODES, n - _SLAB_NODES // 2, _SLAB_NODES)
    starts = np.searchsorted(voxels, np.unique(voxels[wanted] // pair) * pair)
    return np.unique(np.concatenate([[0], starts, [n]])).astype(np.int64)


class Team:
    """Runs kernels over slabs, on several threads when a level has slabs enough.

    Parameters
    ----------
    threads
        Number of threads; as many as the process may use when None.
    """

    def __init__(self, threads: int | None = None) -> None:
        self.size = usable_threads() if threads is None else max(1, threads)
        self._pool: ThreadPoolExecutor | None = None

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """End the threads."""
        if self._pool is not None:
            self._pool.shutdown()
            self._pool = None

    def all(self, kernel: Callable[..., None], slabs: Slabs, *arguments: Any) -> None:
        """Do all slabs, in any order."""
        self._share(kernel, slabs, arguments, 0, 1)

    def even(self, kernel: Callable[..., None], slabs: Slabs, *arguments: Any) -> None:
        """Do slabs 0, 2, 4 ..., in any order."""
        self._share(kernel, slabs, arguments, 0, 2)

    def odd(self, kernel: Callable[..., None], slabs: Slabs, *arguments: Any) -> None:
        """Do slabs 1, 3, 5 ..., in any order."""
        if slabs.size > 2:
            self._share(kernel, slabs, arguments, 1, 2)

    def _share(
        self, kernel: Callable[..., None], slabs: Slabs, arguments: tuple[Any, ...], first: int, stride: int
    ) -> None:
        shares = min(self.size, len(range(first, slabs.size - 1, stride)))
        if shares <= 1:
            kernel(*arguments, slabs, first, stride)
            return
        if self._pool is None:
            self._pool = ThreadPoolExecutor(self.size - 1)
        others = [
            self._pool.submit(kernel, *arguments, slabs, first + k * stride, shares * stride)
            for k in range(1, shares)
        ]
        kernel(*arguments, slabs, first, shares * stride)
        for other in others:
            other.result()
