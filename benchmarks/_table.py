"""What every benchmark shares: arguments, data folder, timing, the table on the screen and the JSON file."""

from __future__ import annotations

import argparse
import importlib.metadata
import json
import os
import platform
import statistics
import time
import traceback
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

PACKAGES = ("spem", "numpy", "scipy", "numba", "scikit-learn", "pyamg")
ROOT = Path(__file__).resolve().parents[1]
THREAD_LIMITS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS")

Row = dict[str, Any]


class Benchmark:
    """One run of one script: its options, and the rows, notes and skipped parts that end in the JSON file."""

    def __init__(
        self, name: str, description: str, argv: Sequence[str] | None = None, sections: Sequence[str] = ()
    ) -> None:
        parser = argparse.ArgumentParser(description=description)
        if sections:
            parser.add_argument(
                "--only", action="append", choices=sections, metavar="SECTION", help=", ".join(sections)
            )
        parser.add_argument("--quick", action="store_true", help="small sizes, seconds in all")
        parser.add_argument("--out", type=Path, default=ROOT / "benchmarks" / "results", help="folder")
        options = parser.parse_args(argv)
        chosen = getattr(options, "only", None)
        self.sections: tuple[str, ...] = tuple(chosen or sections)
        # a part of the figures does not replace all of them
        self.name = "_".join([name, *chosen]) if chosen else name
        self.failed = False
        self.quick: bool = options.quick
        self.out: Path = options.out
        self.tables: dict[str, list[Row]] = {}
        self.targets: list[Row] = []
        self.skipped: list[str] = []
        self.facts: dict[str, Any] = {}

    def section(self, name: str, run: Callable[[], None]) -> None:
        """Run a section if it was asked for, and write what there is; its failure ends no other."""
        if name not in self.sections:
            return
        try:
            run()
        except Exception as error:  # noqa: BLE001
            traceback.print_exc()
            self.failed = True
            self.skip(f"{name}: FAILED with {type(error).__name__}: {' '.join(str(error).split())}")
        self.write()

    def skip(self, reason: str) -> None:
        """Say that a part was not run, and why."""
        print(f"skipped: {reason}")
        self.skipped.append(reason)

    def table(self, title: str, rows: list[Row]) -> None:
        """Print rows under their keys and keep them."""
        print(f"\n{title}")
        print_table(rows)
        self.tables[title] = rows

    def target(self, what: str, value: float, limit: float, *, at_least: bool = False) -> None:
        """Hold a figure against its target."""
        met = value >= limit if at_least else value <= limit
        sign = "at least" if at_least else "at most"
        verdict = "met" if met else "MISSED"
        print(f"target: {what}: {shown(value)}, {sign} {shown(limit)}: {verdict}")
        self.targets.append({"what": what, "value": value, sign: limit, "met": met})

    def fact(self, what: str, value: Any) -> None:
        """Print and keep a single figure."""
        print(f"{what}: {shown(value)}")
        self.facts[what] = value

    def write(self) -> Path:
        """Write all of it as JSON."""
        self.out.mkdir(parents=True, exist_ok=True)
        path = self.out / f"{self.name}.json"
        content = {
            "benchmark": self.name,
            "quick": self.quick,
            "machine": machine(),
            "facts": self.facts,
            "tables": self.tables,
            "targets": self.targets,
            "skipped": self.skipped,
        }
        path.write_text(json.dumps(content, indent=1, default=_plain) + "\n", encoding="utf-8")
        print(f"\nwrote {path}")
        return path


def data_root() -> Path | None:
    """Return the folder of real shapes, SPEM_DATA or ../shared/data beside the repository, if it exists."""
    root = Path(os.environ.get("SPEM_DATA", ROOT.parent / "shared" / "data"))
    return root if root.is_dir() else None


def machine() -> Row:
    """Return what figures of time depend on."""
    versions = {}
    for package in PACKAGES:
        try:
            versions[package] = importlib.metadata.version(package)
        except importlib.metadata.PackageNotFoundError:
            versions[package] = "absent"
    return {
        "cores": len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count(),
        "load": os.getloadavg()[0] if hasattr(os, "getloadavg") else None,
        "processor": processor(),
        "python": platform.python_version(),
        "threads": {key: os.environ[key] for key in THREAD_LIMITS if key in os.environ} or "not limited",
        "versions": versions,
    }


def processor() -> str:
    """Return the model of the processor."""
    info = Path("/proc/cpuinfo")
    if info.is_file():
        for line in info.read_text(encoding="utf-8").splitlines():
            if line.startswith("model name"):
                return line.partition(":")[2].strip()
    return platform.processor() or platform.machine()


def timed(call: Callable[[], Any]) -> tuple[float, Any]:
    """Return wall-clock seconds and the result of a call."""
    start = time.perf_counter()
    result = call()
    return time.perf_counter() - start, result


def alternating(calls: dict[str, Callable[[], Any]], rounds: int) -> dict[str, float]:
    """Return median seconds of calls that take turns, so that a busy machine slows all of them alike."""
    times: dict[str, list[float]] = {name: [] for name in calls}
    for _ in range(rounds):
        for name, call in calls.items():
            times[name].append(timed(call)[0])
    return {name: statistics.median(seconds) for name, seconds in times.items()}


def compile_kernels(dimensions: Iterable[int] = (1, 2, 3)) -> float:
    """Run everything once on tiny shapes, so that no later time has compilation in it; return the seconds."""

    def run() -> None:
        import spem

        for d in dimensions:
            shape = spem.synthetic.n_ball(1.0, 0.2, d)
            spem.maps(spem.sweep(shape))
            spem.field(shape, 0.3)

    return timed(run)[0]


def slope(x: Sequence[float], y: Sequence[float]) -> float:
    """Return the exponent p of the power law y = c x^p, by least squares in logarithms."""
    return float(np.polyfit(np.log(x), np.log(y), 1)[0])


def print_table(rows: list[Row]) -> None:
    """Print rows aligned under their keys."""
    if not rows:
        print("(nothing)")
        return
    keys = list(dict.fromkeys(key for row in rows for key in row))
    cells = [keys, *([shown(row.get(key, "")) for key in keys] for row in rows)]
    widths = [max(len(line[i]) for line in cells) for i in range(len(keys))]
    numeric = [all(isinstance(row.get(key, 0), int | float | np.number) for row in rows) for key in keys]
    for line in cells:
        parts = zip(line, widths, numeric, strict=True)
        print("  ".join(cell.rjust(w) if right else cell.ljust(w) for cell, w, right in parts).rstrip())


def shown(value: Any) -> str:
    """Return a value as it stands in a table."""
    if isinstance(value, float | np.floating):
        return f"{value:.3g}" if abs(value) < 1000 else f"{value:.0f}"
    return str(value)


def _plain(value: Any) -> Any:
    """Turn what NumPy made into what JSON knows."""
    return value.tolist() if isinstance(value, np.ndarray | np.generic) else str(value)
