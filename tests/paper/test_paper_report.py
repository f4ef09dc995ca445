"""The page of all findings: what it counts, what it shows, what failed."""

from __future__ import annotations

import pytest

from spem.errors import ParameterError
from spem.paper.findings import Claim, Table
from spem.paper.report import write_report
from spem.paper.runs import Record


def record(folder, **changes):
    """Return a finding with a statement of each verdict and two that hold."""
    claims = tuple(
        Claim(f"Statement {i} < 1 (2.1).", "one", "two", verdict, "" if verdict == "holds" else "why")
        for i, verdict in enumerate(["holds", "holds", "differs", "not tested"])
    )
    tables = (Table("Numbers", ("a", "b"), (("1", "2"),)),)
    values = {"shapes": "A disk.", "claims": claims, "tables": tables, "made": {"seconds": 1.5}}
    return Record("fig1", "Figure 1", folder, **(values | changes))


def test_statements_are_counted_and_shown(tmp_path):
    """In words that fit their number; text is escaped, and each item can be linked to."""
    page = write_report(tmp_path / "r.html", [record(tmp_path)], ["no scans"]).read_text(encoding="utf-8")
    assert "of the statements judged: 2 hold, 1 differs, 1 not tested." in page
    assert "1 figure, table or claim; " in page
    assert page.count("Statement 2 &lt; 1 (2.1).") == 2
    assert page.count('<b class="differs">differs</b><br><small>why</small>') == 2
    assert '<a href="#fig1">fig1</a>' in page
    assert '<div id="fig1">' in page
    assert "<li>no scans</li>" in page
    assert "Made in 1.5 s." in page


def test_failures_are_counted_and_told(tmp_path):
    """In place of the content; there may be no statement at all."""
    failed = record(tmp_path, claims=(), failure="no memory")
    page = write_report(tmp_path / "r.html", [failed, failed]).read_text(encoding="utf-8")
    assert "2 figures, tables and claims; 2 could not be made." in page
    assert page.count("Could not be made: no memory") == 2
    assert "All statements" not in page


def test_a_page_that_cannot_be_written_is_refused(tmp_path):
    """Where a folder is in its place."""
    with pytest.raises(ParameterError, match=tmp_path.name):
        write_report(tmp_path, [record(tmp_path)])
