"""The documentation says what is so: its code runs, its links lead somewhere, every public name is in it."""

from __future__ import annotations

import doctest
import importlib.util
import json
import os
import re
import shlex
import shutil
import subprocess
import sys
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urlsplit

import pytest

import spem
from spem.cli.app import app

DOCS = Path(__file__).parents[1] / "docs"
PAGES = [DOCS / "start.md", *sorted((DOCS / "guide").glob("*.md"))]
OPTIONS = doctest.NORMALIZE_WHITESPACE | doctest.ELLIPSIS
BLOCK = re.compile(r"^```(python|console)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
# Public modules are documented where they are.
HOMES = {name: f"spem.shapes.{name}" for name in ("creatures", "synthetic")}
# What a browser fetches by itself; a link waits for the reader.
FETCHED = {"script": "src", "img": "src", "link": "href", "iframe": "src", "source": "src"}


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


class _Page(HTMLParser):
    """What a page has and what it leads to."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.ids: set[str] = set()
        self.links: list[str] = []
        self.fetched: list[str] = []
        self.feed(text)

    def handle_starttag(self, tag, attrs):
        """Collect identifiers, links and what is fetched."""
        found = dict(attrs)
        self.ids.update(filter(None, (found.get("id"), found.get("name"))))
        if tag == "a" and found.get("href"):
            self.links.append(found["href"])
        if found.get(FETCHED.get(tag, "")):
            self.fetched.append(found[FETCHED[tag]])


def test_site_is_whole(tmp_path):
    """It is built without a warning; links lead somewhere, nothing comes from elsewhere, search works.

    The scripts of the paper are not run: they have tests of their own.
    """
    for module in ("furo", "myst_parser", "sphinx", "sphinx_copybutton", "sphinx_design"):
        pytest.importorskip(module)
    site = tmp_path / "site"
    options = ["-n", "-W", "--keep-going", "-q", "-D", "paper_runs=none", "-d", str(tmp_path / "trees")]
    command = [sys.executable, "-m", "sphinx", *options, str(DOCS), str(site)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    pages = {path: _Page(path.read_text(encoding="utf-8")) for path in sorted(site.rglob("*.html"))}
    assert not [wrong for path in pages for wrong in _broken(path, pages)]
    documented = {found for path, page in pages.items() if path.parent.name == "api" for found in page.ids}
    wanted = {f"module-{HOMES[name]}" if name in HOMES else f"spem.{name}" for name in spem.__all__}
    assert not wanted - documented
    _search(site)


def _broken(path, pages):
    """Say which links and files of a page lead nowhere."""
    for target in pages[path].fetched + pages[path].links:
        parts = urlsplit(target)
        if parts.scheme in ("data", "mailto"):
            continue
        if parts.scheme or parts.netloc:
            if target in pages[path].fetched or not (parts.scheme == "https" and "." in parts.netloc):
                yield f"{path.name}: {target}"
            continue
        other = (path.parent / unquote(parts.path)).resolve() if parts.path else path
        if not other.is_file():
            yield f"{path.name}: {target}, no such file"
        elif parts.fragment and other in pages and unquote(parts.fragment) not in pages[other].ids:
            yield f"{path.name}: {target}, no such place"


def _search(site):
    """Ask the search page for a word, in a browser where there is one."""
    browser = shutil.which("chromium") or shutil.which("google-chrome")
    if browser is None:
        assert "vocabulari" in (site / "searchindex.js").read_text(encoding="utf-8")
        return
    flags = ["--headless", "--disable-gpu", "--dump-dom", "--virtual-time-budget=20000"]
    if hasattr(os, "geteuid") and os.geteuid() == 0:
        flags.append("--no-sandbox")
    address = (site / "search.html").as_uri() + "?q=vocabulary"
    found = subprocess.run([browser, *flags, address], capture_output=True, text=True, check=False).stdout
    assert re.search(r'<a [^>]*href="(?:\./)?guide/search\.html', found)


@pytest.fixture
def record():
    """Return the script that keeps what a run on real shapes found."""
    spec = importlib.util.spec_from_file_location("record", DOCS / "record.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def _finding(folder, **made):
    """Write what a run of the first item may have left."""
    origin = {"spem": "1", "script": "a", "quick": False, "data": ["tari1000"], "seconds": 1.0} | made
    claim = {"statement": "It grows.", "paper": "grows", "ours": "grows", "verdict": "holds", "note": ""}
    numbers = {"share": 0.123456789, "values": [[0.5] * 40] * 40}
    kept = {"shapes": "Hands.", "claims": [claim], "tables": [], "numbers": numbers}
    found = kept | {"made": origin, "pictures": ["x.png"]}
    (folder / "fig1").mkdir(parents=True)
    (folder / "fig1" / "finding.json").write_text(json.dumps(found), encoding="utf-8")


def test_record_keeps_claims_and_numbers_alone(tmp_path, record):
    """Neither pictures nor what is too long to read is kept, and numbers have few digits."""
    _finding(tmp_path / "out")
    record.main(tmp_path / "out", tmp_path / "results")
    [path] = (tmp_path / "results").iterdir()
    kept = json.loads(path.read_text(encoding="utf-8"))
    assert set(kept) == {"shapes", "claims", "tables", "numbers", "made"}
    assert kept["numbers"] == {"share": 0.12346}
    assert kept["claims"][0]["verdict"] == "holds"


@pytest.mark.parametrize("made", [{"quick": True}, {"data": None}], ids=["reduced size", "no real shapes"])
def test_record_leaves_out_what_is_not_of_real_shapes(made, tmp_path, record, capsys):
    """A run in the reduced size or without real shapes leaves no record, and is told."""
    _finding(tmp_path / "out", **made)
    record.main(tmp_path / "out", tmp_path / "results")
    assert not list((tmp_path / "results").iterdir())
    assert "fig1: left out" in capsys.readouterr().out
