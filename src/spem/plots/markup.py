"""Pieces of HTML: escaped text, tables, pictures as data, whole pages."""

from __future__ import annotations

import re
from base64 import b64encode
from hashlib import sha256
from html import escape
from importlib.resources import files
from typing import TYPE_CHECKING

import numpy as np

from spem.errors import ParameterError
from spem.plots.style import image_png

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from numpy.typing import NDArray


def text(value: object) -> str:
    """Return anything as text that is safe inside an element or an attribute.

    Examples
    --------
    >>> text('<b> & "c"')
    '&lt;b&gt; &amp; &quot;c&quot;'
    """
    return escape(str(value), quote=True)


def natural(value: object) -> tuple[list[tuple[int, int, str]], str]:
    """Return a key that sorts numbers within words by their value.

    Examples
    --------
    >>> sorted(["11", "1", "20", "ant 10", "ant 9"], key=natural)
    ['1', '11', '20', 'ant 9', 'ant 10']
    """
    words = str(value)
    pieces = [(0, int(p), "") if p.isdecimal() else (1, 0, p) for p in re.split(r"(\d+)", words) if p]
    return pieces, words


def number(value: float) -> str:
    """Return a percentage with one decimal, or a dash where there is none.

    Examples
    --------
    >>> number(97.333), number(float("nan"))
    ('97.3', '–')
    """
    return f"{value:.1f}" if np.isfinite(value) else "–"


def data_uri(picture: bytes | NDArray[np.uint8]) -> str:
    """Return a PNG file, or an array of bytes made into one, as a URI that holds it.

    Raises
    ------
    ParameterError
        If the bytes are not a PNG file.

    Examples
    --------
    >>> data_uri(np.zeros((1, 1, 4), np.uint8))[:22]
    'data:image/png;base64,'
    """
    png = picture if isinstance(picture, bytes) else image_png(picture)
    if not png.startswith(b"\x89PNG"):
        msg = f"a picture in a report must be a PNG file, these bytes begin with {png[:4]!r}"
        raise ParameterError(msg)
    return "data:image/png;base64," + b64encode(png).decode("ascii")


def table(caption: str, head: Sequence[str], rows: Iterable[Sequence[str]], *, sortable: bool = False) -> str:
    """Return a table whose first column names the rows; all cells are HTML already.

    Parameters
    ----------
    caption
        What the table holds.
    head
        A title for each column.
    rows
        Cells, as many as there are titles.
    sortable
        Whether the titles are buttons that sort the rows.

    Examples
    --------
    >>> table("Scores", ["class", "NN"], [["ant", "100.0"]]).count("<th")
    4
    """
    if sortable:
        titles = "".join(f'<th scope="col"><button type="button">{title}</button></th>' for title in head)
    else:
        titles = "".join(f'<th scope="col">{title}</th>' for title in head)
    body = "".join(
        f'<tr><th scope="row">{first}</th>{"".join(f"<td>{cell}</td>" for cell in rest)}</tr>\n'
        for first, *rest in rows
    )
    kind = ' class="sortable"' if sortable else ""
    return (
        f'<div class="wide"><table{kind}><caption>{caption}</caption>\n'
        f"<thead><tr>{titles}</tr></thead>\n<tbody>\n{body}</tbody></table></div>"
    )


def section(title: str, *content: str) -> str:
    """Return a section with a heading, or nothing where there is no content.

    Examples
    --------
    >>> section("Settings")
    ''
    """
    inside = "\n".join(part for part in content if part)
    return f"<section>\n<h2>{title}</h2>\n{inside}\n</section>\n" if inside else ""


def page(title: str, summary: str, body: str, *, style: str, script: str) -> str:
    """Return a whole page; the browser is told to run no other script and to fetch nothing.

    Parameters
    ----------
    title
        Heading of the page, plain text.
    summary, body
        What stands below the heading and in the page, HTML already.
    style, script
        Files of this package to put into the page.

    Examples
    --------
    >>> page("A", "", "", style="report.css", script="report.js").count("<h1>A</h1>")
    1
    """
    own = files("spem.plots")
    rules = own.joinpath(style).read_text(encoding="utf-8")
    code = own.joinpath(script).read_text(encoding="utf-8")
    digest = b64encode(sha256(code.encode("utf-8")).digest()).decode("ascii")
    policy = f"default-src 'none'; img-src data:; style-src 'unsafe-inline'; script-src 'sha256-{digest}'"
    return (
        f'<!DOCTYPE html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        f'<meta http-equiv="Content-Security-Policy" content="{policy}">\n'
        f'<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        f'<meta name="color-scheme" content="light dark">\n<title>{text(title)}</title>\n'
        f"<style>\n{rules}</style>\n</head>\n<body>\n<header>\n<h1>{text(title)}</h1>\n"
        f"<p>{summary}</p>\n</header>\n"
        f"<main>\n{body}</main>\n<script>{code}</script>\n</body>\n</html>\n"
    )
