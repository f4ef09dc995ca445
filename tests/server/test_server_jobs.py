"""Jobs: a bounded queue, cancelling, results for a while, and what a restart finds."""

from __future__ import annotations

import json
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from spem.errors import ParameterError, QueueFullError, ReadError, SandboxError
from spem.index.row import Row
from spem.server.jobs import Jobs
from spem.server.spool import Job, Spool
from spem.server.tasks import pack_rows

HEADER = {"name": "a.png", "model": "m"}
ROW = Row("ab", "ab", "a", "a.png", np.ones(3, np.float32), ndim=2, shape=b"packed")


class Workers:
    """Stands for a sandbox: tasks wait until they are let go, or end with an error."""

    n_workers = 1

    def __init__(self) -> None:
        self.go = threading.Event()
        self.errors: list[Exception] = []
        self.begun = 0

    def run(self, _: str, header: dict[str, Any], payload: bytes, **told: Any) -> Any:
        """Wait, and give a row."""
        self.begun += 1
        assert header["model_file"].endswith("m.spem")
        assert payload == b"file"
        told["progress"]("coding", 0.5)
        while not self.go.wait(0.01):
            if told["cancelled"].is_set():
                raise SandboxError("cancelled", "cancelled")  # noqa: EM101
        if self.errors:
            raise self.errors.pop(0)
        return pack_rows([ROW])


class Models:
    """Stands for an index: it has a model of any digest, which is an empty file."""

    def model(self, _: str) -> Models:
        """Return a model."""
        return self

    def save(self, path: Path) -> None:
        """Write it."""
        path.touch()


@pytest.fixture
def workers() -> Workers:
    """Return workers that wait."""
    return Workers()


@pytest.fixture
def start(tmp_path: Path, workers: Workers) -> Iterator[Callable[..., Jobs]]:
    """Yield a function that starts jobs in one folder."""
    started: list[Jobs] = []

    def begin(**options: Any) -> Jobs:
        steps = {"encode": lambda job, rows: {"name": rows[0].name, "id": job.id}}
        jobs = Jobs(tmp_path, workers, Models(), steps, **options)  # type: ignore[arg-type]
        started.append(jobs)
        return jobs

    yield begin
    workers.go.set()
    for jobs in started:
        jobs.close(5.0)


def over(jobs: Jobs, job: str) -> dict[str, Any]:
    """Wait for the end of a job."""
    end = time.monotonic() + 60
    while (status := jobs.status(job))["state"] in ("queued", "running"):
        assert time.monotonic() < end
        time.sleep(0.005)
    return status


def running(jobs: Jobs, job: str) -> None:
    """Wait until a job is under way."""
    end = time.monotonic() + 60
    while jobs.status(job)["stage"] != "coding":
        assert time.monotonic() < end
        time.sleep(0.005)


def test_a_job_tells_its_stage_and_gives_its_result(start: Callable[..., Jobs], workers: Workers) -> None:
    """From the queue through its stages to the result, with the rows of the file."""
    jobs = start()
    first, second = (jobs.submit("encode", HEADER, b"file") for _ in range(2))
    running(jobs, first)
    assert jobs.status(first)["progress"] == 0.5
    assert (jobs.status(second)["state"], jobs.status(second)["position"]) == ("queued", 1)
    with pytest.raises(ReadError, match="is running"):
        jobs.rows(first)
    workers.go.set()
    assert over(jobs, second)["result"] == {"name": "a", "id": second}
    assert jobs.rows(first)[0].shape == b"packed"
    assert jobs.stats()["done"] == 2
    assert not jobs.cancel(first)


def test_the_queue_is_bounded(start: Callable[..., Jobs]) -> None:
    """One too many is told when to come again, and leaves nothing behind."""
    jobs = start(queue=2)
    running(jobs, jobs.submit("encode", HEADER, b"file"))
    for _ in range(2):
        jobs.submit("encode", HEADER, b"file")
    with pytest.raises(QueueFullError, match="2 jobs wait already") as caught:
        jobs.submit("encode", HEADER, b"file")
    assert caught.value.seconds > 0
    with pytest.raises(ParameterError, match="no job of kind 'dance'"):
        jobs.submit("dance", HEADER, b"file")
    assert jobs.stats()["queued"] == 2


def test_one_client_gets_half_of_the_queue(start: Callable[..., Jobs]) -> None:
    """Who has filled his half is told to wait; others still have room."""
    jobs = start(queue=4)
    running(jobs, jobs.submit("encode", HEADER, b"file", "192.0.2.1"))
    for _ in range(2):
        jobs.submit("encode", HEADER, b"file", "192.0.2.1")
    with pytest.raises(QueueFullError, match="2 jobs wait already"):
        jobs.submit("encode", HEADER, b"file", "192.0.2.1")
    jobs.submit("encode", HEADER, b"file", "192.0.2.2")
    assert jobs.stats()["queued"] == 3


def test_jobs_are_cancelled_wherever_they_are(start: Callable[..., Jobs], tmp_path: Path) -> None:
    """A running job stops its task, a waiting one leaves the queue; the files of both go."""
    jobs = start()
    first, second = (jobs.submit("encode", HEADER, b"file") for _ in range(2))
    running(jobs, first)
    assert jobs.cancel(second)
    assert jobs.cancel(first)
    assert {over(jobs, job)["state"] for job in (first, second)} == {"cancelled"}
    jobs.close(5.0)
    assert not list(tmp_path.glob("*.bin"))
    with pytest.raises(ReadError, match="no such job"):
        jobs.cancel("../../etc/passwd")


def test_a_dead_worker_is_forgiven_once(start: Callable[..., Jobs], workers: Workers) -> None:
    """A job whose process died is tried again, and given up when it dies again."""
    workers.go.set()
    workers.errors = [SandboxError("died", "died")]
    jobs = start()
    assert over(jobs, jobs.submit("encode", HEADER, b"file"))["state"] == "done"
    workers.errors = [SandboxError("died", "died")] * 2
    status = over(jobs, jobs.submit("encode", HEADER, b"file"))
    assert (status["state"], status["error"]) == ("failed", "died")
    workers.errors = [SandboxError("too slow", "time"), ReadError("a.png: damaged"), KeyError("x")]
    found = [over(jobs, jobs.submit("encode", HEADER, b"file"))["error"] for _ in range(3)]
    assert found == ["too slow", "a.png: damaged", "unexpected KeyError: 'x'; please report it"]
    assert workers.begun == 7


def test_what_was_not_done_is_taken_up_again(start: Callable[..., Jobs], workers: Workers) -> None:
    """A clean end puts a running job back without blame; results outlive it too."""
    jobs = start()
    workers.go.set()
    done = jobs.submit("encode", HEADER, b"file")
    over(jobs, done)
    workers.go.clear()
    job = jobs.submit("encode", HEADER, b"file")
    running(jobs, job)
    jobs.close(0.0)
    with pytest.raises(QueueFullError, match="going down"):
        jobs.submit("encode", HEADER, b"file")
    again = start()
    running(again, job)
    workers.go.set()
    assert over(again, job)["state"] == "done"
    assert again.rows(done)[0].name == "a"


def test_a_job_that_took_the_server_down_twice_is_given_up(
    start: Callable[..., Jobs], tmp_path: Path, workers: Workers
) -> None:
    """What was running when the server died is tried once more; damaged records are swept away."""
    workers.go.set()
    spool = Spool(tmp_path)
    once, twice, damaged, odd, left = (digit * 24 for digit in "abcde")
    for name, attempts in ((once, 1), (twice, 2)):
        spool.save_payload(name, b"file")
        spool.save(Job(name, "encode", HEADER, time.time(), state="running", attempts=attempts))
    spool.save(Job(odd, "encode", HEADER, None))  # type: ignore[arg-type]
    spool.close()
    (tmp_path / f"{damaged}.json").write_text("{", encoding="utf-8")
    (tmp_path / f"{left}.bin").write_bytes(b"left")
    (tmp_path / f".{left}.json.01234567").write_bytes(b"half")
    jobs = start()
    assert over(jobs, once)["state"] == "done"
    assert "given up after 2 attempts" in over(jobs, twice)["error"]
    jobs.close(5.0)
    assert {file.stem for file in tmp_path.iterdir() if file.is_file()} == {once, twice, "lock"}
    assert json.loads((tmp_path / f"{twice}.json").read_bytes())["state"] == "failed"


def test_files_that_are_no_jobs_stay(start: Callable[..., Jobs], tmp_path: Path) -> None:
    """A folder that was given for jobs by mistake keeps what it holds."""
    theirs = [tmp_path / name for name in ("thesis.tex", "package.json", ".profile", "aa.bin")]
    for file in theirs:
        file.write_text("{}", encoding="utf-8")
    (tmp_path / f"{'f' * 24}.json").mkdir()
    start()
    assert all(file.read_text(encoding="utf-8") == "{}" for file in theirs)


def test_results_are_kept_for_a_while(start: Callable[..., Jobs], workers: Workers, tmp_path: Path) -> None:
    """Beyond a number and an age finished jobs are forgotten, with their files."""
    workers.go.set()
    jobs = start(keep=2)
    made = [jobs.submit("encode", HEADER, b"file") for _ in range(4)]
    for job in made:
        over(jobs, job)
    last = jobs.submit("encode", HEADER, b"file")
    over(jobs, last)
    jobs.close(5.0)
    assert len(list(tmp_path.glob("*.rows"))) <= 3
    old = start(keep_seconds=0.0)
    with pytest.raises(ReadError, match="for a while only"):
        old.status(last)


def test_a_folder_has_one_server(start: Callable[..., Jobs], tmp_path: Path) -> None:
    """Two servers on one folder would run jobs twice; the second is refused."""
    start()
    with pytest.raises(ParameterError, match="another server uses this folder"):
        Spool(tmp_path)
    (tmp_path / "file").touch()
    with pytest.raises(ParameterError, match="cannot be written"):
        Spool(tmp_path / "file")


def test_a_job_cancelled_before_its_step_takes_none(
    start: Callable[..., Jobs], workers: Workers, monkeypatch: pytest.MonkeyPatch
) -> None:
    """What is cancelled once the file is encoded is cancelled too, and nothing comes of it."""
    jobs = start()
    save_rows = Spool.save_rows

    def cancelled(spool: Spool, job_id: str, rows: list[Row]) -> None:
        save_rows(spool, job_id, rows)
        assert jobs.cancel(job_id)

    monkeypatch.setattr(Spool, "save_rows", cancelled)
    workers.go.set()
    job = jobs.submit("encode", HEADER, b"file")
    done = over(jobs, job)
    assert (done["state"], done["result"]) == ("cancelled", None)


def test_a_disk_that_fails_costs_no_thread(
    start: Callable[..., Jobs], workers: Workers, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Where a file cannot be removed the job is done all the same, and the next one runs."""

    def fails(*_: object) -> None:
        raise OSError(5, "Input/output error")

    jobs = start()
    workers.go.set()
    monkeypatch.setattr(Spool, "drop_payload", fails)
    for _ in range(2):
        assert over(jobs, jobs.submit("encode", HEADER, b"file"))["state"] == "done"
