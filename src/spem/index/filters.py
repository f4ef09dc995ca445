"""Filters of rows: SQL over the columns, with a short way to say metadata."""

from __future__ import annotations

import re

from spem.errors import ParameterError, require_kind

# Quoted text is passed over; outside of it metadata.key, metadata.'any key' and metadata."any key" are meant.
_TOKENS = re.compile(
    r"""(?P<metadata>\bmetadata\s*\.\s*(?:(?P<key>[A-Za-z_]\w*)|'(?P<single>(?:[^']|'')*)'|"(?P<double>[^"]*)"))"""
    r"""|'(?:[^']|'')*'|"[^"]*"|`[^`]*`""",
    re.IGNORECASE,
)


def literal(text: str) -> str:
    """Return text as SQL has it, quotes doubled.

    Examples
    --------
    >>> print(literal("cat's"))
    'cat''s'
    """
    if "\0" in text:
        msg = f"{text!r}: text of a filter holds a null character; leave it out"
        raise ParameterError(msg)
    return "'" + as_text(text).replace("'", "''") + "'"


def as_text(text: str) -> str:
    r"""Return text that can be stored: bytes of a file's name that are no UTF-8 as escapes.

    Examples
    --------
    >>> print(as_text("caf\udce9.png"))
    caf\udce9.png
    """
    return text if text.isascii() else text.encode("utf-8", "backslashreplace").decode()


def any_of(column: str, values: list[str] | tuple[str, ...]) -> str:
    """Return the filter of rows whose column has one of these values.

    Examples
    --------
    >>> any_of("label", ["cat", "dog"])
    "label IN ('cat', 'dog')"
    """
    return f"{column} IN ({', '.join(map(literal, values))})" if values else "false"


def to_sql(where: str) -> str:
    """Return a filter in the SQL of the database, where ``metadata.KEY`` is the value of a key.

    Parameters
    ----------
    where
        SQL over the columns of `spem.index.schema.LIGHT`; ``metadata.KEY``, or ``metadata.'any key'``, stands
        for the value of that key, NULL where a row has none.

    Raises
    ------
    ParameterError
        When it is empty.

    Examples
    --------
    >>> to_sql("metadata.site = 'metadata.site' AND volume > 2")
    "map_extract(metadata, 'site')[1] = 'metadata.site' AND volume > 2"
    """
    require_kind(where, str, "a filter is SQL, such as label = 'cat'")
    if not where.strip():
        msg = "where='': no filter of rows; leave it out, or write SQL such as label = 'cat'"
        raise ParameterError(msg)

    def replaced(found: re.Match[str]) -> str:
        """Rewrite a key, and leave quoted text as it is."""
        if found["metadata"] is None:
            return found[0]
        single = found["single"]
        key = single.replace("''", "'") if single is not None else found["key"] or found["double"] or ""
        return f"map_extract(metadata, {literal(key)})[1]"

    return _TOKENS.sub(replaced, where)
