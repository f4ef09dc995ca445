"""The pages of the documentation say what is so: their code runs, and every public name has its place."""

from __future__ import annotations

import doctest
import re
import shlex
from pathlib import Path

import pytest

import spem
from spem.cli.app import app

DOCS = Path(__file__).parents[1] / "docs"
PAGES = [DOCS / "start.md", *sorted((DOCS / "guide").glob("*.md"))]
OPTIONS = doctest.NORMALIZE_WHITESPACE | doctest.ELLIPSIS
BLOCK = re.compile(r"^```(python|console)\n(.*?)^```$", re.MULTILINE | re.DOTALL)


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_code_of_the_page_runs(page, tmp_path, monkeypatch, capsys):
    """A reader who runs every block in turn, in an empty folder, sees what the page shows."""
    monkeypatch.chdir(tmp_path)
    names: dict[str, object] = {}
    for number, (language, code) in enumerate(BLOCK.findall(page.read_text(encoding="utf-8"))):
        if language == "python":
            _run_python(f"{page.name}[{number}]", code, names, capsys)
        else:
            _run_shell(code, capsys)


def _run_python(name, code, names, capsys):
    """Run a block of examples; names go on to the next."""
    test = doctest.DocTestParser().get_doctest(code, names, name, name, 0)
    assert test.examples, f"{name} has no example"
    said: list[str] = []
    runner = doctest.DocTestRunner(optionflags=OPTIONS, verbose=False)
    with capsys.disabled():
        failed = runner.run(test, out=said.append, clear_globs=False).failed
    names.update(test.globs)
    assert not failed, "".join(said)


def _run_shell(code, capsys):
    """Run the lines of a block that call spem."""
    for line in code.splitlines():
        if line.startswith("$ spem "):
            words = [
                found
                for word in shlex.split(line.removeprefix("$ spem "))
                for found in (sorted(map(str, Path().glob(word))) if re.search(r"[*\[]", word) else [word])
            ]
            with pytest.raises(SystemExit) as stop:
                app(words)
            assert stop.value.code == 0, f"{line}\n{capsys.readouterr().err}"
