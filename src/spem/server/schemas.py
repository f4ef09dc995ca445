"""The answers of the interface, as OpenAPI tells of them; they are written without being checked again."""

from __future__ import annotations

from typing import Any

from pydantic import BaseModel, Field


class Problem(BaseModel):
    """Any error."""

    error: str = Field(examples=["no such shape; it may have been removed"])


class State(BaseModel):
    """Whether the server lives, or may be sent requests."""

    status: str = Field(examples=["ok"])


class ModelInfo(BaseModel):
    """A model of the index."""

    digest: str
    features: str = Field(examples=["spem+surface-wks"])
    ndim: int | None = Field(description="Dimension of its shapes; null for any.")
    n_shapes: int
    n_code: int


class LabelCount(BaseModel):
    """A label, and how many shapes have it."""

    label: str
    n: int


class LimitsInfo(BaseModel):
    """What an upload may have."""

    upload_bytes: int
    voxels: int


class Info(BaseModel):
    """What is served."""

    version: str
    index: str
    models: list[ModelInfo]
    model: str | None
    labels: list[LabelCount]
    limits: LimitsInfo
    suffixes: list[str]
    writable: bool


class Card(BaseModel):
    """A shape, as lists show it."""

    id: str = Field(examples=["0123456789abcdef0123"])
    name: str
    label: str
    ndim: int
    n_nodes: int
    volume: float | None = Field(description="In the unit of the file to the power of the dimension.")
    file: str = Field(description="Base name of the file.")
    metadata: dict[str, str]
    added: str = Field(description="Time in UTC, ISO 8601.")
    copies: int = Field(description="Number of other files of the same content.")


class FullCard(Card):
    """A shape, with its report."""

    report: dict[str, Any]
    model: str


class Page(BaseModel):
    """One page of shapes."""

    total: int
    shapes: list[Card]


class AnswerEntry(BaseModel):
    """One answer to a query."""

    rank: int
    distance: float
    shape: Card


class Ranking(BaseModel):
    """Answers, nearest first."""

    query: Card
    method: str = Field(examples=["exact"])
    model: str
    seconds: float
    answers: list[AnswerEntry]


class JobTicket(BaseModel):
    """A job that was taken."""

    job: str


class JobStatus(BaseModel):
    """How far a job is."""

    id: str
    kind: str = Field(examples=["search"])
    state: str = Field(description="queued, running, done, failed or cancelled")
    progress: float = Field(ge=0, le=1)
    stage: str
    position: int | None
    error: str | None
    result: dict[str, Any] | None


class Removed(BaseModel):
    """How many rows were removed."""

    removed: int


class MapPoint(BaseModel):
    """The place of a shape in the map of the collection."""

    id: str
    x: float
    y: float
    label: str
    name: str


class CollectionMap(BaseModel):
    """The collection in the plane; shapes that are alike lie close."""

    method: str
    points: list[MapPoint]
    total: int
