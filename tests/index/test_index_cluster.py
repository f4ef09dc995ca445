"""Encoding on a real Dask cluster of several processes, some of which die."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import pytest

import spem
from spem.errors import ClusterError
from spem.index.cluster import ClusterExecutor
from spem.index.executors import Item
from spem.index.index import Index

pytest.importorskip("distributed")

LOCAL = ("--host", "127.0.0.1", "--no-dashboard")
QUICK = {"features": "spem", "voxels": None, "n_maps": 3, "n_centers": 4, "n_rho": 16}


@dataclass
class Cluster:
    """A scheduler and workers without guardians, each a process of its own."""

    folder: Path
    processes: list[subprocess.Popen[bytes]] = field(default_factory=list)
    address: str = ""

    def start(self, module: str, *arguments: object) -> subprocess.Popen[bytes]:
        """Start a process that the end of the tests ends."""
        command = [sys.executable, "-m", f"distributed.cli.{module}", *map(str, arguments)]
        # one death and a task is handed back
        threads = {"OMP_NUM_THREADS": "1", "DASK_DISTRIBUTED__SCHEDULER__ALLOWED_FAILURES": "0"}
        quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
        self.processes.append(subprocess.Popen(command, cwd=self.folder, env=os.environ | threads, **quiet))
        return self.processes[-1]

    def add_workers(self, count: int) -> None:
        """Start workers, and wait until there are so many."""
        from distributed import Client

        with Client(self.address, set_as_default=False) as client:
            for _ in range(count - len(client.nthreads())):
                self.start("dask_worker", self.address, *LOCAL, "--no-nanny", "--nthreads", 1)
            client.wait_for_workers(count, timeout=60)


@pytest.fixture(scope="module")
def scheduler(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Cluster]:
    """Return a cluster without workers."""
    made = Cluster(tmp_path_factory.mktemp("cluster"))
    note = made.folder / "scheduler.json"
    made.start("dask_scheduler", *LOCAL, "--port", 0, "--scheduler-file", note)
    try:
        wait_for(note.is_file)
        made.address = json.loads(note.read_text())["address"]
        yield made
    finally:
        for process in made.processes:
            process.kill()
            process.wait()


@pytest.fixture(scope="module")
def cluster(scheduler: Cluster) -> Cluster:
    """Return a cluster of two workers, which tests kill one by one."""
    scheduler.add_workers(2)
    return scheduler


def wait_for(condition: Callable[[], bool]) -> None:
    """Wait until something is so."""
    end = time.monotonic() + 60
    while not condition():
        assert time.monotonic() < end
        time.sleep(0.02)


def test_cluster_without_workers_is_refused(scheduler):
    """A scheduler alone is told of at once, with the command that starts a worker."""
    with pytest.raises(ClusterError, match="the scheduler has no worker; start some with: dask worker"):
        list(executor(scheduler).run(eval, ["1"]))


def test_results_and_reasons_come_back(cluster):
    """Each task has its result, or one line why there is none."""
    outcomes = {
        task: (result, reason) for task, result, reason in executor(cluster).run(eval, ["6 * 7", "1 / 0"])
    }
    assert outcomes["6 * 7"] == (42, "")
    assert outcomes["1 / 0"] == (None, "unexpected ZeroDivisionError: division by zero; please report it")


def executor(cluster: Cluster, **options: object) -> ClusterExecutor:
    """Return an executor on the cluster."""
    return ClusterExecutor(cluster.address, **options)


def test_codes_are_those_of_this_machine(cluster, tmp_path, monkeypatch):
    """An index made on the cluster has the model and the rows of one made here, failures included."""
    shapes = tmp_path / "shapes"
    shapes.mkdir()
    for n in (9, 11, 12):
        np.save(shapes / f"{n}.npy", np.ones((n, 10)))
    (shapes / "bad.obj").write_text("nothing")
    monkeypatch.chdir(tmp_path)
    here, there = Index.open("here"), Index.open("there")
    expected = here.add("shapes", **QUICK)
    assert there.add("shapes", cluster=cluster.address, **QUICK).model == expected.model
    np.save(shapes / "late.npy", np.ones((7, 10)))
    added = there.add("shapes", cluster=cluster.address)
    here.add("shapes")
    assert (added.added, added.unchanged, len(added.failures)) == (1, 3, 1)
    assert added.failures[0].path == str(Path("shapes", "bad.obj"))
    rows = [{row.id: (row.path, row.name, row.volume) for row in index.rows()} for index in (here, there)]
    assert rows[0] == rows[1]
    codes = [index.get(next(iter(rows[0]))).code for index in (here, there)]
    np.testing.assert_array_equal(*codes)


def test_files_that_workers_cannot_see_are_refused(cluster, tmp_path):
    """Shapes off shared storage are told of once, before anything is handed out."""
    with pytest.raises(ClusterError, match=r"cannot read .*gone.obj; workers need the same files"):
        list(executor(cluster).run(print, [Item("0", tmp_path / "gone.obj")]))


def test_killed_worker_costs_no_task(cluster):
    """A worker that is killed in the middle loses nothing, the tasks it had included."""
    victim = cluster.processes[1]
    tasks = [f"__import__('time').sleep(0.1) or {i}" for i in range(20)]
    results = []
    for _, result, reason in executor(cluster).run(eval, tasks):
        assert reason == ""
        results.append(result)
        if len(results) == 3:
            victim.send_signal(signal.SIGKILL)
    assert sorted(results) == list(range(20))


def test_task_that_kills_its_workers_is_given_up(cluster):
    """A task that takes its worker down fails with a reason."""
    cluster.add_workers(2)
    deadly = "__import__('os')._exit(1)"
    [(_, result, reason)] = executor(cluster, retries=0).run(eval, [deadly])
    assert (result, reason) == (None, "its worker died each time, perhaps for want of memory")


def test_lost_scheduler_is_told_in_one_line(cluster):
    """When the scheduler dies, the work ends with a word on how to go on."""
    tasks = [f"__import__('time').sleep(0.1) or {i}" for i in range(50)]
    outcomes = executor(cluster).run(eval, tasks)
    next(outcomes)
    cluster.processes[0].kill()
    with pytest.raises(ClusterError, match="the scheduler is gone; what was written stays"):
        list(outcomes)


def test_nobody_at_the_address(monkeypatch):
    """An address without a scheduler is refused within seconds, and one of another kind at once."""
    for address in ("http://127.0.0.1:1", "tcp://", "tcp://host", "head:8786"):
        with pytest.raises(ClusterError, match="expected the address of a Dask scheduler"):
            list(ClusterExecutor(address).run(eval, ["1"]))
    monkeypatch.setattr("spem.index.cluster.CONNECT", 0.2)
    with pytest.raises(ClusterError, match="no Dask scheduler answers there"):
        list(ClusterExecutor("tcp://127.0.0.1:1").run(eval, ["1"]))


def test_nothing_to_do_needs_no_cluster():
    """Without tasks nothing is connected to."""
    assert list(ClusterExecutor("tcp://127.0.0.1:1").run(eval, [])) == []
    assert issubclass(ClusterError, spem.SpemError)
