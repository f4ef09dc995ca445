"""The page of the command line, written from the commands themselves."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import typer
from sphinx.application import Sphinx

from spem.cli.app import app as spem_app


def setup(app: Sphinx) -> dict[str, Any]:
    """Write the page before the pages are looked for."""
    app.connect("config-inited", lambda app, config: write(Path(app.srcdir) / "commands.md"))
    return {"parallel_read_safe": True, "parallel_write_safe": True}


def write(path: Path) -> None:
    """Write the page, unless it is there as it should be."""
    text = page()
    if not path.is_file() or path.read_text(encoding="utf-8") != text:
        path.write_text(text, encoding="utf-8")


def page() -> str:
    """Return the page: the whole, then a section a command."""
    group: Any = typer.main.get_command(spem_app)
    context = group.make_context("spem", [], resilient_parsing=True)
    parts = ["# Command line", _prose(group.help), *_sections(group, context, "spem", "##")]
    return "\n\n".join(part for part in parts if part) + "\n"


def _sections(group: Any, parent: Any, words: str, level: str) -> list[str]:
    """Return a section for each command of a group; those of a group in it are a level below."""
    parts = []
    for name, command in group.commands.items():
        called = f"{words} {name}"
        parts += [f"{level} {called}", _usage(command, parent, called), _prose(command.help)]
        if hasattr(command, "commands"):
            context = type(parent)(command, info_name=name, parent=parent)
            parts += _sections(command, context, called, level + "#")
        else:
            parts += _parameters(command, parent)
    return parts


def _usage(command: Any, parent: Any, called: str) -> str:
    """Return the line of usage as a block."""
    context = type(parent)(command, info_name=called, parent=parent)
    pieces = " ".join(command.collect_usage_pieces(context))
    return f"```text\n{called} {pieces}\n```"


def _prose(document: str) -> str:
    """Return a docstring as Markdown: blocks marked by a backspace are examples."""
    blocks = []
    for block in re.split(r"\n\s*\n", document.strip()):
        if block.startswith("\b"):
            title, *lines = block.removeprefix("\b\n").splitlines()
            blocks += [title, _examples([line.strip() for line in lines])]
        else:
            blocks.append(_plain(" ".join(block.split())))
    return "\n\n".join(blocks)


def _examples(lines: list[str]) -> str:
    """Return example commands as a block; as a list where remarks stand beside them."""
    pairs = [re.split(r"\s{2,}", line, maxsplit=1) for line in lines]
    if all(len(pair) == 1 for pair in pairs):
        return "```console\n" + "\n".join(f"$ {line}" for line in lines) + "\n```"
    return "\n".join(
        f"- `{command}`" + "".join(f": {_plain(r)}" for r in remark) for command, *remark in pairs
    )


def _parameters(command: Any, parent: Any) -> list[str]:
    """Return arguments and options, each as a term and what is said of it."""
    context = type(parent)(command, info_name=command.name, parent=parent)
    rows: dict[str, list[str]] = {"Arguments": [], "Options": []}
    for parameter in command.get_params(context):
        said = parameter.get_help_record(context)
        if said is not None:
            kind = "Arguments" if parameter.param_type_name == "argument" else "Options"
            rows[kind].append(f"`{said[0]}`\n: {_plain(' '.join(said[1].split()))}")
    return [f"**{title}**\n\n" + "\n\n".join(entries) for title, entries in rows.items() if entries]


def _plain(words: str) -> str:
    """Return words with what Markdown would read as markup escaped, but for code."""
    # A word that begins with two hyphens is an option, not a dash.
    marked = re.sub(r"(?<![\w`-])--[a-z][\w-]*", r"`\g<0>`", words)
    return "".join(
        part if part.startswith("`") else re.sub(r"([\\*_\[\]<>#$])", r"\\\1", part)
        for part in re.split(r"(`[^`]*`)", marked)
    )
