"""What a script of the examples does when it is run by itself."""

from __future__ import annotations

import argparse
from collections.abc import Callable
from pathlib import Path

from spem.paper.data import Data
from spem.paper.findings import Finding


def present(make: Callable[[Data], Finding], argv: list[str] | None = None) -> Finding:
    """Run an experiment, print what it found, and write its pictures where a folder is named.

    Parameters
    ----------
    make
        The experiment.
    argv
        Options: ``--data DIR``, ``--full``, ``-o DIR``; those of the process by default.

    Examples
    --------
    >>> from spem.paper.findings import judged
    >>> found = present(lambda data: Finding("none", (judged("1 is 1.", "1", "1", True, note=""),)), [])
    Shapes: none
    holds: 1 is 1. Paper: 1. Ours: 1.
    """
    parser = argparse.ArgumentParser(description="Reproduce one figure, table or claim of the paper.")
    parser.add_argument("--data", type=Path, help="folder that holds the collections of real shapes")
    parser.add_argument("--full", action="store_true", help="the full size, in place of a quick one")
    parser.add_argument("-o", "--output", type=Path, help="folder for the pictures")
    options = parser.parse_args(argv)
    finding = make(Data(options.data, quick=not options.full))
    print(f"Shapes: {finding.shapes}")  # noqa: T201 - the script's own output
    for table in finding.tables:
        print(table.caption)  # noqa: T201
        for row in (table.head, *table.rows):
            print("  " + "  ".join(row))  # noqa: T201
    for claim in finding.claims:
        note = f" {claim.note}" if claim.note else ""
        print(f"{claim.verdict}: {claim.statement} Paper: {claim.paper}. Ours: {claim.ours}.{note}")  # noqa: T201
    if options.output is not None:
        options.output.mkdir(parents=True, exist_ok=True)
        for picture in finding.pictures:
            picture.figure.savefig(options.output / f"{picture.name}.png", dpi=130)
    return finding
