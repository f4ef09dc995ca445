"""Forms that come slowly: how many at a time, of all clients and of one."""

from __future__ import annotations

import asyncio

import pytest

pytest.importorskip("fastapi")

from fastapi import Request

from spem.server.forms import Forms
from spem.server.refusals import Busy


async def _never():
    """Wait for a body that does not come."""
    await asyncio.Event().wait()


def _request(address):
    """Return a request whose body does not come."""
    headers = [(b"content-type", b"multipart/form-data; boundary=x")]
    scope = {"type": "http", "method": "POST", "headers": headers, "client": (address, 1)}
    return Request(scope, _never)


async def _refused(forms, address):
    """Tell whether one more form is refused."""
    try:
        await asyncio.wait_for(forms.receive(_request(address)), 0.02)
    except Busy:
        return True
    except TimeoutError:
        return False


def test_one_client_leaves_room_for_others():
    """A client that sends slowly has half of the places; all are taken by two, and are free after them."""

    async def run():
        forms = Forms()
        slow = [asyncio.ensure_future(forms.receive(_request("10.0.0.1"))) for _ in range(4)]
        await asyncio.sleep(0)
        alone = [await _refused(forms, address) for address in ("10.0.0.1", "10.0.0.2")]
        slow += [asyncio.ensure_future(forms.receive(_request("10.0.0.2"))) for _ in range(4)]
        await asyncio.sleep(0)
        full = await _refused(forms, "10.0.0.3")
        for one in slow:
            one.cancel()
        await asyncio.gather(*slow, return_exceptions=True)
        return alone, full, await _refused(forms, "10.0.0.1"), len(forms._inside)

    assert asyncio.run(run()) == ([True, False], True, False, 0)
