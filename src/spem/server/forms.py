"""Forms with a file, read while they come, within limits of size, parts and time."""

from __future__ import annotations

import asyncio
import json
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace

from fastapi import Request
from python_multipart.multipart import parse_options_header
from starlette.datastructures import UploadFile

from spem.errors import ReadError
from spem.server.limits import client_of
from spem.server.queries import LONGEST_TEXT
from spem.server.refusals import Busy, Refusal
from spem.server.uploads import safe_name, upload_suffix

# Forms being received at a time, of all clients and of one; each may hold an upload in memory.
_AT_A_TIME, _OF_ONE = 8, 4
_FIELDS = 8
_FIELD_BYTES = 16 << 10
_SECONDS = 300.0
_MOST_METADATA = 64
_CHARSETS = (b"utf-8", b"utf8", b"us-ascii")


@dataclass(frozen=True)
class Form:
    """A form that was received.

    Parameters
    ----------
    name
        Name of the file, fit to be shown.
    payload
        Its bytes.
    fields
        What else the form has.
    client
        Who sent it.
    """

    name: str
    payload: bytes
    fields: dict[str, str]
    client: str = ""

    def whole(self, name: str, default: int, least: int, most: int) -> int:
        """Return a field that is a whole number.

        Raises
        ------
        Refusal
            When it is none, or out of its range.
        """
        text = self.fields.get(name, "") or str(default)
        if not (text.isascii() and text.isdigit() and len(text) <= len(str(most))):
            raise Refusal(422, f"{name}: expected a whole number from {least} to {most}")
        value = int(text)
        if not least <= value <= most:
            raise Refusal(422, f"{name}={value}: expected a whole number from {least} to {most}")
        return value

    def text(self, name: str) -> str:
        """Return a field of one short line.

        Raises
        ------
        Refusal
            When it is longer, or has control characters.
        """
        text = self.fields.get(name, "")
        if len(text) > LONGEST_TEXT or not text.isprintable():
            raise Refusal(422, f"{name}: expected one line of at most {LONGEST_TEXT} characters")
        return text

    def metadata(self) -> dict[str, str]:
        """Return the field ``metadata``: a JSON object of numbers and texts of one line.

        Raises
        ------
        Refusal
            When it is something else.
        """
        expected = f"metadata: expected a JSON object of at most {_MOST_METADATA} texts or numbers"
        try:
            values = json.loads(self.fields.get("metadata", "") or "{}")
        except (ValueError, RecursionError) as error:
            raise Refusal(422, expected) from error
        plain = isinstance(values, dict) and all(
            isinstance(value, str | int | float) for value in values.values()
        )
        if not plain or len(values) > _MOST_METADATA:
            raise Refusal(422, expected)
        told = {key: str(value) for key, value in values.items()}
        if not all(key and (key + value).isprintable() for key, value in told.items()):
            raise Refusal(422, "metadata: a key is empty, or a text has control characters; leave them out")
        return told


class Forms:
    """Receives forms, a few at a time, and of one client not all of these.

    Parameters
    ----------
    proxies
        Addresses that are believed about whom they speak for.
    """

    def __init__(self, proxies: Sequence[str] = ()) -> None:
        self._proxies = proxies
        self._inside: Counter[str] = Counter()

    async def receive(self, request: Request) -> Form:
        """Return the form of a request.

        Raises
        ------
        Refusal
            When it is no form with one file of a known kind, comes too slowly, or too many come at once.
        """
        client = client_of(request.scope, self._proxies)
        if self._inside.total() >= _AT_A_TIME or self._inside[client] >= _OF_ONE:
            msg = "too many uploads at once; come again in a moment"
            raise Busy(msg, 2.0)
        self._inside[client] += 1
        try:
            async with asyncio.timeout(_SECONDS):
                return replace(await _received(request), client=client)
        except TimeoutError as error:
            msg = f"the body did not come within {_SECONDS:g} s"
            raise Refusal(408, msg, {"Connection": "close"}) from error
        finally:
            self._inside[client] -= 1
            # clients that send nothing any more are not remembered
            self._inside = +self._inside


async def _received(request: Request) -> Form:
    """Read a form."""
    if not request.headers.get("content-type", "").startswith("multipart/form-data"):
        raise Refusal(415, "expected a form (multipart/form-data) with a part named file")
    charset = parse_options_header(request.headers["content-type"])[1].get(b"charset", b"utf-8")
    if charset.lower() not in _CHARSETS:
        # any codec of Python would be taken by its name
        raise Refusal(415, "expected a form in UTF-8; leave its charset out")
    async with request.form(max_files=1, max_fields=_FIELDS, max_part_size=_FIELD_BYTES) as form:
        file = form.get("file")
        if not isinstance(file, UploadFile) or not file.filename:
            raise Refusal(422, "file: expected a file with its name")
        try:
            upload_suffix(file.filename)
        except ReadError as error:
            raise Refusal(415, str(error)) from error
        payload = await file.read()
        fields = {key: value for key, value in form.items() if isinstance(value, str)}
    if not payload:
        raise Refusal(422, "file: it is empty")
    return Form(safe_name(file.filename), payload, fields)
