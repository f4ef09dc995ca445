"""Memory of a process: what it holds, and the most that it has held."""

from __future__ import annotations

import os
import resource
import sys
from pathlib import Path


def peak() -> int:
    """Return the largest memory that this process has held, in bytes."""
    unit = 1 if sys.platform == "darwin" else 1024
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * unit


def forget_peak() -> None:
    """Let the peak start anew, where the system can: else making the shape may count as the sweep's."""
    clear = Path("/proc/self/clear_refs")
    if clear.is_file() and os.access(clear, os.W_OK):
        clear.write_text("5", encoding="ascii")


def resident() -> int:
    """Return the memory that this process holds now, in bytes; the peak where that is not to be had."""
    status = Path("/proc/self/statm")
    if not status.is_file():
        return peak()
    return int(status.read_text(encoding="ascii").split()[1]) * resource.getpagesize()


def available() -> int | None:
    """Return the memory that can still be had, in bytes; None where the system does not tell."""
    table = Path("/proc/meminfo")
    if not table.is_file():
        return None
    for line in table.read_text(encoding="ascii").splitlines():
        if line.startswith("MemAvailable:"):
            return 1024 * int(line.split()[1])
    return None
