"""Routes on the collection as a whole: its map, and why two shapes are alike."""

from __future__ import annotations

from fastapi import APIRouter, Request
from starlette.responses import Response

from spem.server.collection_map import collection_map
from spem.server.replies import documented, kept_reply, tag_of
from spem.server.routes_service import ModelName
from spem.server.schemas import CollectionMap
from spem.server.services import Live, Services

router = APIRouter(prefix="/api", tags=["index"])


@router.get("/map", summary="The collection in the plane", responses=documented(CollectionMap, 404))
async def whole_map(request: Request, live: Live, model: ModelName = None) -> Response:
    """Answer with a place for each shape, like ones side by side; the first time it takes a while."""
    digest, version = await live.reads.run(_version, live, model)
    key = ("map", digest, version)
    body = await live.kept.get(key, lambda: live.views.run(collection_map, live.catalogue, digest))
    return kept_reply(request, body, "application/json", tag_of(*key), 0)


def _version(live: Services, model: str | None) -> tuple[str, int]:
    """Return the model and the version of its table."""
    digest = live.catalogue.digest(model)
    return digest, int(live.catalogue.index.store.table(digest).version)
