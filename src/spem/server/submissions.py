"""What becomes of the file of a client: a search, a code, or new rows; and its shape while it is kept."""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from spem.errors import ReadError
from spem.index.row import UPLOADED, Row
from spem.server.cards import card, full_card, ranking
from spem.server.catalogue import Catalogue
from spem.server.refusals import Refusal
from spem.server.remembered import Remembered

if TYPE_CHECKING:
    from spem.server.jobs import Jobs, Step
    from spem.server.spool import Job

# Before the id of a job: the id of the shape that it brought.
UPLOAD = "upload-"
_KEPT_ROWS, _KEPT_SECONDS = 32, 300.0


class Submissions:
    """The steps of jobs, and the shapes that they brought.

    Parameters
    ----------
    catalogue
        The index that is asked and written.
    """

    def __init__(self, catalogue: Catalogue) -> None:
        self._catalogue = catalogue
        self._rows = Remembered(_KEPT_ROWS, _KEPT_SECONDS)

    @property
    def steps(self) -> Mapping[str, Step]:
        """What is done with the rows of a file, by kind of job."""
        return {"search": self._search, "encode": self._encode, "add": self._add}

    def found(self, jobs: Jobs, key: str) -> tuple[str, Row]:
        """Return the model and the row of an upload.

        Raises
        ------
        Refusal
            When it is not kept any more, or not done.
        """
        name = key.removeprefix(UPLOAD)
        try:
            found: tuple[str, Row] = self._rows.get(name, lambda: self._read(jobs, name))
        except ReadError as error:
            raise Refusal(404, "no such upload; uploads are kept for an hour") from error
        return found

    def _read(self, jobs: Jobs, name: str) -> tuple[str, Row]:
        """Read the first row of a job."""
        [row, *_] = jobs.rows(name)
        result = jobs.status(name)["result"]
        return str(result["model"]), replace(row, id=UPLOAD + name)

    def _search(self, job: Job, rows: list[Row]) -> dict[str, Any]:
        """Return the shapes nearest to that of a file."""
        begin = time.perf_counter()
        header = job.header
        answers = self._catalogue.index.search(
            rows[0].code, int(header["k"]), where=header["where"], model=header["model"]
        )
        query = full_card(replace(rows[0], id=UPLOAD + job.id), header["model"])
        return ranking(query, answers, time.perf_counter() - begin)

    def _encode(self, job: Job, rows: list[Row]) -> dict[str, Any]:
        """Return the code of the shape of a file."""
        shape = full_card(replace(rows[0], id=UPLOAD + job.id), job.header["model"])
        codes = {"code": rows[0].code.tolist(), "model": job.header["model"], "shape": shape}
        more = [{"name": row.name, "code": row.code.tolist()} for row in rows[1:]]
        return codes | ({"more": more} if more else {})

    def _add(self, job: Job, rows: list[Row]) -> dict[str, Any]:
        """Write the rows of a file into the index."""
        header, index = job.header, self._catalogue.index
        fields = {"label": header["label"], "metadata": header["metadata"]}
        # No path of this host: two files of one name are two, and none is looked for.
        written = [replace(row, path=f"{UPLOADED}{row.hash[:12]}/{row.path}", **fields) for row in rows]
        index.store.write(written, index.model(header["model"]))
        self._catalogue.changed()
        told = {"shape": card(written[0]), "model": header["model"]}
        return told | ({"more": [card(row) for row in written[1:]]} if written[1:] else {})
