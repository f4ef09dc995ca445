"""Work shared out to processes, some of which die."""

from __future__ import annotations

import subprocess
import sys
import time
from pathlib import Path

import pytest

from spem.codes.workers import run_all

ENDLESS = """
import time
from spem.codes.workers import run_all

if __name__ == "__main__":
    print("started", flush=True)
    list(run_all(time.sleep, [0.1] * 3000, 2))
"""
DEADLY = "__import__('os')._exit(1)"


def test_dead_process_costs_no_other_task() -> None:
    """A task that kills its process fails alone, and those after it run beside each other again."""
    tasks = [DEADLY if i == 1 else str(i) for i in range(20)]
    outcomes = {task: (result, reason) for task, result, reason in run_all(eval, tasks, 2)}
    assert outcomes.pop(DEADLY) == (None, "its process died, perhaps for want of memory")
    assert outcomes == {str(i): (i, "") for i in range(20) if i != 1}


@pytest.mark.parametrize("after", [0.0, 0.3, 1.5])
def test_processes_end_with_their_parent(tmp_path: Path, after: float) -> None:
    """Killed while its processes start, or work, a parent leaves none behind: its output is closed soon."""
    script = tmp_path / "endless.py"
    script.write_text(ENDLESS)
    with subprocess.Popen([sys.executable, script], stdout=subprocess.PIPE, stderr=subprocess.PIPE) as parent:
        assert parent.stdout is not None
        parent.stdout.readline()
        time.sleep(after)
        parent.kill()
        parent.communicate(timeout=60)  # a process that waits for work holds it open for 300 seconds
