"""The gallery of the paper: each script of the examples is run, and what it finds becomes a page."""

from __future__ import annotations

import ast
import json
import re
from collections import Counter
from collections.abc import Iterable, Mapping
from concurrent.futures import ProcessPoolExecutor
from hashlib import sha256
from itertools import groupby
from pathlib import Path
from typing import Any

from bars import escape_bars
from PIL import Image
from sphinx.application import Sphinx
from sphinx.util import logging

from spem.paper.catalogue import ITEMS, Item, choose
from spem.paper.data import Data
from spem.paper.findings import Claim, Table
from spem.paper.runs import load, run

# Headings of the paper; an item may belong to several sections.
CHAPTERS = {
    "2.1": "A scale space of level curves",
    "2.2": "Fields over ρ",
    "2.3": "Sources of the boundary",
    "2.4": "The hyperfield",
    "3.1": "The random walk behind the equation",
    "3.2": "Geodesic distances",
    "3.3": "Heat and spectra",
    "4.1": "Parts by sparse coding",
    "4.2": "SPEM maps and correspondence",
    "5.1": "Computation",
    "5.2": "Parts of the boundary",
    "5.3": "Maps of silhouettes and solids",
    "5.4": "Classification by moments",
    "5.5": "Retrieval",
    "5.4, 5.5": "Classification",
}
BADGES = {"holds": "success", "differs": "warning", "not tested": "secondary"}
_PROCESSES = 2
_THUMBNAIL = (480, 300)
_log = logging.getLogger(__name__)


def setup(app: Sphinx) -> dict[str, Any]:
    """Write the pages before they are looked for; ``-D paper_runs=none`` runs no script."""
    app.add_config_value("paper_runs", "all", "env", (str,))
    app.connect("config-inited", lambda app, config: write_gallery(Path(app.srcdir), config.paper_runs))
    return {"parallel_read_safe": True, "parallel_write_safe": True}


def write_gallery(docs: Path, runs: str) -> None:
    """Run the scripts and write a page for each, and the page of all of them.

    Parameters
    ----------
    docs
        Folder of the sources of the site.
    runs
        ``"all"``; ``"kept"`` to use what an earlier build made of the same scripts; ``"none"``.
    """
    folder = docs / "paper"
    folder.mkdir(exist_ok=True)
    items = [item for item in ITEMS if _has_script(item)]
    if runs != "none":
        with ProcessPoolExecutor(_PROCESSES) as pool:
            failures = pool.map(
                _made, [item.name for item in items], [folder] * len(items), [runs] * len(items)
            )
            for item, failure in zip(items, failures, strict=True):
                if failure:
                    _log.warning("%s could not be made: %s", item.name, failure)
    pages = {item: _findings(item, docs, runs) for item in items}
    for item, findings in pages.items():
        _write(folder / f"{item.name}.rst", item_page(item, *findings))
    _write(folder / "index.rst", index_page(pages))


def _has_script(item: Item) -> bool:
    """Tell whether an item has its script; one that has not fails the build, which goes on."""
    there = item.script.is_file()
    if not there:
        _log.warning("%s: there is no examples/%s.py", item.name, item.name)
    return there


def _made(name: str, folder: Path, again: bool) -> str:
    """Run one script in its reduced size on shapes made here, and say why where it failed."""
    [record] = run(choose([name]), Data(quick=True), folder, again=again)
    if record.pictures and not record.failure:
        with Image.open(record.folder / record.pictures[0][0]) as picture:
            small = picture.convert("RGB")
            small.thumbnail(_THUMBNAIL)
            small.save(folder / f"{name}-small.png", optimize=True)
    return record.failure


def _findings(item: Item, docs: Path, runs: str) -> tuple[Mapping[str, Any], Mapping[str, Any]]:
    """Return what was found on shapes made here and on real ones; empty where there is nothing."""
    made: dict[str, Any] = {}
    record = load(item, docs / "paper") if runs != "none" else None
    if record is not None:
        made = {"shapes": record.shapes, "claims": record.claims, "pictures": record.pictures}
        made["tables"] = record.tables
    path = docs / "results" / f"{item.name}.json"
    if not path.is_file():
        return made, {}
    kept = json.loads(path.read_text(encoding="utf-8"))
    claims = tuple(Claim(**claim) for claim in kept["claims"])
    tables = tuple(Table(entry["caption"], entry["head"], entry["rows"]) for entry in kept.get("tables", ()))
    return made, kept | {"claims": claims, "tables": tables}


def item_page(item: Item, made: Mapping[str, Any], real: Mapping[str, Any]) -> str:
    """Return the page of one item."""
    title, words = item.words
    parts = [
        f".. _paper-{item.name}:\n\n{_heading(title, '=')}",
        f"*Section {item.place} of the paper.*",
        escape_bars(words),
    ]
    for file, caption in made.get("pictures", ()):
        parts.append(f".. figure:: {item.name}/{file}\n   :alt: {_line(caption)}\n\n   {_line(caption)}")
    parts += [_heading("On real shapes", "-"), _real(item, real)]
    parts += [_heading("On shapes made here", "-"), _synthetic(item, made)]
    parts += [_heading("The script", "-"), _script(item)]
    return "\n\n".join(parts) + "\n"


def _real(item: Item, real: Mapping[str, Any]) -> str:
    """Return what was found on real shapes, or that there is no record of it."""
    if not real:
        needs = f" It needs {', '.join(f'``{name}``' for name in item.needs)}." if item.needs else ""
        return f"No run on real shapes is recorded.{needs}"
    facts = real["made"]
    origin = f"Made by spem {facts['spem']} in {facts['seconds']:.3g} s."
    if facts["script"] != sha256(item.script.read_bytes()).hexdigest()[:16]:
        origin += " The script has changed since."
    numbers = json.dumps(real["numbers"], indent=1, ensure_ascii=False)
    parts = [f"{_line(real['shapes'])} {origin}", *map(_claim, real["claims"]), *map(_rows, real["tables"])]
    if real["numbers"]:
        parts.append(
            ".. dropdown:: All figures\n\n   .. code-block:: json\n      :class: numbers\n\n"
            + _indent(numbers, 6)
        )
    return "\n\n".join(parts)


def _synthetic(item: Item, made: Mapping[str, Any]) -> str:
    """Return what was found in the reduced size, as the pictures show it."""
    if not made:
        return "This build ran no script."
    words = f"The pictures above, and these statements, are of the reduced size. {_line(made['shapes'])}"
    return "\n\n".join([words, *map(_claim, made["claims"]), *map(_rows, made["tables"])])


def _claim(claim: Claim) -> str:
    """Return a statement with its verdict, the paper's value, ours, and the reason where they differ."""
    rows = [("Paper", claim.paper), ("Here", claim.ours)]
    if claim.note:
        rows.append(("Why" if claim.verdict == "differs" else "Note", claim.note))
    fields = "\n".join(f":{name}: {_line(value)}" for name, value in rows)
    badge = f":bdg-{BADGES[claim.verdict]}:`{claim.verdict}`"
    return f".. container:: claim\n\n   {_line(claim.statement)} {badge}\n\n{_indent(fields, 3)}"


def _rows(table: Table) -> str:
    """Return a table of numbers; its caption stands above it."""
    cells = (
        f"   {'  -' if column else '* -'} {_line(cell)}"
        for row in (table.head, *table.rows)
        for column, cell in enumerate(row)
    )
    rows = "\n".join(cells)
    return f"{_line(table.caption)}\n\n.. list-table::\n   :header-rows: 1\n\n{rows}"


def _script(item: Item) -> str:
    """Return how to run the script, and the script itself without the words that stand above."""
    commands = f"$ spem paper {item.name} --data shapes -o out\n$ python examples/{item.name}.py -o out"
    first = ast.parse(item.script.read_text(encoding="utf-8")).body[1].lineno
    return (
        f"The first line makes the item in full size, on real shapes where the folder ``shapes`` has them; "
        f"the second in the reduced size.\n\n.. code-block:: console\n\n{_indent(commands, 3)}\n\n"
        f":download:`{item.name}.py </../examples/{item.name}.py>`\n\n"
        f".. literalinclude:: /../examples/{item.name}.py\n   :language: python\n   :lines: {first}-"
    )


def index_page(pages: Mapping[Item, tuple[Mapping[str, Any], Mapping[str, Any]]]) -> str:
    """Return the page of all items: pictures by section, then a table."""
    real = Counter(claim.verdict for _, found in pages.values() for claim in found.get("claims", ()))
    parts = [
        _heading("The paper, reproduced", "="),
        "Every figure, table and claim of the paper is one small script, run by ``spem paper``. The pictures "
        "are of shapes made by the package itself, in a reduced size; statements are judged on real shapes "
        "too, where a run is recorded. A verdict follows from the measured numbers; where it differs from "
        "the paper the page says why.",
        f"On real shapes: {_counts(real)}." if real else "",
    ]
    for place, group in groupby(pages, lambda item: item.place):
        parts += [_heading(f"{place} {CHAPTERS[place]}", "-"), _cards(group, pages)]
    parts += [_heading("All items", "-"), _table(pages)]
    tree = "\n".join(f"   {item.name}" for item in pages)
    parts.append(f".. toctree::\n   :hidden:\n\n{tree}")
    return "\n\n".join(part for part in parts if part) + "\n"


def _cards(items: Iterable[Item], pages: Mapping[Item, tuple[Mapping[str, Any], Mapping[str, Any]]]) -> str:
    """Return a card for each item: picture, title, verdicts."""
    cards = []
    for item in items:
        made, real = pages[item]
        picture = f"   :img-top: {item.name}-small.png\n" if made.get("pictures") else ""
        counts = Counter(claim.verdict for claim in (real or made).get("claims", ()))
        cards.append(
            f".. grid-item-card:: {_line(item.words[0])}\n   :link: paper-{item.name}\n   :link-type: ref\n"
            f"{picture}   :class-img-top: thumbnail\n\n   {_badges(counts)}"
        )
    return ".. grid:: 1 2 2 3\n   :gutter: 3\n\n" + _indent("\n\n".join(cards), 3)


def _table(pages: Mapping[Item, tuple[Mapping[str, Any], Mapping[str, Any]]]) -> str:
    """Return the table of all items: number of statements and their verdicts."""
    rows = [("Item", "Section", "Statements", "On real shapes", "On shapes made here")]
    for item, (made, real) in pages.items():
        verdicts = [Counter(claim.verdict for claim in found.get("claims", ())) for found in (made, real)]
        number = max(verdict.total() for verdict in verdicts)
        link = f":ref:`{_line(item.words[0])} <paper-{item.name}>`"
        rows.append((link, item.place, str(number), _counts(verdicts[1]), _counts(verdicts[0])))
    cells = "\n".join(
        "\n".join(f"{'   * -' if k == 0 else '     -'} {cell}" for k, cell in enumerate(row)) for row in rows
    )
    return f".. list-table::\n   :header-rows: 1\n   :class: overview\n\n{cells}"


def _counts(verdicts: Counter[str]) -> str:
    """Return how many statements have each verdict, in words."""
    verbs = {"holds": "hold", "differs": "differ"}
    counted = (
        f"{count} {name if count == 1 else verbs.get(name, name)}"
        for name in BADGES
        if (count := verdicts[name])
    )
    return ", ".join(counted) or "–"


def _badges(verdicts: Counter[str]) -> str:
    """Return how many statements have each verdict, as badges."""
    return " ".join(f":bdg-{BADGES[n]}:`{verdicts[n]} {n}`" for n in BADGES if verdicts[n]) or "–"


def _heading(words: str, underline: str) -> str:
    """Return a heading; characters may be two columns wide."""
    return f"{words}\n{underline * (2 * len(words))}"


def _line(words: str) -> str:
    """Return plain words on one line, with what would be markup escaped, and options as code."""
    escaped = re.sub(r"([\\*`|_<>\[\]])", r"\\\1", " ".join(words.split()))
    return re.sub(r"(?<![\w-])--[a-z][\w-]*", r"``\g<0>``", escaped)


def _indent(block: str, by: int) -> str:
    """Return a block moved to the right."""
    return "\n".join(" " * by + line if line else "" for line in block.splitlines())


def _write(path: Path, words: str) -> None:
    """Write a page, unless it is there as it should be."""
    if not path.is_file() or path.read_text(encoding="utf-8") != words:
        path.write_text(words, encoding="utf-8")
