"""What may be asked of the index over HTTP: structured filters, turned into its SQL in one place."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

from spem.index.filters import literal
from spem.server.refusals import Refusal

Sort = Literal["name", "added", "volume"]
LONGEST_TEXT = 200
_KEY = re.compile(r"[\w .\-]{1,64}")
_ID = re.compile(r"[0-9a-f]{20}(-[\w.\-]{1,80})?")
_MODEL = re.compile(r"[0-9a-f]{1,64}")


@dataclass(frozen=True)
class Filters:
    """What shapes are asked for; all of it has to hold.

    Parameters
    ----------
    text
        Part of the name, in either case.
    label
        The label; None for any.
    ndim
        The dimension; None for any.
    metadata
        Keys and values that the metadata has.
    """

    text: str = ""
    label: str | None = None
    ndim: int | None = None
    metadata: tuple[tuple[str, str], ...] = ()

    def where(self) -> str | None:
        """Return the filter in the SQL of the database, or None where nothing is asked.

        Examples
        --------
        >>> Filters("o'x", label="cat").where()
        "contains(lower(name), 'o''x') AND label = 'cat'"
        """
        terms = []
        if self.text:
            terms.append(f"contains(lower(name), {quoted(self.text.lower())})")
        if self.label is not None:
            terms.append(f"label = {quoted(self.label)}")
        if self.ndim is not None:
            terms.append(f"ndim = {int(self.ndim)}")
        terms += [
            f"map_extract(metadata, {quoted(key)})[1] = {quoted(value)}" for key, value in self.metadata
        ]
        return " AND ".join(terms) or None


def quoted(text: str) -> str:
    """Return a text as a literal of SQL.

    Examples
    --------
    >>> quoted("it's")
    "'it''s'"
    """
    if any(ord(letter) < ord(" ") for letter in text):
        raise Refusal(422, "a text with control characters; leave them out")
    return literal(text)


def parse_metadata(pairs: Sequence[str]) -> tuple[tuple[str, str], ...]:
    """Return the keys and values of ``KEY:VALUE``.

    Raises
    ------
    Refusal
        When one is no such pair.

    Examples
    --------
    >>> parse_metadata(["sex:f"])
    (('sex', 'f'),)
    """
    parsed = []
    for pair in pairs:
        key, colon, value = pair.partition(":")
        if not colon or not _KEY.fullmatch(key):
            raise Refusal(
                422, "metadata: expected KEY:VALUE, the key of letters, digits, space, dot and dash"
            )
        parsed.append((key, value))
    return tuple(parsed)


def is_id(text: str) -> bool:
    """Tell whether a text can be the id of a row.

    Examples
    --------
    >>> is_id("0123456789abcdef0123-3"), is_id("../x")
    (True, False)
    """
    return _ID.fullmatch(text) is not None


def is_digest(text: str) -> bool:
    """Tell whether a text can be the digest of a model.

    Examples
    --------
    >>> is_digest("cb918a334784")
    True
    """
    return _MODEL.fullmatch(text) is not None
