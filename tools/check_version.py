"""Check that the version is the same in pyproject.toml, in the package and at the top of the changelog."""

from __future__ import annotations

import re
import sys
import tomllib
from pathlib import Path

ROOT = Path(__file__).parents[1]
SOURCES = {
    "CHANGELOG.md": r"^## \[?v?(\d[\w.]*)",
    "src/spem/__init__.py": r'^__version__ = "(.*)"',
}


def main() -> None:
    """Exit with a line on every file whose version differs."""
    stated = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]["version"]
    wrong = []
    for name, pattern in SOURCES.items():
        path = ROOT / name
        hit = re.search(pattern, path.read_text(encoding="utf-8"), re.MULTILINE) if path.is_file() else None
        found = hit.group(1) if hit else "none"
        if found != stated:
            wrong.append(f"{name}: version {found}, expected {stated} as in pyproject.toml")
    sys.exit("\n".join(wrong) or None)


if __name__ == "__main__":
    main()
