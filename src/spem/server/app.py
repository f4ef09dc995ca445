"""The app: routes, errors as JSON, and what is started and closed with it."""

from __future__ import annotations

import socket
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from http import HTTPStatus
from typing import cast

from fastapi import FastAPI, Request
from fastapi.exceptions import RequestValidationError
from starlette.exceptions import HTTPException
from starlette.responses import Response

from spem import __version__
from spem.errors import ParameterError, SpemError
from spem.index.index import Index
from spem.server import (
    routes_collection,
    routes_files,
    routes_jobs,
    routes_service,
    routes_shapes,
    routes_views,
)
from spem.server.logs import fail
from spem.server.middleware import Doorkeeper
from spem.server.options import ServerOptions
from spem.server.pages import page_routes
from spem.server.refusals import Refusal, error_response, refused
from spem.server.services import Services

_ABOUT = (
    "Shapes, their codes and views of them. Bodies of type application/vnd.spem.arrays are a JSON header and "
    "little-endian arrays, as spem.server.arrays says."
)
_TAGS = [
    {"name": "service", "description": "Health, readiness, figures."},
    {"name": "index", "description": "What is served."},
    {"name": "shapes", "description": "The shapes of the index."},
    {"name": "views", "description": "Fields, maps and parts of one shape."},
    {"name": "jobs", "description": "Uploads: search, encode, add; each is a job."},
]


def create_app(index: Index, options: ServerOptions | None = None) -> FastAPI:
    """Make the app that serves an index.

    Parameters
    ----------
    index
        The index.
    options
        The settings of the server.

    Examples
    --------
    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     app = create_app(Index.open(folder))
    >>> app.title
    'spem'
    """
    chosen = options or ServerOptions()
    services = Services(index, chosen)

    @asynccontextmanager
    async def life(_: FastAPI) -> AsyncIterator[None]:
        await services.start()
        yield
        await services.close()

    app = FastAPI(
        title="spem",
        version=__version__,
        description=_ABOUT,
        openapi_tags=_TAGS,
        docs_url=None,
        redoc_url=None,
        root_path=chosen.root_path,
        lifespan=life,
        redirect_slashes=False,
    )
    app.state.services = services
    # The files of a shape come last: their route has a place for any name.
    for routes in (
        routes_service,
        routes_collection,
        routes_shapes,
        routes_views,
        routes_jobs,
        routes_files,
    ):
        app.include_router(routes.router)
    app.include_router(page_routes())
    app.add_middleware(Doorkeeper, services=services, names=_names(chosen))
    app.add_exception_handler(Refusal, _on_refusal)
    app.add_exception_handler(HTTPException, _on_http)
    app.add_exception_handler(RequestValidationError, _on_values)
    app.add_exception_handler(SpemError, _on_spem)
    return app


def _names(options: ServerOptions) -> frozenset[str]:
    """Return the names that this server answers to."""
    own = ("localhost", options.host, *options.hosts)
    machine = () if options.loopback else (socket.gethostname(),)
    return frozenset(name.lower() for name in (*own, *machine))


async def _on_refusal(_: Request, error: Exception) -> Response:
    """Answer a refusal."""
    return refused(cast("Refusal", error))


async def _on_http(_: Request, error: Exception) -> Response:
    """Answer what the router has to say, such as that there is no such page."""
    told = cast("HTTPException", error)
    return error_response(told.status_code, HTTPStatus(told.status_code).phrase.lower(), told.headers)


async def _on_values(_: Request, error: Exception) -> Response:
    """Answer values out of their range; what was sent is not repeated."""
    entries = cast("RequestValidationError", error).errors()[:3]
    told = "; ".join(f"{entry['loc'][-1]}: {entry['msg']}" for entry in entries)
    return error_response(422, told.replace("Input should be", "expected"))


async def _on_spem(_: Request, error: Exception) -> Response:
    """Answer an error of the library: on what was asked for, or of an index that cannot be read."""
    if isinstance(error, ParameterError):
        return error_response(422, str(error))
    fail("the index cannot be read", error)
    return error_response(503, "the index cannot be read just now; come again later", {"Retry-After": "5"})
