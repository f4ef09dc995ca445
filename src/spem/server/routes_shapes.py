"""Routes on the shapes of the index: lists, single ones, pictures, neighbours."""

from __future__ import annotations

from typing import Annotated

from fastapi import APIRouter, Path, Query, Request
from starlette.responses import Response

from spem.server.cards import full_card
from spem.server.queries import LONGEST_TEXT, Filters, Sort, parse_metadata
from spem.server.refusals import Refusal
from spem.server.replies import documented, documented_as, json_reply, kept_reply, tag_of
from spem.server.routes_service import ModelName
from spem.server.schemas import FullCard, Page, Ranking
from spem.server.services import Live, Services
from spem.server.submissions import UPLOAD

router = APIRouter(prefix="/api/shapes", tags=["shapes"])
_LARGEST_OFFSET = 10**9
_MOST_DIMENSIONS = 16
ShapeId = Annotated[str, Path(max_length=110, description="Id of a shape, or upload-JOB.")]
Label = Annotated[str | None, Query(max_length=LONGEST_TEXT, description="The label.")]
Dimension = Annotated[int | None, Query(ge=1, le=_MOST_DIMENSIONS, description="The dimension.")]
Metadata = Annotated[list[str], Query(max_length=8, description="KEY:VALUE, all of which have to hold.")]


@router.get("", summary="One page of shapes", responses=documented(Page, 404, 422))
async def shapes(
    live: Live,
    q: Annotated[str, Query(max_length=LONGEST_TEXT, description="Part of the name.")] = "",
    label: Label = None,
    ndim: Dimension = None,
    metadata: Metadata = [],  # noqa: B006
    sort: Sort = "name",
    offset: Annotated[int, Query(ge=0, le=_LARGEST_OFFSET)] = 0,
    limit: Annotated[int, Query(ge=0, le=500)] = 48,
    model: ModelName = None,
) -> Response:
    """List the shapes that pass all filters: by name, the latest or the largest first."""
    filters = Filters(q, label or None, ndim, parse_metadata(metadata))

    def find() -> bytes:
        return live.catalogue.page(live.catalogue.digest(model), filters, sort, offset, limit)

    return json_reply(await live.reads.run(find))


@router.get("/{id}", summary="One shape, with its report", responses=documented(FullCard, 404))
async def shape(live: Live, id: ShapeId, model: ModelName = None) -> Response:  # noqa: A002
    """Tell all that is known of a shape."""
    digest, row = await live.reads.run(live.row, model, id)
    return json_reply(full_card(row, digest))


@router.get(
    "/{id}/thumbnail.png",
    summary="Its picture",
    responses=documented_as("image/png", "A small picture.", 404),
)
async def thumbnail(request: Request, live: Live, id: ShapeId, model: ModelName = None) -> Response:  # noqa: A002
    """Answer with a picture of at most some hundred pixels."""
    picture = await live.reads.run(_picture, live, model, id)
    if not picture:
        raise Refusal(404, "no picture of a shape of this dimension")
    return kept_reply(request, picture, "image/png", tag_of(picture))


@router.get("/{id}/neighbours", summary="The shapes nearest to one", responses=documented(Ranking, 404, 422))
async def neighbours(
    live: Live,
    id: ShapeId,  # noqa: A002
    k: Annotated[int, Query(ge=1, le=1000, description="Number of answers.")] = 12,
    label: Label = None,
    ndim: Dimension = None,
    metadata: Metadata = [],  # noqa: B006
    rerank: Annotated[bool, Query(description="Rank again by diffusion.")] = False,
    model: ModelName = None,
) -> Response:
    """Search by a shape of the index, or by an upload of the last hour; it finds itself first."""
    where = Filters("", label or None, ndim, parse_metadata(metadata)).where()

    def find() -> bytes:
        if not id.startswith(UPLOAD):
            return live.catalogue.neighbours(live.catalogue.digest(model, id), id, k, where, rerank=rerank)
        digest, row = live.row(model, id)
        return live.catalogue.nearest(digest, row, k, where, rerank=rerank)

    return json_reply(await live.reads.run(find))


def _picture(live: Services, model: str | None, key: str) -> bytes:
    """Return the thumbnail of a shape of the index, or of an upload."""
    if key.startswith(UPLOAD):
        return live.row(model, key)[1].thumbnail
    return live.catalogue.thumbnail(live.catalogue.digest(model, key), key)
