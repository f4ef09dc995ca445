"""Threads of the dense algebra: many small blocks are faster on one, a few large ones on all."""

from __future__ import annotations

from contextlib import AbstractContextManager, nullcontext
from functools import cache
from typing import Any

from threadpoolctl import ThreadpoolController

# Factors of fewer numbers than this consist of blocks so small that threads wait for each other more than
# they work; on a busy machine by far.
_SMALL = 5_000_000


def threads_for(n_entries: int) -> AbstractContextManager[Any]:
    """Limit dense algebra to one thread inside the context if a factor has few numbers."""
    if n_entries >= _SMALL:
        return nullcontext()
    limit: AbstractContextManager[Any] = _controller().limit(limits=1, user_api="blas")
    return limit


@cache
def _controller() -> ThreadpoolController:
    """Libraries that are loaded; looking for them takes longer than a small factorisation."""
    return ThreadpoolController()
