"""Refused requests, and the one line of JSON that tells of any error."""

from __future__ import annotations

import json
import re
from collections.abc import Mapping

from starlette.responses import Response

# What a message says of folders is the host's business: of a path only the last name is told.
_FOLDERS = re.compile(r"(?<![\w:/.])(?:[A-Za-z]:[\\/]|\.{0,2}/)(?:[^\s:;,'\"()/\\]+[/\\])*(?=[^\s/\\])")
_LONGEST = 600


class Refusal(Exception):  # noqa: N818
    """A request that is not answered.

    Parameters
    ----------
    status
        Status of HTTP, 400 or above.
    message
        One line: what is wrong, what to do.
    headers
        Further headers of the answer.
    """

    def __init__(self, status: int, message: str, headers: Mapping[str, str] | None = None) -> None:
        super().__init__(message)
        self.status = status
        self.headers = dict(headers or {})


class Busy(Refusal):
    """Too much asked at once.

    Parameters
    ----------
    message
        One line.
    seconds
        When to come again.
    """

    def __init__(self, message: str, seconds: float = 1.0) -> None:
        super().__init__(429, message, {"Retry-After": str(max(1, round(seconds)))})


def plain(message: str) -> str:
    r"""Return a message on one line, without the folders of the host.

    Examples
    --------
    >>> plain("/srv/shapes/tmp1/cat.obj: no faces;\n give a mesh")
    'cat.obj: no faces; give a mesh'
    """
    return _FOLDERS.sub("", " ".join(message.split()))[:_LONGEST]


def refused(refusal: Refusal) -> Response:
    """Return the answer to a refused request."""
    return error_response(refusal.status, str(refusal), refusal.headers)


def error_response(status: int, message: str, headers: Mapping[str, str] | None = None) -> Response:
    """Return an error as JSON."""
    body = json.dumps({"error": plain(message)}, ensure_ascii=False).encode()
    return Response(body, status, {"Cache-Control": "no-store", **(headers or {})}, "application/json")
