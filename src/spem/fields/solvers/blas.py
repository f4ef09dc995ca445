"""One thread for the dense algebra of a factorisation."""

from __future__ import annotations

from contextlib import AbstractContextManager
from functools import cache
from typing import Any

from threadpoolctl import ThreadpoolController


def one_thread() -> AbstractContextManager[Any]:
    """Limit dense algebra to one thread inside the context.

    A factorisation is a long row of blocks, most of them small: more threads gain little on a free machine,
    and on a busy one they wait for each other many times longer than they work.
    """
    limit: AbstractContextManager[Any] = _controller().limit(limits=1, user_api="blas")
    return limit


@cache
def _controller() -> ThreadpoolController:
    """Libraries that are loaded; looking for them takes longer than a small factorisation."""
    return ThreadpoolController()
