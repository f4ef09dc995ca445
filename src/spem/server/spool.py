"""A folder of jobs: what was asked, how far it is, what came of it; each file is whole or not there."""

from __future__ import annotations

import contextlib
import fcntl
import json
import os
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import IO, Any, Literal

from spem.codes.model import Model
from spem.errors import ParameterError, ReadError
from spem.files import DAMAGE, write_whole
from spem.index.row import Row
from spem.server.arrays import pack_arrays, unpack_arrays
from spem.server.tasks import pack_rows, unpack_rows

# What jobs are kept under, and under what `write_whole` has them before they are whole.
_OWN = re.compile(r"[0-9a-f]{24}\.(json|bin|rows)|\.[0-9a-f]{24}\.(json|bin|rows)\.[0-9a-f]{8}")

State = Literal["queued", "running", "done", "failed", "cancelled"]
OVER: tuple[State, ...] = ("done", "failed", "cancelled")


@dataclass(frozen=True)
class Job:
    """A file that a client sent, and what is to be done with it.

    Parameters
    ----------
    id
        Random hex digits, so that only who sent it can ask for it.
    kind
        What is done: a key of the steps that `spem.server.jobs.Jobs` knows.
    header
        Arguments: of the encoding, and of the kind.
    submitted, started, finished
        Seconds since 1970; 0 where it has not come to that.
    state, stage, progress
        How far it is; the progress runs from 0 to 1.
    attempts
        How often it was begun without coming to an end.
    error
        One line, where it failed.
    result
        What the client gets, where it is done.
    client
        Who sent it, where that is known.
    """

    id: str
    kind: str
    header: Mapping[str, Any]
    submitted: float
    started: float = 0.0
    finished: float = 0.0
    state: State = "queued"
    stage: str = ""
    progress: float = 0.0
    attempts: int = 0
    error: str = ""
    result: Mapping[str, Any] | None = field(default=None, repr=False)
    client: str = field(default="", repr=False)

    def with_(self, **changes: Any) -> Job:
        """Return the job with changes."""
        return replace(self, **changes)


def expired(jobs: Sequence[Job], keep: int, before: float) -> list[Job]:
    """Return the jobs that are over and were finished before a time, or are older than the latest to keep."""
    over = sorted((job for job in jobs if job.state in OVER), key=lambda job: job.finished, reverse=True)
    return [job for place, job in enumerate(over) if place >= keep or job.finished < before]


def _job(file: Path) -> Job | None:
    """Read the record of a job, or None where it is damaged."""
    try:
        job = Job(**json.loads(file.read_bytes()))
        values = (job.submitted, job.started, job.finished, job.progress, job.attempts)
    except DAMAGE:
        return None
    plain = all(isinstance(value, int | float) for value in values) and isinstance(job.header, dict)
    return job if plain and job.id == file.stem and job.state in ("queued", "running", *OVER) else None


class Spool:
    """The files of jobs in a folder that one server uses at a time.

    Parameters
    ----------
    folder
        Made where it is not there.

    Raises
    ------
    ParameterError
        When it cannot be made or written, or another server uses it.
    """

    def __init__(self, folder: str | Path) -> None:
        self.folder = Path(folder).resolve()
        try:
            (self.folder / "models").mkdir(parents=True, exist_ok=True, mode=0o700)
            self._lock: IO[bytes] = (self.folder / "lock").open("ab")
        except OSError as error:
            msg = f"{self.folder}: cannot be written ({error.strerror}); give a folder for jobs that can"
            raise ParameterError(msg) from error
        try:
            fcntl.flock(self._lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError as error:
            self._lock.close()
            msg = f"{self.folder}: another server uses this folder for its jobs; give another one"
            raise ParameterError(msg) from error

    def close(self) -> None:
        """Let another server have the folder."""
        self._lock.close()

    def save(self, job: Job) -> None:
        """Write what is known of a job."""
        text = json.dumps(asdict(job), allow_nan=False)
        write_whole(self._file(job.id, "json"), lambda file: file.write(text.encode()))

    def save_payload(self, job_id: str, payload: bytes) -> None:
        """Write the file that the client sent."""
        write_whole(self._file(job_id, "bin"), lambda file: file.write(payload))

    def payload(self, job_id: str) -> bytes:
        """Read the file that the client sent.

        Raises
        ------
        ReadError
            When it is gone.
        """
        return self._read(job_id, "bin")

    def save_rows(self, job_id: str, rows: Sequence[Row]) -> None:
        """Write the rows that were made of the file."""
        body = pack_arrays(*pack_rows(list(rows)))
        write_whole(self._file(job_id, "rows"), lambda file: file.write(body))

    def rows(self, job_id: str) -> list[Row]:
        """Read the rows that were made of the file.

        Raises
        ------
        ReadError
            When they are gone.
        """
        return unpack_rows(*unpack_arrays(self._read(job_id, "rows")))

    def drop_payload(self, job_id: str) -> None:
        """Remove the file that the client sent, which a finished job needs no more."""
        self._file(job_id, "bin").unlink(missing_ok=True)

    def remove(self, job_id: str) -> None:
        """Remove all of a job, its record first: what is left without one is swept up at the next start."""
        for kind in ("json", "bin", "rows"):
            self._file(job_id, kind).unlink(missing_ok=True)

    def load(self) -> list[Job]:
        """Read all jobs, the oldest first; their damaged files, and those of none, are removed.

        Files with names that no job has are not touched: the folder may hold what is somebody else's.
        """
        own = [file for file in self.folder.iterdir() if _OWN.fullmatch(file.name) and file.is_file()]
        jobs = {}
        for file in own:
            if file.suffix == ".json" and (job := _job(file)) is not None:
                jobs[job.id] = job
        for file in own:
            if file.name.startswith(".") or file.stem not in jobs:
                file.unlink(missing_ok=True)
        return sorted(jobs.values(), key=lambda job: job.submitted)

    def model_file(self, digest: str, load: Callable[[str], Model]) -> Path:
        """Return the file of a model, written when it is first asked for, where workers can read it."""
        file = self.folder / "models" / f"{digest}.spem"
        if not file.is_file():
            temporary = file.with_suffix(f".{os.getpid()}.spem")
            with contextlib.suppress(FileNotFoundError):
                load(digest).save(temporary)
                temporary.replace(file)
        return file

    def _file(self, job_id: str, kind: str) -> Path:
        """Return a file of a job; ids are made here, and none from outside comes this far."""
        return self.folder / f"{job_id}.{kind}"

    def _read(self, job_id: str, kind: str) -> bytes:
        """Read a file of a job."""
        try:
            return self._file(job_id, kind).read_bytes()
        except OSError as error:
            msg = f"job {job_id}: its file is gone; send it again"
            raise ReadError(msg) from error
