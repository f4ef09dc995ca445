"""Token buckets, clients behind proxies, and bodies that are counted."""

from __future__ import annotations

import asyncio

import pytest

pytest.importorskip("starlette")

from spem.server.limits import Rate, client_of, counted
from spem.server.refusals import Busy, Refusal


class Clock:
    """A clock that is set by hand."""

    def __init__(self) -> None:
        self.now = 0.0

    def __call__(self) -> float:
        """Return the time."""
        return self.now


def scope(address: str, *forwarded: str) -> dict:
    headers = [(b"x-forwarded-for", line.encode()) for line in forwarded]
    return {"client": (address, 1), "headers": headers}


def test_a_bucket_fills_at_its_rate():
    """After a burst a client may ask as often as the rate says, and no oftener."""
    clock = Clock()
    rate = Rate(10.0, clock)
    assert sum(rate.wait("a") == 0 for _ in range(100)) == 40
    allowed = 0
    for _ in range(1000):
        clock.now += 0.01
        allowed += rate.wait("a") == 0
    assert allowed == pytest.approx(100, abs=1)


def test_clients_have_buckets_of_their_own():
    """One that asks too often does not keep others out."""
    rate = Rate(1.0, Clock())
    assert [rate.wait("a") == 0 for _ in range(5)][-1] is False
    assert rate.wait("b") == 0


def test_costly_requests_empty_it_sooner():
    """What makes work counts for several; one of more than a burst still passes when the bucket is full."""
    rate = Rate(1.0, Clock())
    assert rate.wait("a", 10.0) == 0
    assert rate.wait("a", 1.0) == 1.0
    with pytest.raises(Busy, match="too many requests"):
        rate.require("a")


def test_clients_are_forgotten():
    """However many addresses ask, memory is bounded."""
    rate = Rate(1.0, Clock())
    for number in range(10_500):
        rate.wait(str(number))
    assert len(rate._buckets) == 10_000


def test_proxies_are_believed_only_when_named():
    """What a client says of its address counts only when a proxy that is known adds to it."""
    lied = scope("9.9.9.9", "1.1.1.1")
    assert client_of(lied, ()) == "9.9.9.9"
    assert client_of(lied, ("9.9.9.9",)) == "1.1.1.1"
    assert client_of(scope("9.9.9.9", "6.6.6.6, 1.1.1.1, 9.9.9.9"), ("9.9.9.9",)) == "1.1.1.1"


def test_a_network_of_ipv6_is_one_client():
    """Addresses of one network of IPv6 share a bucket."""
    assert client_of(scope("2001:db8::1"), ()) == client_of(scope("2001:db8::ffff"), ())
    assert client_of(scope("2001:db8:1::1"), ()) != client_of(scope("2001:db8:2::1"), ())


def test_bodies_are_counted():
    """A body is cut off in the message that takes it over the limit."""

    async def receive() -> dict:
        return {"type": "http.request", "body": b"x" * 10, "more_body": True}

    async def run() -> None:
        some = counted(receive, 25)
        await some()
        await some()
        with pytest.raises(Refusal, match="limit of 25 bytes"):
            await some()

    asyncio.run(run())


def test_a_line_that_a_proxy_adds_counts():
    """What a client claims in a line of its own does not hide the line that the proxy adds after it."""
    assert client_of(scope("10.0.0.1", "1.1.1.1", "9.9.9.9"), ("10.0.0.1",)) == "9.9.9.9"
