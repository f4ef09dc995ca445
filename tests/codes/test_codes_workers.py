"""Work shared out to processes, some of which die."""

from __future__ import annotations

from spem.codes.workers import run_all

DEADLY = "__import__('os')._exit(1)"


def test_dead_process_costs_no_other_task() -> None:
    """A task that kills its process fails alone, and those after it run beside each other again."""
    tasks = [DEADLY if i == 1 else str(i) for i in range(20)]
    outcomes = {task: (result, reason) for task, result, reason in run_all(eval, tasks, 2)}
    assert outcomes.pop(DEADLY) == (None, "its process died, perhaps for want of memory")
    assert outcomes == {str(i): (i, "") for i in range(20) if i != 1}
