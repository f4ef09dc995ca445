"""Routes on the collection as a whole: its map, and why two shapes are alike."""

from __future__ import annotations

from typing import Annotated

from fastapi import APIRouter, Query, Request
from starlette.responses import Response

from spem import __version__
from spem.index.database_errors import told
from spem.index.row import Row
from spem.server.arrays import MEDIA_TYPE, pack_arrays
from spem.server.collection_map import collection_map
from spem.server.refusals import Refusal
from spem.server.replies import documented, documented_arrays, kept_reply, tag_of
from spem.server.routes_service import ModelName
from spem.server.schemas import CollectionMap
from spem.server.services import Live, Services
from spem.server.viewing import packed_shape

router = APIRouter(prefix="/api", tags=["index"])
Shown = Annotated[str, Query(max_length=110, description="Id of a shape, or upload-JOB.")]
_MOST_WORDS = 32


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
    store = live.catalogue.index.store
    with told(store.address):
        return digest, int(store.table(digest).version)


@router.get(
    "/words",
    tags=["views"],
    summary="Why two shapes are alike",
    responses=documented_arrays("query_points and answer_points of the words of the header.", 404, 422),
)
async def words(
    request: Request,
    live: Live,
    query: Shown,
    answer: Shown,
    n: Annotated[int, Query(ge=1, le=_MOST_WORDS, description="Number of words.")] = 4,
    model: ModelName = None,
) -> Response:
    """Answer with the visual words that two shapes share most, and where they lie on each."""
    digest = await live.reads.run(_common_model, live, model, query, answer)
    key = ("words", digest, query, answer, n)
    body = await live.kept.get(key, lambda: live.views.run(_words, live, digest, query, answer, n))
    return kept_reply(request, body, MEDIA_TYPE, tag_of(__version__, *key))


def _common_model(live: Services, model: str | None, *keys: str) -> str:
    """Return the model of two shapes; an upload has that which it was encoded with."""
    [first, second] = [live.row(model, key)[0] for key in keys]
    if first != second:
        raise Refusal(422, f"shapes of two models, {first} and {second}; send the file again for the other")
    return first


def _words(live: Services, digest: str, query: str, answer: str, n: int) -> bytes:
    """Compute the words of two shapes."""
    from spem.server.views.words import pack_pair

    rows: list[Row] = [live.row(digest, key, "shape")[1] for key in (query, answer)]
    header = {"model_file": str(live.jobs.model_file(digest)), "n": n, "name": rows[0].name}
    return pack_arrays(*live.viewing.run("words", header, pack_pair(*map(packed_shape, rows))))
