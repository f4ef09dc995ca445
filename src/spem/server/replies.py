"""Responses that routes give, and what OpenAPI says of them."""

from __future__ import annotations

import hashlib
from typing import Any

from fastapi import Request
from pydantic import BaseModel
from starlette.responses import Response

from spem.server.arrays import MEDIA_TYPE
from spem.server.cards import to_json
from spem.server.schemas import Problem

_MEANINGS = {
    400: "The request cannot be read.",
    401: "The token is missing or wrong.",
    403: "Not allowed.",
    404: "There is none.",
    413: "The body is too large.",
    415: "No file of a kind that is read.",
    422: "A value is out of its range.",
    429: "Too many requests, or too long a queue; see Retry-After.",
    503: "Not ready yet.",
}
Documented = dict[int | str, dict[str, Any]]


def json_reply(values: Any, status: int = 200) -> Response:
    """Return plain values, or JSON that is written already, as JSON that is not kept."""
    body = values if isinstance(values, bytes) else to_json(values)
    return Response(body, status, {"Cache-Control": "no-store"}, "application/json")


def kept_reply(request: Request, body: bytes, media_type: str, tag: str, seconds: int = 3600) -> Response:
    """Return a body that a browser may keep; of one that it has already only the tag.

    Parameters
    ----------
    request
        The request, which may name a tag.
    body, media_type
        What is sent.
    tag
        Tells this body from others of the same address.
    seconds
        How long it holds without asking again.
    """
    quoted = f'"{tag}"'
    headers = {"ETag": quoted, "Cache-Control": f"private, max-age={seconds}"}
    if quoted in request.headers.get("if-none-match", ""):
        return Response(status_code=304, headers=headers)
    return Response(body, 200, headers, media_type)


def tag_of(*parts: object) -> str:
    """Return a tag of what decides on a body.

    Examples
    --------
    >>> len(tag_of("geometry", 3))
    20
    """
    return hashlib.sha256("\0".join(map(str, parts)).encode()).hexdigest()[:20]


def documented(model: type[BaseModel], *errors: int, status: int = 200) -> Documented:
    """Return what OpenAPI says of a route that answers in JSON."""
    return {status: {"model": model}} | _problems(errors)


def documented_as(media_type: str, text: str, *errors: int) -> Documented:
    """Return what OpenAPI says of a route that answers in another type."""
    schema = {"type": "string", "format": "binary"}
    return {200: {"content": {media_type: {"schema": schema}}, "description": text}} | _problems(errors)


def documented_arrays(text: str, *errors: int) -> Documented:
    """Return what OpenAPI says of a route that answers in arrays."""
    return documented_as(MEDIA_TYPE, text, *errors)


def _problems(errors: tuple[int, ...]) -> Documented:
    """Return what OpenAPI says of errors."""
    return {status: {"model": Problem, "description": _MEANINGS[status]} for status in (*errors, 429)}
