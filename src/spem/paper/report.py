"""All findings on one page: a single HTML file that needs nothing else and no network."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import get_args

from spem.files import write_whole
from spem.paper.findings import Claim, Verdict
from spem.paper.runs import Record
from spem.plots.markup import data_uri, page, section, table, text

# Verdicts as verbs of several statements.
_SEVERAL = {"holds": "hold", "differs": "differ"}


def write_report(path: Path, records: Sequence[Record], absent: Sequence[str] = ()) -> Path:
    """Write the page.

    Parameters
    ----------
    path
        The file; an existing one is replaced in one step.
    records
        What was made, in the order of the paper.
    absent
        What collections are missing and how to get them, a sentence each.

    Raises
    ------
    ParameterError
        If the file cannot be written.
    """
    counts = Counter(claim.verdict for record in records for claim in record.claims)
    parts = [
        f"{count} {verdict if count == 1 else _SEVERAL.get(verdict, verdict)}"
        for verdict in get_args(Verdict)
        if (count := counts[verdict])
    ]
    number = "1 figure, table or claim" if len(records) == 1 else f"{len(records)} figures, tables and claims"
    summary = [number, f"of the statements judged: {', '.join(parts)}"] if parts else [number]
    if failed := sum(bool(record.failure) for record in records):
        summary.append(f"{failed} could not be made")
    missing = "".join(f"<li>{text(note)}</li>" for note in absent)
    body = section("Absent collections", f"<ul>{missing}</ul>" if missing else "")
    body += _overview(records) + "".join(_item(record) for record in records)
    title = "Screened Poisson hyperfields: the paper reproduced"
    whole = page(title, text("; ".join(summary) + "."), body, style="report.css", script="report.js").encode()
    write_whole(path, lambda file: file.write(whole))
    return path


def _overview(records: Sequence[Record]) -> str:
    """One row for each statement; nothing where there is none."""
    rows = [
        [f'<a href="#{record.item}">{text(record.item)}</a>', *_cells(claim)]
        for record in records
        for claim in record.claims
    ]
    if not rows:
        return ""
    head = ["item", "statement", "paper", "ours", "verdict"]
    statements = table("Each statement of the paper beside what was measured.", head, rows)
    return section("All statements", f'<div class="statements">{statements}</div>')


def _cells(claim: Claim) -> list[str]:
    """Return statement, paper, ours and verdict as cells; the explanation stands below the verdict."""
    note = f"<br><small>{text(claim.note)}</small>" if claim.note else ""
    verdict = f'<b class="{claim.verdict.replace(" ", "-")}">{text(claim.verdict)}</b>{note}'
    return [text(claim.statement), text(claim.paper), text(claim.ours), verdict]


def _item(record: Record) -> str:
    """Return the section of one item."""
    if record.failure:
        content = f'<p class="wrong">Could not be made: {text(record.failure)}</p>'
    else:
        seconds = (record.made or {}).get("seconds", 0.0)
        pictures = "".join(
            f'<figure class="picture"><img alt="{text(caption)}" style="max-width:100%" '
            f'src="{data_uri((record.folder / file).read_bytes())}">'
            f"<figcaption>{text(caption)}</figcaption></figure>"
            for file, caption in record.pictures
        )
        tables = "".join(
            table(text(each.caption), [text(title) for title in each.head], _escaped(each.rows))
            for each in record.tables
        )
        rows = [_cells(claim) for claim in record.claims]
        claims = table("Statements", ["statement", "paper", "ours", "verdict"], rows) if rows else ""
        content = (
            f"<p>{text(record.shapes)} Made in {seconds:.1f} s.</p>{pictures}{tables}"
            f'<div class="statements">{claims}</div>'
        )
    return f'<div id="{text(record.item)}">{section(text(record.title), content)}</div>'


def _escaped(rows: Sequence[Sequence[str]]) -> list[list[str]]:
    """Return cells as HTML."""
    return [[text(cell) for cell in row] for row in rows]
