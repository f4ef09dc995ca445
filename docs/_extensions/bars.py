"""Bars in the words of docstrings are absolute values, and name no substitution."""

from __future__ import annotations

import re
from typing import Any

from sphinx.application import Sphinx


def setup(app: Sphinx) -> dict[str, Any]:
    """Escape them in every docstring that is shown."""
    app.connect("autodoc-process-docstring", _process)
    return {"parallel_read_safe": True, "parallel_write_safe": True}


def escape_bars(text: str) -> str:
    r"""Return a line, or lines, of words with bars escaped, but for those in code.

    Examples
    --------
    >>> escape_bars("div(∇v/|∇v|), as ``a | b``")
    'div(∇v/\\|∇v\\|), as ``a | b``'
    """
    parts = re.split(r"(`[^`]*`)", text)
    return "".join(part if part.startswith("`") else part.replace("|", r"\|") for part in parts)


def _process(app: Sphinx, kind: str, name: str, thing: Any, options: Any, lines: list[str]) -> None:
    """Escape bars outside of examples, which are indented no further than words."""
    example = False
    for number, line in enumerate(lines):
        example = line.lstrip().startswith(">>>") or (example and bool(line.strip()))
        if not example:
            lines[number] = escape_bars(line)
