"""Routes on the server itself: whether it lives, its figures, what it serves."""

from __future__ import annotations

from typing import Annotated, Any

from fastapi import APIRouter, Query
from starlette.responses import Response

from spem import __version__
from spem.server.cards import base_name
from spem.server.refusals import Refusal
from spem.server.replies import documented, documented_as, json_reply
from spem.server.schemas import Info, State
from spem.server.services import Live, Services
from spem.shapes.kinds import SUFFIXES

router = APIRouter()
_FIGURES = "text/plain; version=0.0.4"
ModelName = Annotated[str | None, Query(max_length=64, description="Digest of a model of the index.")]


@router.get("/health", tags=["service"], summary="Whether the process lives", responses=documented(State))
async def health() -> Response:
    """Answer at once."""
    return json_reply({"status": "ok"})


@router.get(
    "/ready", tags=["service"], summary="Whether requests may be sent", responses=documented(State, 503)
)
async def ready(live: Live) -> Response:
    """Answer 200 once the index is open, and until the server stops."""
    if not live.ready:
        raise Refusal(503, "not ready; the index is being opened or the server stops")
    return json_reply({"status": "ready"})


@router.get(
    "/metrics",
    tags=["service"],
    summary="Figures for Prometheus",
    responses=documented_as(_FIGURES, "Figures as Prometheus reads them."),
)
async def metrics(live: Live) -> Response:
    """Answer with the figures of this process."""
    page = await live.reads.run(live.metrics.page)
    return Response(page, headers={"Cache-Control": "no-store"}, media_type=_FIGURES)


@router.get("/api/info", tags=["index"], summary="What is served", responses=documented(Info, 404))
async def info(live: Live, model: ModelName = None) -> Response:
    """Tell the models, labels and limits of the index."""
    return json_reply(await live.reads.run(_info, live, model))


def _info(live: Services, model: str | None) -> dict[str, Any]:
    """Return what is served."""
    models = live.catalogue.models()
    digest = live.catalogue.digest(model) if models or model else None
    limits = {"upload_bytes": live.options.upload_bytes, "voxels": live.options.voxels}
    return {
        "version": __version__,
        "index": base_name(live.catalogue.index.store.address),
        "models": [vars(entry) for entry in models],
        "model": digest,
        "labels": live.catalogue.labels(digest) if digest else [],
        "limits": limits,
        "suffixes": list(SUFFIXES),
        "writable": live.options.token is not None,
    }
