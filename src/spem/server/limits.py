"""Limits by client and by request: a token bucket for each address, and bodies counted while they come."""

from __future__ import annotations

import ipaddress
import time
from collections import OrderedDict
from collections.abc import Callable, Sequence

from starlette.types import Message, Receive, Scope

from spem.server.refusals import Busy, Refusal

_BURST_SECONDS = 4.0
_CLIENTS = 10_000
_IPV6_NETWORK = 64
# What a request that makes work costs, in plain reads.
COSTLY = 10.0


class Rate:
    """How often each client may ask: a token bucket by address.

    Parameters
    ----------
    rate
        Requests a second in the long run; 0 for any number.
    clock
        Seconds that only grow.

    Examples
    --------
    >>> rate = Rate(1.0, clock=lambda: 0.0)
    >>> [rate.wait("::1") for _ in range(5)]
    [0.0, 0.0, 0.0, 0.0, 1.0]
    """

    def __init__(self, rate: float, clock: Callable[[], float] = time.monotonic) -> None:
        self._rate, self._clock = rate, clock
        self._burst = max(_BURST_SECONDS * rate, 1.0)
        self._buckets: OrderedDict[str, tuple[float, float]] = OrderedDict()

    def wait(self, client: str, cost: float = 1.0) -> float:
        """Take a request's worth; return how many seconds it comes too early, 0 where it may pass."""
        if not self._rate:
            return 0.0
        now = self._clock()
        left, seen = self._buckets.pop(client, (self._burst, now))
        left = min(self._burst, left + (now - seen) * self._rate)
        cost = min(cost, self._burst)
        allowed = left >= cost
        self._buckets[client] = (left - cost if allowed else left, now)
        if len(self._buckets) > _CLIENTS:
            self._buckets.popitem(last=False)
        return 0.0 if allowed else (cost - left) / self._rate

    def require(self, client: str, cost: float = 1.0) -> None:
        """Raise `Busy` when a client asks too often."""
        seconds = self.wait(client, cost)
        if seconds > 0:
            msg = "too many requests; come again later"
            raise Busy(msg, seconds)


def client_of(scope: Scope, proxies: Sequence[str]) -> str:
    """Return the address of a client; ``X-Forwarded-For`` is believed of the proxies that are named only.

    Of an address of IPv6 the network counts, since one client has all of it.
    """
    address = (scope.get("client") or ("unknown", 0))[0]
    if address in proxies:
        # a proxy may add a line of its own after those of the client: all of them count, as one
        told = b",".join(value for name, value in scope["headers"] if name == b"x-forwarded-for")
        steps = [step.strip() for step in told.decode("latin-1").split(",") if step.strip()]
        address = next((step for step in reversed(steps) if step not in proxies), address)
    if ":" not in address:
        return str(address)[:64]
    try:
        return str(ipaddress.ip_network((address, _IPV6_NETWORK), strict=False))
    except ValueError:
        return str(address)[:64]


def counted(receive: Receive, limit: int) -> Receive:
    """Return a `receive` that refuses the rest of a body over a limit, in bytes."""
    taken = 0

    async def receive_some() -> Message:
        nonlocal taken
        message = await receive()
        taken += len(message.get("body", b""))
        if taken > limit:
            raise too_large(limit)
        return message

    return receive_some


def too_large(limit: int) -> Refusal:
    """Return the refusal of a body over the limit."""
    return Refusal(413, f"the body is over the limit of {limit} bytes", {"Connection": "close"})
