"""What the routes of one server share: the index, threads, processes, jobs, caches and figures."""

from __future__ import annotations

from typing import Annotated

from fastapi import Depends, Request

from spem.index.index import Index
from spem.server.cache import Cache
from spem.server.catalogue import Catalogue
from spem.server.lanes import Lane
from spem.server.limits import Rate
from spem.server.metrics import Metrics
from spem.server.options import ServerOptions

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

    def __init__(self, index: Index, options: ServerOptions) -> None:
        self.options = options
        self.catalogue = Catalogue(index)
        self.reads = Lane("read", _READERS, _READS_WAITING)
        self.rate = Rate(options.rate)
        self.views = Cache(options.view_bytes)
        self.metrics = Metrics(self._readings)
        self.ready = False

    async def start(self) -> None:
        """Warm the index, then say that the server is ready."""
        await self.reads.run(self.catalogue.models)
        self.ready = True

    async def close(self) -> None:
        """Let go of threads and processes."""
        self.ready = False
        self.reads.close()

    def _readings(self) -> dict[str, tuple[str, float]]:
        """Return the figures of the moment."""
        shapes = sum(entry.n_shapes for entry in self.catalogue.models())
        return {
            "spem_index_shapes": ("Shapes of the index, over all models.", shapes),
            "spem_reads_inside": ("Reads of the index that run or wait.", self.reads.inside),
            "spem_view_cache_bytes": ("Memory of computed views.", self.views.n_bytes),
        }


async def services_of(request: Request) -> Services:
    """Return the services of the app that a request came to."""
    found: Services = request.app.state.services
    return found


Live = Annotated[Services, Depends(services_of)]
