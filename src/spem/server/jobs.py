"""Jobs in the background: a bounded queue, progress, cancelling, and taking up again after a restart."""

from __future__ import annotations

import logging
import secrets
import threading
import time
from collections import deque
from collections.abc import Callable, Mapping
from pathlib import Path
from types import MappingProxyType
from typing import Any, TypeAlias

from spem.codes.workers import one_line
from spem.errors import ParameterError, QueueFullError, ReadError, SandboxError, SpemError
from spem.index.index import Index
from spem.index.row import Row
from spem.server.sandbox import Sandbox
from spem.server.spool import OVER, Job, Spool, expired

# What becomes, in the server, of the rows that a worker made: the result that the client gets.
Step: TypeAlias = Callable[[Job, list[Row]], dict[str, Any]]

# A job that took its worker or the server down so often is given up.
_MOST_ATTEMPTS = 2
# Seconds between two looks at what has expired.
_SWEEP = 30.0
_ID_BYTES = 12
# Seconds of a job, before one was measured.
_GUESS = 5.0
_log = logging.getLogger("spem.server")


class Jobs:
    """Files sent by clients, encoded in a sandbox one after another.

    A job is first a file in the spool, then in the queue; so it outlives the server. One that took its worker
    or the server down twice is given up. All methods may be called from any thread.

    Parameters
    ----------
    folder
        Of the spool.
    sandbox
        Where files are read.
    index
        Whose models encode them: ``header["model"]`` of a job names one by its digest.
    steps
        For each kind of job, what is done with the rows of its file.
    queue
        Number of jobs that may wait.
    n_threads
        Number of jobs that run at once; all workers but one by default, which is left to views.
    keep, keep_seconds
        How many finished jobs are kept, and for how long.

    Raises
    ------
    ParameterError
        When the folder cannot be used.
    """

    def __init__(
        self,
        folder: str | Path,
        sandbox: Sandbox,
        index: Index,
        steps: Mapping[str, Step],
        *,
        queue: int = 16,
        n_threads: int | None = None,
        keep: int = 1000,
        keep_seconds: float = 3600.0,
    ) -> None:
        self._spool, self._sandbox, self._index = Spool(folder), sandbox, index
        self._steps = MappingProxyType(dict(steps))
        self._queue_length, self._keep, self._keep_seconds = queue, keep, keep_seconds
        self._changed = threading.Condition()
        self._model_lock = threading.Lock()
        self._jobs: dict[str, Job] = {}
        self._waiting: deque[str] = deque()
        self._stops: dict[str, threading.Event] = {}
        self._closing = self._requeue = False
        self._mean_seconds = _GUESS
        self._resume()
        count = max(1, sandbox.n_workers - 1) if n_threads is None else n_threads
        self._threads = [
            threading.Thread(target=self._work, name=f"spem-job-{i}", daemon=True) for i in range(count)
        ]
        for thread in self._threads:
            thread.start()

    def submit(self, kind: str, header: Mapping[str, Any], payload: bytes, client: str = "") -> str:
        """Queue a file.

        Parameters
        ----------
        kind
            A key of the steps.
        header
            ``name`` of the file, ``model`` (a digest), what else `spem.server.tasks.encode` takes, and what
            the step of this kind needs: values that `json` can write.
        payload
            The bytes of the file.
        client
            Who sent it; one client gets half of the queue at most.

        Returns
        -------
        str
            The id of the job.

        Raises
        ------
        QueueFullError
            When too many jobs wait, the disk is full, or the server is going down.
        ParameterError
            When there is no such kind.
        """
        if kind not in self._steps:
            msg = f"no job of kind {kind!r}; expected one of {', '.join(self._steps)}"
            raise ParameterError(msg)
        job = Job(secrets.token_hex(_ID_BYTES), kind, dict(header), time.time(), client=client)
        self._sweep()
        with self._changed:
            self._check_room(client)
            # holds its place while the file is written
            self._jobs[job.id] = job
            self._waiting.append(job.id)
        try:
            self._spool.save_payload(job.id, payload)
            self._spool.save(job)
        except SpemError as error:
            self._forget(job.id)
            _log.error("job %s: %s", job.id, error)
            msg = "the server has no room for this file; try again later"
            raise QueueFullError(msg, self._mean_seconds) from error
        with self._changed:
            if job.id in self._jobs:
                self._stops[job.id] = threading.Event()
            self._changed.notify()
        return job.id

    def status(self, job_id: str) -> dict[str, Any]:
        """Return what is known of a job, as JSON has it.

        Raises
        ------
        ReadError
            When there is none, or it has expired.
        """
        with self._changed:
            job = self._known(job_id)
            place = self._waiting.index(job_id) + 1 if job_id in self._waiting else 0
        return {
            "id": job.id,
            "kind": job.kind,
            "state": job.state,
            "stage": job.stage,
            "progress": round(job.progress, 3),
            "position": place,
            "error": job.error or None,
            "result": None if job.result is None else dict(job.result),
        }

    def rows(self, job_id: str) -> list[Row]:
        """Return the rows that were made of the file of a job.

        Raises
        ------
        ReadError
            When there is no such job, or it is not done.
        """
        with self._changed:
            job = self._known(job_id)
        if job.state != "done":
            msg = f"job {job.id} is {job.state}; its shape is there when it is done"
            raise ReadError(msg)
        return self._spool.rows(job.id)

    def cancel(self, job_id: str) -> bool:
        """Stop a job, and the worker that it runs in; tell whether there was anything to stop.

        Raises
        ------
        ReadError
            When there is none.
        """
        with self._changed:
            job = self._known(job_id)
            if job.state in OVER:
                return False
            if job_id not in self._waiting:
                self._stops[job_id].set()
                return True
            self._waiting.remove(job_id)
            job = self._put(job.with_(state="cancelled", finished=time.time()))
        self._save(job)
        self._spool.drop_payload(job_id)
        return True

    def stats(self) -> dict[str, int]:
        """Return how many jobs there are in each state."""
        with self._changed:
            states = [job.state for job in self._jobs.values()]
        return {state: states.count(state) for state in ("queued", "running", *OVER)}

    def model_file(self, digest: str) -> Path:
        """Return the file of a model of the index, for tasks of the sandbox.

        Raises
        ------
        ModelError
            When the index has no such model.
        """
        with self._model_lock:
            return self._spool.model_file(digest, self._index.model)

    def close(self, finish_seconds: float = 10.0) -> None:
        """Take no more jobs, let running ones finish for a while, and leave the rest to the next start."""
        with self._changed:
            self._closing = True
            self._changed.notify_all()
        end = time.monotonic() + finish_seconds
        for thread in self._threads:
            thread.join(max(0.0, end - time.monotonic()))
        with self._changed:
            self._requeue = True
            for stop in self._stops.values():
                stop.set()
        for thread in self._threads:
            thread.join()
        self._spool.close()

    def _work(self) -> None:
        """Run one job after another until the server goes down."""
        while True:
            with self._changed:
                if not self._closing and not self._next_ready():
                    self._changed.wait(_SWEEP)
                if self._closing:
                    return
                job = self._begin() if self._next_ready() else None
            began = time.monotonic()
            try:
                self._sweep()
                if job is None:
                    continue
                self._save(job)
                self._run(job)
            except Exception:  # noqa: BLE001 a disk that fails must not end the thread
                _log.exception("jobs")
            self._mean_seconds += 0.2 * (time.monotonic() - began - self._mean_seconds)

    def _begin(self) -> Job:
        """Take the next job out of the queue."""
        job = self._jobs[self._waiting.popleft()]
        return self._put(job.with_(state="running", started=time.time(), attempts=job.attempts + 1))

    def _next_ready(self) -> bool:
        """Tell whether a job waits whose file is written."""
        return bool(self._waiting) and self._waiting[0] in self._stops

    def _run(self, job: Job) -> None:
        """Encode the file of a job, and take the step of its kind."""
        try:
            rows = self._encode(job)
            self._progress(job.id, "finishing", 1.0)
            self._spool.save_rows(job.id, rows)
            self._require_wanted(job.id)
            result = self._steps[job.kind](job, rows)
            over = job.with_(state="done", stage="", progress=1.0, result=result)
        except SandboxError as error:
            if error.detail:
                _log.error("job %s: %s", job.id, error.detail)
            outcome = self._stopped(job, error)
            if outcome is None:
                return
            over = outcome
        except Exception as error:  # noqa: BLE001 a job that fails must not end the thread
            if not isinstance(error, SpemError):
                _log.exception("job %s", job.id)
            over = job.with_(state="failed", error=one_line(error))
        self._save(self._put(over.with_(finished=time.time())))
        self._spool.drop_payload(job.id)

    def _encode(self, job: Job) -> list[Row]:
        """Make the rows of the file of a job in the sandbox."""
        from spem.server.tasks import unpack_rows

        header = dict(job.header) | {"model_file": str(self.model_file(str(job.header["model"])))}
        return unpack_rows(
            *self._sandbox.run(
                "encode",
                header,
                self._spool.payload(job.id),
                cancelled=self._stops[job.id],
                progress=lambda stage, share: self._progress(job.id, stage, share),
            )
        )

    def _require_wanted(self, job_id: str) -> None:
        """Stop before the step of a job that was cancelled after its file was encoded."""
        if self._stops[job_id].is_set():
            msg = "cancelled"
            raise SandboxError(msg, "cancelled")

    def _stopped(self, job: Job, error: SandboxError) -> Job | None:
        """Say what becomes of a job whose task was stopped; None when it waits again."""
        if error.reason == "closed" or (error.reason == "cancelled" and self._requeue):
            # that the server goes down is no fault of the job
            self._save(self._put(job.with_(state="queued", attempts=job.attempts - 1)))
            return None
        if error.reason == "cancelled":
            return job.with_(state="cancelled")
        if error.reason == "died" and job.attempts < _MOST_ATTEMPTS:
            again = job.with_(state="queued", stage="again")
            self._save(again)
            with self._changed:
                self._put(again)
                self._waiting.appendleft(job.id)
                self._changed.notify()
            return None
        return job.with_(state="failed", error=one_line(error))

    def _resume(self) -> None:
        """Take up the jobs of an earlier server."""
        for job in self._spool.load():
            self._jobs[job.id] = job
            if job.state in OVER:
                continue
            if job.kind not in self._steps or job.attempts >= _MOST_ATTEMPTS:
                why = (
                    f"given up after {job.attempts} attempts, which the server or its worker did not survive"
                )
                self._save(self._put(job.with_(state="failed", error=why, finished=time.time())))
                self._spool.drop_payload(job.id)
                continue
            self._save(self._put(job.with_(state="queued", stage="", progress=0.0)))
            self._waiting.append(job.id)
            self._stops[job.id] = threading.Event()
        self._sweep()

    def _put(self, job: Job) -> Job:
        """Note a change of state in memory."""
        with self._changed:
            self._jobs[job.id] = job
            if job.state in OVER:
                self._stops.pop(job.id, None)
        return job

    def _save(self, job: Job) -> None:
        """Note a change of state in the spool, outside the lock: a disk may take its time."""
        try:
            self._spool.save(job)
        except (SpemError, OSError, ValueError) as error:
            _log.error("job %s: %s", job.id, error)

    def _progress(self, job_id: str, stage: str, share: float) -> None:
        """Note progress, which no file needs to know."""
        with self._changed:
            job = self._jobs[job_id]
            if job.state == "running":
                self._jobs[job_id] = job.with_(stage=stage, progress=share)

    def _check_room(self, client: str) -> None:
        """Refuse another job when too many wait, or too many of one client, or the server goes down."""
        if self._closing:
            msg = "the server is going down; try again later"
            raise QueueFullError(msg, _GUESS)
        of_client = sum(self._jobs[key].client == client for key in self._waiting) if client else 0
        if len(self._waiting) >= self._queue_length or 2 * of_client >= self._queue_length:
            msg = f"{len(self._waiting)} jobs wait already; try again later"
            raise QueueFullError(msg, self._mean_seconds * len(self._waiting) / max(1, len(self._threads)))

    def _sweep(self) -> None:
        """Forget jobs that were finished long ago, and the oldest of too many."""
        with self._changed:
            jobs = list(self._jobs.values())
        for job in expired(jobs, self._keep, time.time() - self._keep_seconds):
            self._forget(job.id)

    def _forget(self, job_id: str) -> None:
        """Remove a job from memory and from the spool."""
        with self._changed:
            self._jobs.pop(job_id, None)
            self._stops.pop(job_id, None)
            if job_id in self._waiting:
                self._waiting.remove(job_id)
        self._spool.remove(job_id)

    def _known(self, job_id: str) -> Job:
        """Return a job by its id."""
        job = self._jobs.get(job_id)
        if job is None:
            msg = "no such job; results are kept for a while only"
            raise ReadError(msg)
        return job
