"""Encoding on a Dask cluster: two workers of one thread against one, and one of two killed in the middle.

``python benchmarks/cluster.py``, on a machine that has nothing else to do.
"""

from __future__ import annotations

import json
import os
import signal
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Self

import numpy as np
from distributed import Client

import spem
from _table import Benchmark, Row, data_root, timed
from spem.codes.model import Model
from spem.index.index import Index

# Shapes of SHREC'11 that are encoded, and creatures where it is absent.
SHAPES, CREATURES_EACH = 300, 20
# Shapes that the model is learnt from, and that workers code before the clock runs.
SAMPLE = 20
ROUNDS = 3
LOCAL = ("--host", "127.0.0.1", "--no-dashboard")
TARGET = 1.7


class Cluster:
    """A scheduler and workers of one thread, each a process of its own."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.workers: list[subprocess.Popen[bytes]] = []
        note = folder / f"scheduler-{time.monotonic_ns()}.json"
        self.scheduler = self._start("dask_scheduler", "--port", "0", "--scheduler-file", str(note))
        while not note.is_file():
            time.sleep(0.1)
        self.address = json.loads(note.read_text())["address"]

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        for process in (*self.workers, self.scheduler):
            process.kill()
            process.wait()

    def add_worker(self) -> None:
        """Start one more worker, and wait for it."""
        self.workers.append(self._start("dask_worker", self.address, "--nthreads", "1", "--no-nanny"))
        with Client(self.address, set_as_default=False) as client:
            client.wait_for_workers(len(self.workers))

    def _start(self, module: str, *arguments: str) -> subprocess.Popen[bytes]:
        """Start a process of Dask, with numerical libraries on one thread."""
        threads = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "NUMBA_NUM_THREADS"), "1")
        command = [sys.executable, "-m", f"distributed.cli.{module}", *arguments, *LOCAL]
        quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
        return subprocess.Popen(command, env=os.environ | threads, cwd=self.folder, **quiet)


def collection(benchmark: Benchmark, folder: Path) -> tuple[str, list[Path]]:
    """Return meshes: real ones where they are, else creatures."""
    root = data_root()
    if benchmark.quick or root is None or not (root / "shrec11").is_dir():
        if not benchmark.quick:
            benchmark.skip("shrec11: SPEM_DATA names no folder that has it; creatures in its place")
        rng = np.random.default_rng(0)
        kinds, each = (["fish"], 8) if benchmark.quick else (None, CREATURES_EACH)
        made = spem.creatures.write_collection(folder, n_per_class=each, kinds=kinds, rng=rng, images=False)
        return "creatures", sorted(made[0].glob("*.obj"))
    return "shrec11", sorted((root / "shrec11").glob("*.obj"))[:SHAPES]


def encoding_time(cluster: Cluster, files: list[Path], model: Model) -> Row:
    """Return what it takes to encode files on a cluster that is warm."""
    new = cluster.folder / f"index-{time.monotonic_ns()}"
    Index.open(f"{new}-warm").add(files[:SAMPLE], model=model, cluster=cluster.address)
    index = Index.open(new)
    seconds, added = timed(lambda: index.add(files, model=model, cluster=cluster.address))
    return {
        "workers": len(cluster.workers),
        "seconds": seconds,
        "shapes a second": len(files) / seconds,
        "rows": len(index),
        "failed": len(added.failures),
    }


def killed(cluster: Cluster, files: list[Path], model: Model) -> Row | None:
    """Kill one of two workers when a third of the shapes is written; None where all came at once."""
    victim, when = cluster.workers[0], len(files)

    def kill(stage: str, done: int, total: int) -> None:
        nonlocal when
        if stage == "codes" and total > done >= total / 3 and victim.poll() is None:
            when = done
            victim.send_signal(signal.SIGKILL)
            victim.wait()

    index = Index.open(cluster.folder / "killed")
    added = index.add(files, model=model, cluster=cluster.address, progress=kill)
    dead = sum(worker.poll() is not None for worker in cluster.workers)
    if when == len(files):
        return None
    return {
        "shapes": len(files),
        "written by then": when,
        "workers killed": dead,
        "rows": len(index),
        "failed": len(added.failures),
    }


def main(argv: list[str] | None = None) -> None:
    benchmark = Benchmark("cluster", str(__doc__).splitlines()[0], argv)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        which, files = collection(benchmark, folder)
        sample = Index.open(folder / "sample")
        settings = {"voxels": 2000, "n_centers": 8} if benchmark.quick else {}
        sample.add(files[:SAMPLE], **settings)
        model = sample.model()
        runs: list[Row] = []
        n_rounds = 1 if benchmark.quick else ROUNDS
        for number in range(n_rounds):
            with Cluster(folder) as cluster:
                for _ in range(2):
                    cluster.add_worker()
                    runs.append(encoding_time(cluster, files, model))
                if number == n_rounds - 1:
                    loss = killed(cluster, files, model)
        benchmark.table(f"{len(files)} shapes of {which}", runs)
        if loss is not None:
            benchmark.table("one of two workers killed", [loss])
    alone, both = (statistics.median(row["seconds"] for row in runs if row["workers"] == n) for n in (1, 2))
    benchmark.target("two workers against one, times as fast", alone / both, TARGET, at_least=True)
    if loss is None:
        benchmark.skip("a worker killed: all shapes were written at once, before it could be")
    else:
        benchmark.target("shapes lost with the worker", loss["shapes"] - loss["rows"] + loss["failed"], 0)
    benchmark.write()


if __name__ == "__main__":
    main()
