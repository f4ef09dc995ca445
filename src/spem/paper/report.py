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
    parts = [f"{counts[verdict]} {verdict}" for verdict in get_args(Verdict) if counts[verdict]]
    failed = sum(bool(record.failure) for record in records)
    if failed:
        parts.append(f"{failed} could not be made")
    summary = text(
        f"{len(records)} figures, tables and claims; of the statements judged: {', '.join(parts)}."
    )
    missing = "".join(f"<li>{text(note)}</li>" for note in absent)
    body = section("Absent collections", f"<ul>{missing}</ul>" if missing else "")
    body += _overview(records) + "".join(_item(record) for record in records)
    title = "Screened Poisson hyperfields: the paper reproduced"
    whole = page(title, summary, body, style="report.css", script="report.js").encode()
    write_whole(path, lambda file: file.write(whole))
    return path


def _overview(records: Sequence[Record]) -> str:
    """One row for each statement."""
    rows = [
        [f'<a href="#{record.item}">{text(record.item)}</a>', *_cells(claim)]
        for record in records
        for claim in record.claims
    ]
    head = ["item", "statement", "paper", "ours", "verdict"]
    return section(
        "All statements", table("Each statement of the paper beside what was measured.", head, rows)
    )


def _cells(claim: Claim) -> list[str]:
    """Return statement, paper, ours and verdict as cells; the explanation stands below the verdict."""
    note = f"<br><small>{text(claim.note)}</small>" if claim.note else ""
    return [text(claim.statement), text(claim.paper), text(claim.ours), f"<b>{text(claim.verdict)}</b>{note}"]


def _item(record: Record) -> str:
    """Return the section of one item."""
    if record.failure:
        content = f'<p class="wrong">Could not be made: {text(record.failure)}</p>'
    else:
        seconds = (record.made or {}).get("seconds", 0.0)
        pictures = "".join(
            f'<figure><img alt="{text(caption)}" src="{data_uri((record.folder / file).read_bytes())}" '
            f'style="max-width:100%"><figcaption>{text(caption)}</figcaption></figure>'
            for file, caption in record.pictures
        )
        tables = "".join(
            table(text(each.caption), [text(title) for title in each.head], _escaped(each.rows))
            for each in record.tables
        )
        rows = [_cells(claim) for claim in record.claims]
        claims = table("Statements", ["statement", "paper", "ours", "verdict"], rows) if rows else ""
        content = f"<p>{text(record.shapes)} Made in {seconds:.1f} s.</p>{pictures}{tables}{claims}"
    return f'<div id="{text(record.item)}">{section(text(record.title), content)}</div>'


def _escaped(rows: Sequence[Sequence[str]]) -> list[list[str]]:
    """Return cells as HTML."""
    return [[text(cell) for cell in row] for row in rows]
