"""Routes of files to keep: fields, maps, parts, surfaces and profiles of one shape."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Annotated, Any, Literal

from fastapi import APIRouter, Path, Query
from starlette.responses import Response

from spem.server.arrays import unpack_arrays
from spem.server.refusals import Refusal
from spem.server.replies import documented_as
from spem.server.routes_service import ModelName
from spem.server.routes_shapes import ShapeId
from spem.server.services import Live

router = APIRouter(prefix="/api/shapes", tags=["views"])
# Known without what makes them, so that the server itself stays small.
FILES = ("field.npz", "maps.npz", "parts.npz", "node.csv", "surface.ply")
_MOST_PARTS, _MOST_MAPS, _MOST_NODES = 12, 64, 2_000_000
_BINARY = "application/octet-stream"
# A worker that was taken over must not write headers of its own.
_PLAIN = re.compile(r"[\w.+/;= -]+", re.ASCII)


@router.get(
    "/{id}/{file}",
    summary="A file: " + ", ".join(FILES),
    responses=documented_as(_BINARY, "The file; its type goes with its name.", 404, 422),
)
async def download(
    live: Live,
    id: ShapeId,  # noqa: A002
    file: Annotated[str, Path(max_length=32, description="One of " + ", ".join(FILES))],
    node: Annotated[int | None, Query(ge=0, lt=_MOST_NODES, description="Node of a profile.")] = None,
    k: Annotated[int | None, Query(ge=1, le=_MOST_PARTS, description="Number of parts.")] = None,
    show: Annotated[
        Literal["map", "field", "part"] | None, Query(description="Colours of a surface.")
    ] = None,
    rho: Annotated[float | None, Query(gt=0, allow_inf_nan=False, description="ρ of a field.")] = None,
    map: Annotated[int | None, Query(ge=1, le=_MOST_MAPS, description="Number of a map.")] = None,  # noqa: A002
    model: ModelName = None,
) -> Response:
    """Answer with a file of what is shown of a shape."""
    if file not in FILES:
        raise Refusal(404, f"no such file; expected one of {', '.join(FILES)}")
    given: dict[str, Any] = {"node": node, "k": k, "show": show, "rho": rho, "map": map}
    options = {"file": file} | {name: value for name, value in given.items() if value is not None}
    digest, _ = await live.reads.run(live.row, model, id)
    packed = await live.viewing.body(
        digest, id, "download", options, lambda: live.row(digest, id, "shape")[1]
    )
    header, arrays = unpack_arrays(packed)
    name, media_type = _plain(header, "file"), _plain(header, "media_type")
    headers = {"Content-Disposition": f'attachment; filename="{name}"', "Cache-Control": "no-store"}
    return Response(arrays["body"].tobytes(), 200, headers, media_type)


def _plain(header: Mapping[str, Any], name: str) -> str:
    """Return a text of a view that is fit for a header."""
    value = header.get(name)
    if isinstance(value, str) and _PLAIN.fullmatch(value):
        return value
    raise Refusal(422, "this file cannot be made; please report it")
