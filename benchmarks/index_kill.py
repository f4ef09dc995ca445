"""An index after its writer was killed (kill -9) at random moments: ``python benchmarks/index_kill.py``."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import tempfile
import time
from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from _table import Benchmark, Row
from spem.index.index import Index

ROUNDS, QUICK = 100, 5
# Rounds of one mode that go on with one index.
PER_INDEX = 10
# Seconds after which the writer is killed, at most.
LONGEST = {"add": 0.5, "optimize": 0.5, "create": 0.15}
WRITER = Path(__file__).with_name("_index_writer.py")


@dataclass
class Told:
    """What a writer told before it was killed."""

    done: set[str] = field(default_factory=set)
    last: tuple[str, ...] = ()
    killed: bool = True


class Writer:
    """The process that forks writers."""

    def __init__(self) -> None:
        self.process = subprocess.Popen(
            [sys.executable, str(WRITER)], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
        )
        self.line()

    def line(self) -> list[str]:
        """Return the words of the next line."""
        words = self.process.stdout.readline().split()
        if not words:
            msg = "the writer has ended by itself"
            raise RuntimeError(msg)
        return words

    def run(self, folder: Path, seed: int, mode: str, delay: float) -> Told:
        """Let a writer write, kill it after a while, and return what it told."""
        self.process.stdin.write(f"{folder} {seed} {mode}\n")
        self.process.stdin.flush()
        told, number, ready = Told(), 0, False
        while not (number and ready):
            words = self.line()
            number = int(words[1]) if words[0] == "child" else number
            ready = ready or words[0] == "ready"
        time.sleep(delay)
        os.kill(number, signal.SIGKILL)
        while (words := self.line())[0] != "ended":
            if words[0] == "begin":
                told.last = tuple(words[1:])
            elif words[0] == "done":
                told.done.update(words[1:])
        told.killed = int(words[1]) == signal.SIGKILL
        if not told.killed:
            msg = f"the writer ended by itself, with status {words[1]}, before it was killed"
            raise RuntimeError(msg)
        return told

    def close(self) -> None:
        """End the process."""
        self.process.communicate()


def faults(folder: Path, told: Told, before: set[str]) -> tuple[list[str], set[str]]:
    """Reopen an index and return what is wrong, and the ids that it has."""
    index = Index.open(folder)
    if not index.models():
        return (["rows told as done, and no model"] if told.done else []), set()
    ids = [row.id for row in index.rows()]
    here = set(ids)
    wrong = [str(finding) for finding in index.check()]
    if len(here) < len(ids):
        wrong.append(f"{len(ids) - len(here)} rows there twice")
    if (told.done | before) - here:
        wrong.append(f"{len((told.done | before) - here)} rows lost")
    unfinished = set(told.last) - told.done - before
    if unfinished & here and unfinished - here:
        wrong.append("a batch half written")
    return wrong, here


def run_mode(writer: Writer, mode: str, rounds: int, rng: np.random.Generator) -> tuple[Row, list[str]]:
    """Kill writers of one mode, and return what came of it."""
    count: Counter[str] = Counter()
    wrong: list[str] = []
    for first in range(0, rounds, 1 if mode == "create" else PER_INDEX):
        here: set[str] = set()
        with tempfile.TemporaryDirectory() as root:
            folder = Path(root, "shapes.db")
            for seed in range(first, min(rounds, first + (1 if mode == "create" else PER_INDEX))):
                told = writer.run(folder, seed, mode, float(rng.uniform(0, LONGEST[mode])))
                found, here = faults(folder, told, here)
                wrong += [f"{mode}, round {seed}: {each}" for each in found]
                count += Counter(whole=not found, killed=told.killed, done=len(told.done))
                count["during a batch"] += bool(told.last) and not set(told.last) <= told.done
    return {"killed while": mode, "rounds": rounds} | dict(count), wrong


def main(argv: list[str] | None = None) -> None:
    benchmark = Benchmark("index_kill", str(__doc__).splitlines()[0], argv)
    if not hasattr(os, "fork"):
        benchmark.skip("no fork on this system")
        benchmark.write()
        return
    rounds, rng = QUICK if benchmark.quick else ROUNDS, np.random.default_rng(0)
    rows, wrong = [], []
    writer = Writer()
    for mode, share in (("add", 1.0), ("optimize", 0.4), ("create", 0.4)):
        row, found = run_mode(writer, mode, max(2, round(share * rounds)), rng)
        rows.append(row)
        wrong += found
    writer.close()
    benchmark.table("indices reopened after kill -9", rows)
    if wrong:
        benchmark.table("what was wrong", [{"fault": each} for each in wrong])
    for row in rows:
        what = f"whole after kill -9 while {row['killed while']}, share of {row['rounds']}"
        benchmark.target(what, row.get("whole", 0) / row["rounds"], 1.0, at_least=True)
    benchmark.write()


if __name__ == "__main__":
    main()
