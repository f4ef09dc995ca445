"""Keep what a run on real shapes found, for the pages of the paper: python docs/record.py FOLDER.

FOLDER is what ``spem paper all --data DIR -o FOLDER`` wrote. Claims and numbers are kept; pictures,
which show real shapes, are not.
"""

from __future__ import annotations

import json
import math
import sys
from pathlib import Path
from typing import Any

from spem.paper.catalogue import ITEMS, Item
from spem.paper.runs import RECORD

RESULTS = Path(__file__).parent / "results"
# Longer lists are pictures in numbers.
_LONGEST = 60
_DIGITS = 5


def main(folder: Path, results: Path = RESULTS) -> None:
    """Copy the record of each item that was made in full size on real shapes."""
    results.mkdir(exist_ok=True)
    for item in ITEMS:
        path = folder / item.name / RECORD
        reason = _record(item, path, results) if path.is_file() else "not made"
        print(f"{item.name}: {reason}")  # noqa: T201 - the script's own output


def _record(item: Item, path: Path, results: Path) -> str:
    """Write the record of one item, and say what became of it."""
    found = json.loads(path.read_text(encoding="utf-8"))
    made = found["made"]
    if made["quick"] or made["data"] is None:
        return "left out: made in the reduced size, or without real shapes"
    missing = [name for name in item.needs if name not in made["data"]]
    if missing:
        return f"left out: made without {', '.join(missing)}"
    kept = {
        "shapes": found["shapes"],
        "claims": found["claims"],
        "tables": found["tables"],
        "numbers": _short(found["numbers"]),
        "made": {"spem": made["spem"], "script": made["script"], "seconds": made["seconds"]},
    }
    text = json.dumps(kept, indent=1, ensure_ascii=False) + "\n"
    (results / f"{item.name}.json").write_text(text, encoding="utf-8")
    return f"kept, {len(found['claims'])} statements"


def _short(values: Any) -> Any:
    """Return numbers with a few digits, and without what is too long to read."""
    if isinstance(values, dict):
        return {name: _short(value) for name, value in values.items() if not _long(value)}
    if isinstance(values, list):
        return [_short(value) for value in values]
    if isinstance(values, float) and math.isfinite(values):
        return float(f"{values:.{_DIGITS}g}")
    return values


def _long(values: Any) -> bool:
    """Tell whether lists of lists hold more values than can be read."""
    return isinstance(values, list) and _count(values) > _LONGEST


def _count(values: Any) -> int:
    """Count the values of lists of lists."""
    return sum(map(_count, values)) if isinstance(values, list) else 1


if __name__ == "__main__":
    main(Path(sys.argv[1]))
