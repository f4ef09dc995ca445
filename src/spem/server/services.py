"""What the routes of one server share: the index, threads, processes, jobs, caches and figures."""

from __future__ import annotations

import asyncio
import contextlib
import tempfile
from pathlib import Path
from typing import Annotated

from fastapi import Depends, Request

from spem.index.index import Index
from spem.index.row import Row
from spem.server.cache import Cache
from spem.server.catalogue import Catalogue
from spem.server.forms import Forms
from spem.server.jobs import Jobs
from spem.server.lanes import Lane
from spem.server.limits import Rate
from spem.server.metrics import Metrics
from spem.server.options import ServerOptions
from spem.server.sandbox import Sandbox
from spem.server.submissions import UPLOAD, Submissions
from spem.server.viewing import Viewing

_READERS = 4
_READS_WAITING = 256


class Services:
    """The live parts of a server; made with it, started and closed with its process.

    Parameters
    ----------
    index
        The index that is served.
    options
        The settings of the server.
    """

    sandbox: Sandbox
    jobs: Jobs
    viewing: Viewing

    def __init__(self, index: Index, options: ServerOptions) -> None:
        self.options = options
        self.catalogue = Catalogue(index)
        self.submissions = Submissions(self.catalogue)
        self.reads = Lane("read", _READERS, _READS_WAITING)
        self.views = Lane("view", options.n_workers, options.queue)
        self.kept = Cache(options.view_bytes)
        self.rate = Rate(options.rate)
        self.forms = Forms(options.proxies)
        self.metrics = Metrics(self._readings)
        self._open = contextlib.ExitStack()
        self._started = False

    async def start(self) -> None:
        """Start worker processes, take up jobs of an earlier run, and warm the index."""
        try:
            await self._bring_up()
        except BaseException:
            await asyncio.to_thread(self._open.close)
            raise
        self._started = True

    async def _bring_up(self) -> None:
        """Start what has to be closed again."""
        options = self.options
        folder = options.state or Path(self._open.enter_context(tempfile.TemporaryDirectory(prefix="spem-")))
        self.sandbox = Sandbox(options.n_workers, options.memory, options.seconds)
        self._open.callback(self.sandbox.close)
        for lane in (self.reads, self.views):
            self._open.callback(lane.close)
        self.viewing = Viewing(self.sandbox, self.kept, self.views)
        index, steps = self.catalogue.index, self.submissions.steps
        self.jobs = Jobs(folder, self.sandbox, index, steps, queue=options.queue)
        self._open.callback(self.jobs.close, options.finish_seconds)
        await self.reads.run(self.catalogue.models)

    async def close(self) -> None:
        """Finish jobs or put them back, then end worker processes and threads."""
        self._started = False
        await asyncio.to_thread(self._open.close)

    @property
    def ready(self) -> bool:
        """Whether the index is open and worker processes run."""
        return self._started and self.sandbox.ready()

    def row(self, model: str | None, key: str, *columns: str) -> tuple[str, Row]:
        """Return the model and the row of a shape of the index, or of an upload; it may block.

        Raises
        ------
        Refusal
            When there is none.
        """
        if key.startswith(UPLOAD):
            return self.submissions.found(self.jobs, key)
        digest = self.catalogue.digest(model, key)
        return digest, self.catalogue.row(digest, key, *columns)

    def _readings(self) -> dict[str, tuple[str, float]]:
        """Return the figures of the moment."""
        shapes = sum(entry.n_shapes for entry in self.catalogue.models())
        figures: dict[str, tuple[str, float]] = {
            "spem_index_shapes": ("Shapes of the index, over all models.", shapes),
            "spem_reads_inside": ("Reads of the index that run or wait.", self.reads.inside),
            "spem_views_inside": ("Views that are computed or wait.", self.views.inside),
            "spem_view_cache_bytes": ("Memory of computed views.", self.kept.n_bytes),
        }
        for state, count in self.jobs.stats().items():
            figures[f"spem_jobs_{state}"] = (f"Jobs that are {state}.", count)
        for name, count in self.sandbox.stats().items():
            figures[f"spem_sandbox_{name}"] = (f"Worker processes and their tasks: {name}.", count)
        return figures


async def services_of(request: Request) -> Services:
    """Return the services of the app that a request came to."""
    found: Services = request.app.state.services
    return found


Live = Annotated[Services, Depends(services_of)]
