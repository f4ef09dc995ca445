"""Routes on what the explorer shows of a shape: geometry, field, parts, sources."""

from __future__ import annotations

from typing import Annotated, Any

from fastapi import APIRouter, Path, Query, Request
from starlette.responses import Response

from spem import __version__
from spem.server.arrays import MEDIA_TYPE
from spem.server.replies import documented_arrays, kept_reply, tag_of
from spem.server.routes_service import ModelName
from spem.server.routes_shapes import ShapeId
from spem.server.services import Live, Services

router = APIRouter(prefix="/api/shapes", tags=["views"])
_MOST_PARTS = 12
_MOST_PATCHES = 100_000


@router.get(
    "/{id}/geometry",
    summary="Nodes, contours or surface",
    responses=documented_arrays("node, and contour… in 2-D or vertex…, face in 3-D.", 404, 422),
)
async def geometry(request: Request, live: Live, id: ShapeId, model: ModelName = None) -> Response:  # noqa: A002
    """Answer with the nodes of a shape on its grid, and with what bounds it."""
    return await _view(request, live, model, id, "geometry", {})


@router.get(
    "/{id}/field",
    summary="Fields at all ρ, in low-rank form",
    responses=documented_arrays("basis, coefficients, rho, rho_relative, maps, population.", 404, 422),
)
async def field(request: Request, live: Live, id: ShapeId, model: ModelName = None) -> Response:  # noqa: A002
    """Answer with the hyperfield: the field at ``rho[i]`` is ``basis @ coefficients[i]``."""
    return await _view(request, live, model, id, "field", {})


@router.get(
    "/{id}/parts",
    summary="Parts",
    responses=documented_arrays("node_part, strength, sizes, and contour_part or vertex_part.", 404, 422),
)
async def parts(
    request: Request,
    live: Live,
    id: ShapeId,  # noqa: A002
    k: Annotated[int | None, Query(ge=1, le=_MOST_PARTS, description="Number; chosen where absent.")] = None,
    model: ModelName = None,
) -> Response:
    """Answer with the parts of a shape; the first time it takes seconds."""
    return await _view(request, live, model, id, "parts", {} if k is None else {"k": k})


@router.get(
    "/{id}/source/{patch}",
    summary="Log field of one source",
    responses=documented_arrays("log.", 404, 422),
)
async def source(
    request: Request,
    live: Live,
    id: ShapeId,  # noqa: A002
    patch: Annotated[int, Path(ge=0, le=_MOST_PATCHES, description="Patch of the boundary.")],
    model: ModelName = None,
) -> Response:
    """Answer with the logarithm of the field of one patch of the boundary."""
    return await _view(request, live, model, id, "source", {"patch": patch})


async def _view(
    request: Request, live: Services, model: str | None, key: str, view: str, options: dict[str, Any]
) -> Response:
    """Return a view, kept from before or computed."""
    digest, _ = await live.reads.run(live.row, model, key)
    body = await live.viewing.body(digest, key, view, options, lambda: live.row(digest, key, "shape")[1])
    tag = tag_of(__version__, digest, key, view, *sorted(options.items()))
    return kept_reply(request, body, MEDIA_TYPE, tag)
