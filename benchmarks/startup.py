"""First import of spem and ``spem --help``, each in a fresh process: ``python benchmarks/startup.py``."""

from __future__ import annotations

import statistics
import subprocess
import sys

from _table import Benchmark, Row, timed

LIMIT = 1.0
CALLS = {
    "python, nothing imported": ["-c", "pass"],
    "import numpy": ["-c", "import numpy"],
    "import spem": ["-c", "import spem"],
    "spem --help": ["-c", "from spem.cli import main; main()", "--help"],
    "spem encode --help": ["-c", "from spem.cli import main; main()", "encode", "--help"],
}
HELD = ("import spem", "spem --help")


def main(argv: list[str] | None = None) -> None:
    benchmark = Benchmark("startup", str(__doc__).splitlines()[0], argv)
    rounds = 1 if benchmark.quick else 5
    times: dict[str, list[float]] = {name: [] for name in CALLS}
    for _ in range(rounds):
        for name, arguments in CALLS.items():
            command = [sys.executable, *arguments]
            times[name].append(timed(lambda c=command: subprocess.run(c, check=True, capture_output=True))[0])
    rows: list[Row] = [
        {"call": name, "first": seconds[0], "median": statistics.median(seconds), "worst": max(seconds)}
        for name, seconds in times.items()
    ]
    benchmark.table(f"seconds of {rounds} runs", rows)
    for name in HELD:
        benchmark.target(f"{name}, median seconds", statistics.median(times[name]), LIMIT)
    benchmark.write()


if __name__ == "__main__":
    main()
