"""A sample of the hostile files against readers and server; `benchmarks/hostile.py` runs them all."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

SCRIPT = Path(__file__).parents[2] / "benchmarks" / "hostile.py"


def test_nothing_that_is_sent_is_a_finding(tmp_path: Path) -> None:
    """Of forty files none raises what it should not, kills for good, hangs or touches another file."""
    for package in ("fastapi", "httpx", "lancedb", "nibabel", "tifffile"):
        pytest.importorskip(package)
    command = [sys.executable, str(SCRIPT), "--quick", "--out", str(tmp_path)]
    done = subprocess.run(command, env=dict(os.environ), capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    result = json.loads((tmp_path / "hostile.json").read_text(encoding="utf-8"))
    assert result["facts"]["files"] >= 40
    assert result["facts"]["healthy at the end"]
    assert [target for target in result["targets"] if not target["met"]] == []
    server = result["tables"]["server"][-1]
    assert server["done"] > 0
    assert server["failed"] > 0
