"""Routes of work in the background: search by a file, encode one, add and remove shapes; and of jobs."""

from __future__ import annotations

from typing import Annotated, Any

from fastapi import APIRouter, Header, Path, Request
from starlette.responses import Response

from spem.errors import QueueFullError, ReadError
from spem.server.forms import Form
from spem.server.queries import Filters
from spem.server.refusals import Busy, Refusal
from spem.server.replies import documented, json_reply
from spem.server.routes_service import ModelName
from spem.server.routes_shapes import ShapeId
from spem.server.schemas import JobStatus, JobTicket, Removed
from spem.server.security import require_token
from spem.server.services import Live, Services

router = APIRouter(prefix="/api")
JobId = Annotated[str, Path(pattern=r"^[0-9a-f]{24}$", description="Id of a job.")]
Token = Annotated[str | None, Header(alias="Authorization", max_length=1024, description="Bearer TOKEN")]
_TAKEN = (404, 413, 415, 422)
_MOST_ANSWERS = 1000


def _form(**fields: str) -> dict[str, Any]:
    """Return what OpenAPI says of a form with a file and fields."""
    texts = {name: {"type": "string", "description": text} for name, text in fields.items()}
    file = {"file": {"type": "string", "format": "binary", "description": "Image, volume or mesh."}}
    schema = {"type": "object", "required": ["file"], "properties": file | texts}
    return {"requestBody": {"required": True, "content": {"multipart/form-data": {"schema": schema}}}}


@router.post(
    "/search",
    tags=["jobs"],
    summary="Search by a file",
    status_code=202,
    responses=documented(JobTicket, *_TAKEN, status=202),
    openapi_extra=_form(k="Number of answers, 12 by default.", label="Only shapes of this label."),
)
async def search(request: Request, live: Live, model: ModelName = None) -> Response:
    """Take a file; the result of the job is as that of neighbours."""
    form = await live.forms.receive(request)
    wanted = {
        "k": form.whole("k", 12, 1, _MOST_ANSWERS),
        "where": Filters(label=form.text("label") or None).where(),
    }
    return await _submitted(live, "search", model, form, wanted)


@router.post(
    "/encode",
    tags=["jobs"],
    summary="Encode a file",
    status_code=202,
    responses=documented(JobTicket, *_TAKEN, status=202),
    openapi_extra=_form(),
)
async def encode(request: Request, live: Live, model: ModelName = None) -> Response:
    """Take a file; the result of the job has its code."""
    return await _submitted(live, "encode", model, await live.forms.receive(request), {})


@router.post(
    "/shapes",
    tags=["shapes"],
    summary="Add a file to the index",
    status_code=202,
    responses=documented(JobTicket, 401, 403, *_TAKEN, status=202),
    openapi_extra=_form(name="Name for people.", label="The label.", metadata="A JSON object."),
)
async def add(request: Request, live: Live, authorization: Token = None, model: ModelName = None) -> Response:
    """Take a file; the job adds its shapes."""
    require_token(authorization, live.options.token)
    form = await live.forms.receive(request)
    wanted = {"label": form.text("label"), "metadata": form.metadata()}
    title = form.text("name")
    return await _submitted(live, "add", model, form, wanted | ({"title": title} if title else {}))


@router.delete(
    "/shapes/{id}",
    tags=["shapes"],
    summary="Remove a shape from the index",
    responses=documented(Removed, 401, 403, 404),
)
async def remove(live: Live, id: ShapeId, authorization: Token = None, model: ModelName = None) -> Response:  # noqa: A002
    """Remove a row; the file that it was made of stays where it is."""
    require_token(authorization, live.options.token)
    return json_reply({"removed": await live.reads.run(_remove, live, model, id)})


def _remove(live: Services, model: str | None, key: str) -> int:
    """Remove a row."""
    digest = live.catalogue.digest(model, key)
    live.catalogue.row(digest, key)
    removed = live.catalogue.index.remove(key, model=digest)
    live.catalogue.changed()
    return removed


@router.get(
    "/jobs/{job}", tags=["jobs"], summary="How far a job is", responses=documented(JobStatus, 404, 422)
)
async def job_status(live: Live, job: JobId) -> Response:
    """Tell the state of a job, and its result when it is done; it is kept for an hour."""
    try:
        return json_reply(live.jobs.status(job))
    except ReadError as error:
        raise Refusal(404, str(error)) from error


@router.delete(
    "/jobs/{job}", tags=["jobs"], summary="Cancel a job", responses=documented(JobStatus, 404, 422)
)
async def cancel(live: Live, job: JobId) -> Response:
    """Cancel a job that waits or runs; one that is over stays as it is."""
    try:
        await live.reads.run(live.jobs.cancel, job)
        return json_reply(live.jobs.status(job))
    except ReadError as error:
        raise Refusal(404, str(error)) from error


async def _submitted(
    live: Services, kind: str, model: str | None, form: Form, wanted: dict[str, Any]
) -> Response:
    """Queue a job."""
    digest = await live.reads.run(live.catalogue.digest_for, model, form.name)
    header = {"name": form.name, "model": digest, "voxels": live.options.voxels, **wanted}
    try:
        job = await live.reads.run(live.jobs.submit, kind, header, form.payload, form.client)
    except QueueFullError as error:
        raise Busy(str(error), error.seconds) from error
    return json_reply({"job": job}, 202)
