"""Bodies that are kept: bounded, computed once, and failures that are not kept."""

from __future__ import annotations

import asyncio

import pytest

pytest.importorskip("starlette")

from spem.server.cache import Cache
from spem.server.lanes import Lane
from spem.server.refusals import Busy, Refusal
from spem.server.remembered import Remembered


def test_the_least_recently_used_goes_first():
    """Beyond its bytes a cache lets go of what was not asked for longest."""
    cache = Cache(400)
    for key in "abcd":
        cache.put(key, bytes(100))
    cache.kept("a")
    cache.put("e", bytes(100))
    assert [cache.kept(key) is not None for key in "abcde"] == [True, False, True, True, True]
    assert cache.n_bytes == 400


def test_what_would_fill_it_is_not_kept():
    """A body of more than a quarter of the cache is handed on only."""
    cache = Cache(100)
    cache.put("a", bytes(26))
    assert cache.n_bytes == 0


def test_equal_questions_are_computed_once():
    """Those who ask while an answer is computed wait for it, also when the first has left."""
    calls = []

    async def compute() -> bytes:
        calls.append(1)
        await asyncio.sleep(0.02)
        return b"body"

    async def run() -> list[bytes]:
        cache = Cache(1000)
        first = asyncio.create_task(cache.get("a", compute))
        others = [asyncio.create_task(cache.get("a", compute)) for _ in range(4)]
        await asyncio.sleep(0)
        first.cancel()
        return await asyncio.gather(*others)

    assert asyncio.run(run()) == [b"body"] * 4
    assert len(calls) == 1


def test_failures_are_told_and_forgotten():
    """All who wait hear of a failure; the next one tries again."""

    async def fail() -> bytes:
        raise Refusal(422, "no")

    async def work() -> bytes:
        return b"yes"

    async def run() -> bytes:
        cache = Cache(1000)
        with pytest.raises(Refusal, match="no"):
            await cache.get("a", fail)
        return await cache.get("a", work)

    assert asyncio.run(run()) == b"yes"


def test_a_lane_refuses_what_waits_too_long():
    """Beyond its threads and its queue a lane says at once that it is busy, and recovers."""
    import threading

    async def run() -> int:
        lane, gate = Lane("test", 1, 1), threading.Event()
        waiting = [asyncio.create_task(lane.run(gate.wait)) for _ in range(2)]
        await asyncio.sleep(0)
        with pytest.raises(Busy, match="busy"):
            await lane.run(gate.wait)
        gate.set()
        await asyncio.gather(*waiting)
        await lane.run(int)
        lane.close()
        return lane.inside

    assert asyncio.run(run()) == 0


def test_values_hold_for_a_while():
    """A value is made again when it has grown old, and the eldest go when there are too many."""
    values = Remembered(2, 0.0)
    assert [values.get("a", lambda value=value: value) for value in (1, 2)] == [1, 2]
    values = Remembered(2, 60.0)
    for key in "abc":
        values.get(key, lambda: 1)
    assert values.get("a", lambda: 2) == 2
    values.clear()
    assert values.get("c", lambda: 3) == 3


def test_what_was_made_before_a_write_is_not_kept_after_it():
    """A value that was being made while all were forgotten is handed on, and made again when asked for."""
    values = Remembered(2, 60.0)

    def slow():
        values.clear()
        return "old"

    assert values.get("a", slow) == "old"
    assert values.get("a", lambda: "new") == "new"
