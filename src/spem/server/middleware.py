"""Around every request: headers, names and sites, rates, sizes, figures, logs, and errors nobody foresaw."""

from __future__ import annotations

import asyncio
import contextlib
import secrets
import time
from typing import Any

from starlette.requests import ClientDisconnect
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from spem.server.limits import COSTLY, client_of, counted, too_large
from spem.server.logs import fail, tell
from spem.server.refusals import Refusal, error_response, refused
from spem.server.security import HEADERS, host_allowed, require_own_site
from spem.server.services import Services

# Room for the fields of a form and its borders beside the file.
FORM_BYTES = 64 << 10
_UNKNOWN = "unknown"
# These stay quick under load, and are asked by machines that must not be turned away.
_UNLIMITED = ("/health", "/ready", "/metrics")
_LONGEST_ADDRESS = 8192
_CLOSED, _REFUSED = 499, 400
_SWALLOW_SECONDS = 20.0


class Doorkeeper:
    """Lets requests in, and writes down how each was answered.

    Parameters
    ----------
    app
        The app behind it.
    services
        What the server is made of.
    names
        Names that ``Host`` may have.
    """

    def __init__(self, app: ASGIApp, services: Services, names: frozenset[str]) -> None:
        self._app, self._services, self._names = app, services, names

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer a request."""
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return
        reply = _Reply(scope, receive, send)
        client = client_of(scope, self._services.options.proxies)
        method = scope["method"]
        self._services.metrics.begin()
        try:
            await self._answer(scope, receive, reply, client)
        except Refusal as refusal:
            await _finish(refused(refusal), scope, receive, reply)
        except ClientDisconnect:
            reply.status = _CLOSED
        except Exception as error:  # noqa: BLE001
            fail("unexpected error", error, request=reply.id)
            message = f"the server failed on this request; its log has it under {reply.id}"
            await _finish(error_response(500, message), scope, receive, reply)
        finally:
            self._services.metrics.end()
            self._write_down(scope, reply, client, method)

    async def _answer(self, scope: Scope, receive: Receive, reply: _Reply, client: str) -> None:
        """Check a request and hand it on."""
        headers: dict[bytes, bytes] = dict(scope["headers"])
        if not host_allowed(headers.get(b"host", b""), self._names):
            raise Refusal(421, "this server does not answer to that name; --allow-host adds one")
        if len(scope["raw_path"] or b"") + len(scope["query_string"]) > _LONGEST_ADDRESS:
            raise Refusal(414, "the address is too long")
        require_own_site(scope["method"], headers)
        if scope["path"] not in _UNLIMITED:
            cost = COSTLY if scope["method"] in ("POST", "DELETE") else 1.0
            self._services.rate.require(client, cost)
        limit = self._services.options.upload_bytes + FORM_BYTES
        length = headers.get(b"content-length", b"0")
        if not length.isdigit() or int(length) > limit:
            raise too_large(limit)
        if scope["method"] == "HEAD":
            scope["method"] = "GET"
        await self._app(scope, counted(reply.receive, limit), reply)

    def _write_down(self, scope: Scope, reply: _Reply, client: str, method: str) -> None:
        """Count a request and write its line."""
        seconds = time.perf_counter() - reply.begun
        route = getattr(scope.get("route"), "path", _UNKNOWN)
        method = method if method in ("GET", "HEAD", "POST", "DELETE", "OPTIONS") else "OTHER"
        self._services.metrics.request(method, route, reply.status, seconds)
        tell(
            "request",
            request=reply.id,
            client=client,
            method=method,
            route=route,
            status=reply.status,
            ms=round(1000 * seconds, 2),
            bytes=reply.n_bytes,
        )


class _Reply:
    """A `send` that adds the headers of every answer, and knows what was sent."""

    def __init__(self, scope: Scope, receive: Receive, send: Send) -> None:
        self._send, self._receive, self._head = send, receive, scope["method"] == "HEAD"
        names = {name for name, _ in scope["headers"]}
        self._body_left = bool(names & {b"content-length", b"transfer-encoding"})
        self.begun = time.perf_counter()
        self.id = secrets.token_hex(6)
        self.status, self.n_bytes, self.started = 0, 0, False

    async def __call__(self, message: Message) -> None:
        """Send a message on."""
        if message["type"] == "http.response.start":
            self.started, self.status = True, message["status"]
            headers: list[Any] = list(message.get("headers", ()))
            known = {name for name, _ in headers}
            headers += [pair for pair in HEADERS if pair[0] not in known]
            message["headers"] = [*headers, (b"x-request-id", self.id.encode())]
        elif message["type"] == "http.response.body":
            self.n_bytes += len(message.get("body", b""))
            if self._head:
                message["body"] = b""
            if self.status >= _REFUSED and self._body_left and not message.get("more_body"):
                await self._send({**message, "more_body": True})
                await self._swallow()
                message = {"type": message["type"], "body": b""}
        await self._send(message)

    async def receive(self) -> Message:
        """Receive a message, and notice the end of the body."""
        message = await self._receive()
        self._body_left = self._body_left and bool(message.get("more_body"))
        return message

    async def _swallow(self) -> None:
        """Read what a client still sends, for a while: it reads the answer only when it has sent all."""
        with contextlib.suppress(TimeoutError):
            async with asyncio.timeout(_SWALLOW_SECONDS):
                while self._body_left:
                    await self.receive()


async def _finish(response: Any, scope: Scope, receive: Receive, reply: _Reply) -> None:
    """Send an error, unless an answer has begun."""
    if not reply.started:
        await response(scope, receive, reply)
