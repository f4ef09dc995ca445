"""``spem search``: ranked answers to a query, from an index or from codes."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from spem.cli.index import ModelName, Where, opened
from spem.cli.options import Json
from spem.cli.output import print_json, print_table
from spem.errors import ParameterError

if TYPE_CHECKING:
    from spem.index.answers import Answers

_OF_AN_INDEX = ("--where", "--model", "--rerank", "--exact or --approximate", "--matched-size")


def search(
    collection: Annotated[
        str,
        typer.Argument(
            metavar="DB|CODES",
            help="Index: folder, or address such as s3://bucket/shapes; or a file that spem encode wrote.",
        ),
    ],
    query: Annotated[
        str,
        typer.Argument(
            metavar="QUERY", help="File of a shape; or the name, path or id of one that is there."
        ),
    ],
    k: Annotated[int, typer.Option("-k", min=1, help="Number of answers.")] = 10,
    where: Where = None,
    model: ModelName = None,
    rerank: Annotated[
        bool,
        typer.Option(
            "--rerank", help="Order the nearest 200 by diffusion; distances are those of diffusion."
        ),
    ] = False,
    exact: Annotated[
        bool | None,
        typer.Option(
            "--exact/--approximate",
            help="Compare all codes, or ask the approximate index. [exact up to 100000 shapes]",
        ),
    ] = None,
    matched_size: Annotated[
        float | None,
        typer.Option(
            min=1.0, metavar="RATIO", help="Only shapes whose volume is within this ratio, as 1.25."
        ),
    ] = None,
    json: Json = False,
) -> None:
    """Rank the shapes of a collection for a query.

    The nearest comes first. The query is coded with the settings and the vocabulary of the collection. One of
    the collection finds itself. Below the answers stands how they were found.

    \b
    Examples:
      spem search shapes.db query.obj
      spem search shapes.db cat_03 -k 5 --where "label = 'cat' AND metadata.site = 'Oslo'"
      spem search shapes.spem query.obj --json
    """  # noqa: D301
    if "://" not in collection and not Path(collection).is_dir():
        given = (where, model, rerank or None, exact, matched_size)
        _search_codes(Path(collection), query, k, given, json=json)
        return
    answers = opened(collection).search(
        query, k, where=where, model=model, exact=exact, rerank=rerank, volume_within=matched_size
    )
    _tell(answers, json=json)


def _tell(answers: Answers, *, json: bool) -> None:
    """Print the answers of an index, and how they were found."""
    if json:
        facts = {"method": answers.method, "recall": answers.recall, "model": answers.model}
        print_json(facts | {"answers": answers.to_dicts()})
        return
    rows = [
        (str(one.rank), f"{one.distance:.4f}", one.row.name, one.row.label, one.row.id, one.row.path)
        for one in answers
    ]
    print_table(("rank", "distance", "name", "label", "id", "path"), rows, left=(2, 3, 4, 5))
    typer.echo(answers.manner)


def _search_codes(codes: Path, query: str, k: int, given: tuple[Any, ...], *, json: bool) -> None:
    """Print the answers of a file of codes, which has no more than names and paths."""
    from spem.collections import search as find

    for option, value in zip(_OF_AN_INDEX, given, strict=True):
        if value is not None:
            msg = f"{option}: {codes} is a file of codes; make an index with: spem index add DB SHAPES"
            raise ParameterError(msg)
    answers = find(codes, query, k)
    if json:
        print_json(
            [{"rank": a.rank, "name": a.name, "path": a.path, "distance": a.distance} for a in answers]
        )
        return
    rows = [(str(a.rank), f"{a.distance:.4f}", a.name, a.path) for a in answers]
    print_table(("rank", "distance", "name", "path"), rows, left=(2, 3))
